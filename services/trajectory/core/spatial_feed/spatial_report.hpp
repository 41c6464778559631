// Tells what a planned run of tool motion does: which limit binds where the feed is not held, and samples of it.
//
// Model: everything is measured on the final polynomials and knots; binding as in feed/binding, of cuts for whoever asks, of
// traverses for the samples. Frames: W. Units: mm, rad, s. Threads: pure. Cost: linear in knots.
#pragma once

#include "trajectory/core/spatial_feed/pose_check.hpp"
#include "trajectory/core/spatial_feed/spatial_stretch.hpp"

namespace lambdajet::trajectory {

// Adds slow stretches, binding lengths and samples to a plan that holds its limits. `check` has followed it to its end.
void ReportSpatialStretch(const SpatialDraft& draft, PoseCheck& check, SpatialStretchPlan& plan);

}  // namespace lambdajet::trajectory
