// Tells what a planned stretch does: which limit binds where the feed is not held, how idle moves are made, and samples of it.
//
// Model: everything is measured on the final polynomials, not taken from what the speed profile believed; binding as in
// feed/binding. Frames: W. Units: mm, s. Threads: pure. Cost: linear in segments.
#pragma once

#include "trajectory/core/feed/contour_check.hpp"
#include "trajectory/core/feed/stretch.hpp"
#include "trajectory/core/feed/stretch_draft.hpp"

namespace lambdajet::trajectory {

// Adds places, idle reports, slow stretches, binding lengths and samples to a plan that holds its limits. `contour` has
// followed it to its end.
void ReportStretch(const PlanningModel& model, const StretchDraft& draft, ContourCheck& contour,
                   StretchPlan& plan);

}  // namespace lambdajet::trajectory
