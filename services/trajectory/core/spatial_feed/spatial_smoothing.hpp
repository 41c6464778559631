// Smooths a spatial motion sampled in time so that its jerk is bounded, without leaving its path.
//
// Model: the averages and the quintic B-spline of feed/smoothing.hpp over tip, quaternion and path length. The mean of
// quaternions that turn about one axis stays in their plane and is normalised where it is read, so a turn about a fixed axis
// keeps its axis exactly; the tip's pull inwards on arcs is corrected as in feed/smoothing.hpp.
// Frames: W. Units: mm, rad, s. Shapes: samples one a knot. Threads: values.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "trajectory/core/feed/smoothing.hpp"
#include "trajectory/core/spatial_feed/strut_motion.hpp"

namespace lambdajet::trajectory {

using SpatialSample = Eigen::Matrix<double, 8, 1>;  // x, y, z, quaternion w, x, y, z, path length

std::vector<SpatialSample> Smooth(const SmoothingFilter& filter, const std::vector<SpatialSample>& samples);

struct SpatialKnot {
  ToolMotion tool;
  Eigen::Vector3d jerk_mm_per_s3 = Eigen::Vector3d::Zero();
  Eigen::Vector3d turn_jerk_rad_per_s3 = Eigen::Vector3d::Zero();
  double s_mm = 0.0;
  double path_speed_mm_per_s = 0.0;
  double path_acceleration_mm_per_s2 = 0.0;
};

// The motion at control point `index`; needs two neighbours either side.
SpatialKnot EvaluateKnot(const std::vector<SpatialSample>& control, std::size_t index, double knot_s);

}  // namespace lambdajet::trajectory
