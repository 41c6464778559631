// Lays a grid over a run of tool motion and gives every grid point its bounds for the speed profile of six struts.
//
// Model: on straight blocks a node a millimetre of path length, on arcs also a tenth of the radius of curvature; blocks
// shorter than a node's distance share a node, their bend is the net change of direction over a millimetre, as a vector in
// six dimensions; a node stands where the feed changes, and in the middle of a block, however short, that can be driven faster
// than its ends. Corners are slowed so that the smoothing's deviation stays within both tolerances and the change of
// velocity within what path and struts can do during the first average. Every node's reach is checked.
// Frames: W. Units: mm, rad, s. Threads: pure. Cost: about 10 us a node.
#pragma once

#include <vector>

#include "trajectory/core/feed/smoothing.hpp"
#include "trajectory/core/feed/speed_profile.hpp"
#include "trajectory/core/part_program/read_program.hpp"
#include "trajectory/core/spatial_feed/spatial_path.hpp"
#include "trajectory/core/spatial_feed/strut_motion.hpp"

namespace lambdajet::trajectory {

struct SpatialOptions {
  double feed_scale = 1.0;  // of programmed feeds, (0, 1.2]
  double knot_s = 0.002;
  int knots_per_segment = 4;
  ProgramNotation notation = ProgramNotation::kByContent;  // of a text
};

// What every run of a program is planned with.
struct SpatialModel {
  SpatialModel(const HexapodGeometry& geometry, const HexapodMotion& motion, const SpatialOptions& options);

  const HexapodMotion& motion;
  const SpatialOptions& options;
  StrutMotion struts;
  double turn_radius_mm = 0.0;
  SmoothingFilter filter;
  double overshoot = 1.0;         // of the filter, on normal acceleration
  double kink_deviation_s = 0.0;  // of the filter
  double path_acceleration_mm_per_s2 = 0.0;
  ActuatorBoundsOf<6> bounds;  // with planning margin
};

using SpatialNode = ProfileNodeOf<6>;

// Nodes of a run with everything but x; what the machine cannot reach becomes a fault, one a line.
std::vector<SpatialNode> MakeSpatialNodes(const SpatialModel& model, const SpatialRun& run,
                                          std::vector<ProgramFault>& faults);

}  // namespace lambdajet::trajectory
