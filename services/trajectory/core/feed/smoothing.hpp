// Smooths a motion sampled in time so that its jerk is bounded, without leaving the contour.
//
// Model: symmetric moving averages of T1, T2 and T3 over samples a knot apart, then a uniform quintic B-spline with the averaged
// samples as control points: the motion is four times continuously differentiable, and every average keeps what is convex
// (speed, magnitude of acceleration). An average pulls an arc inwards by sigma^2/2 of its normal acceleration, sigma^2 the
// kernel's variance; that much is added outwards first (only along the normal, so that path length stays monotone), itself
// averaged over half of T1, so that where curvature jumps the correction adds next to no jerk. What is left is of fourth
// order on arcs, and shows at kinks and junctions; the planner measures it.
// Units: mm, s. Shapes: samples one a knot, `reach()` samples of rest before and after. Threads: values.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

namespace lambdajet::trajectory {

using PathSample = Eigen::Vector3d;  // x, y, path length

struct SmoothingFilter {
  double knot_s = 0.002;
  // How long the averages are, at least a knot; the last is the outward correction's own.
  double first_s = 0.002;
  double second_s = 0.002;
  double third_s = 0.002;
  double correction_s = 0.002;

  // Wide enough for the path's jerk limit; with `ramp_s2` above 0 so that T2 T3 is at least that: a jump of jerk then becomes
  // a fifth derivative of at most the jump over ramp_s2.
  static SmoothingFilter ForLimits(double knot_s, double acceleration_mm_per_s2, double jerk_mm_per_s3,
                                   double ramp_s2);

  double variance_s2() const;
  int reach() const;  // samples either side that a value depends on
  double half_support_s() const { return (reach() + 0.5) * knot_s; }
  // Peak of the answer to a unit step in normal acceleration; above 1 because of the outward correction.
  double overshoot() const;
  // Distance of the path from a kink crossed with a change of velocity of 1 mm/s, in s.
  double kink_deviation_s() const;
};

// Value and four derivatives at a knot.
struct KnotState {
  PathSample r = PathSample::Zero();
  PathSample first = PathSample::Zero();
  PathSample second = PathSample::Zero();
  PathSample third = PathSample::Zero();
  PathSample fourth = PathSample::Zero();
};

// The control points of the smoothed motion; same count as `samples`.
std::vector<PathSample> Smooth(const SmoothingFilter& filter, const std::vector<PathSample>& samples);

// The spline at control point `index`; needs two neighbours either side.
KnotState EvaluateKnot(const std::vector<PathSample>& control, std::size_t index, double knot_s);

}  // namespace lambdajet::trajectory
