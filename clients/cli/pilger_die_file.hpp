// Reads a pilger die from a YAML file: groove, wheel, range of passes, and how the program is to be written.
//
// Errors: INVALID_ARGUMENT with the reason YAML_… and the line for a file that is not understood; keys that are not known
// are refused, none is skipped. Units: the keys end in theirs; degrees, as people draw dies.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "trajectory/core/grinding/pilger_program.hpp"

namespace lambdajet::cli {

struct PilgerDieFile {
  std::string name;
  trajectory::PilgerDie die;
};

absl::StatusOr<PilgerDieFile> ReadPilgerDie(const std::string& path);

}  // namespace lambdajet::cli
