// Cuts off what of a program's path has been done, so that the rest can be planned from there.
//
// Model: resume backs up by the overlap along the cut, pierces again there and goes on with the modal state of that place;
// where the jet was off, it goes on with the next element. Path length keeps counting from the program's start, so events
// and gates lie where they lay. Frames: W. Units: mm. Threads: pure.
#pragma once

#include <optional>
#include <vector>

#include "foundation/machine/machine_description.hpp"
#include "trajectory/core/feed/plan_program.hpp"
#include "trajectory/core/feed/program_path.hpp"

namespace lambdajet::trajectory {

// `element_begin_s_mm`: where each element of `path` begins in the whole plan. Nothing if no cut is left.
std::optional<ProgramPath> PathFrom(const ProgramPath& path, const std::vector<double>& element_begin_s_mm,
                                    double length_mm, const PlanOptions& options,
                                    const MachineDescription& machine);

}  // namespace lambdajet::trajectory
