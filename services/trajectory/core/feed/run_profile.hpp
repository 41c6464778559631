// Lays a grid over a run and gives every grid point its bounds for the speed profile.
//
// Model: on lines a node a millimetre, on arcs also a tenth of the radius; blocks shorter than a node's distance share a node,
// their curvature is the net turning of their kinks over a millimetre; a node stands where the feed changes, and in the middle
// of a block, however short, that can be driven faster than its ends. Kinks are slowed so that the smoothing's deviation stays
// within the block's tolerance and the velocity change within what the path acceleration can do during its first average.
// With compensation, feed is also bounded by the jet's lag: (v T)^2/(2 R) on arcs, v T sin(angle/2)/2 at kinks.
// Units: mm, s. Threads: pure. Cost: about 0.1 us a node.
#pragma once

#include <vector>

#include "trajectory/core/feed/planning_model.hpp"

namespace lambdajet::trajectory {

// Nodes of a run with everything but x. Nodes the mechanism cannot reach are reported as a fault.
std::vector<ProfileNode> MakeRunNodes(const PlanningModel& model, const PathElement& run,
                                      std::vector<ProgramFault>& faults);

}  // namespace lambdajet::trajectory
