// Draws the verification of a program (every coordinate with both derivatives) and the grinding of a pilger die.
//
// Units: mm and degrees on the axes; derivatives by mm or rad. Threads: one. Errors: those of picture.hpp.
#pragma once

#include <string>

#include "absl/status/status.h"
#include "trajectory/core/grinding/pilger_program.hpp"
#include "trajectory/core/part_program/cldata_verification.hpp"

namespace lambdajet::cli {

absl::Status DrawVerification(const trajectory::ProgramVerification& verification, const std::string& path);
absl::Status DrawPilger(const trajectory::PilgerProgram& program, const trajectory::PilgerDie& die,
                        const std::string& path);

}  // namespace lambdajet::cli
