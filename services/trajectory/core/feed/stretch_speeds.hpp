// Finds the speeds of a stretch's runs and the shapes of its idle moves, and sets them in time one after the other.
//
// Model: each run time-optimal on its path under caps, accelerations and the pace of the passes before; the end of a cut that
// an idle move follows is left at the speed that brings the next pierce soonest. An exact stop lets the smoothing run out;
// between moves that meet at standstill the first average lies between stopping and starting, so that their accelerations
// do not add up to a jerk of twice the limit. Frames: W. Units: mm, s. Threads: pure. Cost: linear in nodes.
// Errors: faults with line and reason, where no idle move stays within reach.
#pragma once

#include <vector>

#include "trajectory/core/feed/planning_model.hpp"
#include "trajectory/core/feed/stretch_draft.hpp"

namespace lambdajet::trajectory {

// Runs get their nodes, and every element the pace that is wished.
void PrepareElements(const PlanningModel& model, StretchDraft& draft, std::vector<ProgramFault>& faults);

// Answers how long the whole takes before it is smoothed, s.
double SetSpeeds(const PlanningModel& model, StretchDraft& draft, std::vector<ProgramFault>& faults);

}  // namespace lambdajet::trajectory
