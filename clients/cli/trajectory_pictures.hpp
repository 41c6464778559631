// Draws a plan: the path on the sheet coloured by speed or by what limits it, and speed, acceleration and sliders over time.
//
// Frames: W. Units: mm, s. Threads: one. Errors: those of picture.hpp.
#pragma once

#include <string>

#include "absl/status/status.h"
#include "foundation/machine/machine_description.hpp"
#include "trajectory/core/feed/plan_program.hpp"

namespace lambdajet::cli {

// `colour`: "speed" or "limit".
absl::Status DrawPlan(const trajectory::PlannedProgram& planned, const MachineDescription& machine,
                      const std::string& colour, const std::string& path);

}  // namespace lambdajet::cli
