// Reads the hexapod that the house is started with.
//
// Errors: those of ReadHexapodFile. Threads: start-up only.
#pragma once

#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "kinematics/core/active_machine.hpp"

namespace lambdajet::kinematics {

// Null for an empty path.
absl::StatusOr<std::shared_ptr<const OwnHexapod>> ReadOwnHexapod(const std::string& path);

}  // namespace lambdajet::kinematics
