// Draws a plan: the path on the sheet coloured by speed, by what limits it or by predicted error, and over time speed,
// acceleration, jerk and both sliders' motion against their limits; where the programmed feed is not held is shaded.
//
// Colours: one ramp from dark to bright that reads the same in grey, and Okabe and Ito's eight, told apart by everybody.
// Frames: W. Units: mm, s. Threads: one. Errors: those of picture.hpp; FAILED_PRECONDITION with prediction's reason.
#pragma once

#include <string>

#include "absl/status/status.h"
#include "foundation/machine/machine_description.hpp"
#include "trajectory/core/feed/plan_program.hpp"

namespace lambdajet::cli {

// `colour`: "speed", "limit" or "error".
absl::Status DrawPlan(const trajectory::PlannedProgram& planned, const MachineDescription& machine,
                      const std::string& colour, const std::string& path);

}  // namespace lambdajet::cli
