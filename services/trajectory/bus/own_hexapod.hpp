// Reads the hexapod that the house is started with.
//
// Errors: those of ReadHexapodFile. Threads: start-up only.
#pragma once

#include <memory>
#include <string>

#include "absl/status/status.h"
#include "platform/config/schema.hpp"
#include "trajectory/core/spatial_feed/spatial_program.hpp"

namespace lambdajet::trajectory {

class OwnHexapod {
 public:
  explicit OwnHexapod(ConfigSchema& schema);  // adds hexapod_file
  OwnHexapod(const OwnHexapod&) = delete;
  OwnHexapod& operator=(const OwnHexapod&) = delete;

  absl::Status Read();
  const std::shared_ptr<const HexapodModel>& model() const { return model_; }  // null: none was named

 private:
  std::string file_;
  std::shared_ptr<const HexapodModel> model_;
};

}  // namespace lambdajet::trajectory
