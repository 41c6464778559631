// Quintics that segments are made of, and bounds of what they reach.
//
// Model: the one quintic with given value, first and second derivative at both ends. A bound is the largest of values a
// sixteenth apart plus what can rise between them, from the largest derivative two orders higher; the third derivative of a
// coordinate is exact. Units: of the coordinate, s. Threads: values. Cost: PeaksOf some 0.1 us.
#pragma once

#include <Eigen/Core>

#include "foundation/motion/plan.hpp"

namespace lambdajet::trajectory {

struct QuinticEnd {
  double value = 0.0;
  double first_per_s = 0.0;
  double second_per_s2 = 0.0;
};

Polynomial QuinticBetween(const QuinticEnd& from, const QuinticEnd& to, double duration_s);

// A point in the plane, both coordinates quintics.
struct PlanarQuintic {
  Polynomial x, y;

  Eigen::Vector2d value(double t) const { return {x.value(t), y.value(t)}; }
  Eigen::Vector2d first(double t) const { return {x.first(t), y.first(t)}; }
  Eigen::Vector2d second(double t) const { return {x.second(t), y.second(t)}; }
  Eigen::Vector2d third(double t) const { return {x.third(t), y.third(t)}; }
};

// Bounds of the derivatives' magnitudes from 0 to the duration.
struct DerivativePeaks {
  double first_per_s = 0.0;
  double second_per_s2 = 0.0;
  double third_per_s3 = 0.0;
};
DerivativePeaks PeaksOf(const Polynomial& coordinate, double duration_s);
// Of the vectors; `first_per_s` is left at 0.
DerivativePeaks PeaksOf(const PlanarQuintic& point, double duration_s);

}  // namespace lambdajet::trajectory
