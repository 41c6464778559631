#include "trajectory/core/feed/smoothing.hpp"

#include <algorithm>
#include <cmath>

#include "trajectory/core/feed/sample_spline.hpp"

namespace lambdajet::trajectory {
namespace {

// Of T1: wider, and the contour is left further where curvature jumps; narrower, and the jerk is higher there.
constexpr double kCorrectionShare = 0.5;

// Samples either side that an average of this width takes from.
int ReachOf(double width) {
  const auto whole = static_cast<double>(WholeHalf(width));
  return static_cast<int>(whole) + (0.5 * (width - 1.0) > whole ? 1 : 0);
}

// Of one average, in squares of samples.
double VarianceOf(double width) {
  const auto half = static_cast<double>(WholeHalf(width));
  const double edge = 0.5 * (width - 1.0) - half;
  return (half * (half + 1.0) * (2.0 * half + 1.0) / 3.0 + 2.0 * edge * (half + 1.0) * (half + 1.0)) / width;
}

}  // namespace

SmoothingFilter SmoothingFilter::ForLimits(double knot_s, double acceleration_mm_per_s2,
                                           double jerk_mm_per_s3, double ramp_s2) {
  SmoothingFilter filter;
  filter.knot_s = knot_s;
  // From nothing to the limit within T1. Where it turns from one sign to the other, the planner finds the jerk too high
  // and slows there.
  const double t1 = acceleration_mm_per_s2 / jerk_mm_per_s3;
  filter.first_s = std::max(knot_s, t1);
  const double t2 = std::max(0.25 * t1, std::sqrt(ramp_s2));
  filter.second_s = std::max(knot_s, t2);
  filter.correction_s = std::max(knot_s, kCorrectionShare * t1);
  filter.third_s = ramp_s2 > 0.0 ? std::max(knot_s, ramp_s2 / t2) : knot_s;
  return filter;
}

int SmoothingFilter::reach() const {
  return ReachOf(first_s / knot_s) + ReachOf(second_s / knot_s) + ReachOf(third_s / knot_s) + 3;
}

double SmoothingFilter::variance_s2() const {
  return knot_s * knot_s *
         (VarianceOf(first_s / knot_s) + VarianceOf(second_s / knot_s) + VarianceOf(third_s / knot_s) + 0.5);
}

namespace {

// The filter's answer, in y, to a motion along x whose y is given: as the planner will make it.
template <class Shape, class Take>
void Answer(const SmoothingFilter& filter, Shape y, Take take) {
  const int reach = filter.reach() + ReachOf(filter.correction_s / filter.knot_s) + 1;
  const int n = 4 * reach + 8;
  std::vector<PathSample> in(static_cast<std::size_t>(n), PathSample::Zero());
  for (int i = 0; i < n; ++i) {
    // So fast along x that y is normal to the path.
    in[static_cast<std::size_t>(i)] = PathSample(1e6 * i, y((i - n / 2) * filter.knot_s), 0.0);
  }
  const std::vector<PathSample> control = Smooth(filter, in);
  for (int i = n / 2 - reach; i <= n / 2 + reach; ++i) {
    take(EvaluateKnot(control, static_cast<std::size_t>(i), filter.knot_s));
  }
}

}  // namespace

double SmoothingFilter::overshoot() const {
  double peak = 1.0;
  Answer(
      *this, [](double t) { return t > 0.0 ? 0.5 * t * t : 0.0; },
      [&peak](const KnotState& k) { peak = std::max(peak, k.second.y()); });
  return peak;
}

double SmoothingFilter::kink_deviation_s() const {
  double nearest = 1e300;  // the corner lies at y = 0
  Answer(
      *this, [](double t) { return 0.5 * std::abs(t); },
      [&nearest](const KnotState& k) { nearest = std::min(nearest, k.r.y()); });
  return nearest;
}

std::vector<PathSample> Smooth(const SmoothingFilter& filter, const std::vector<PathSample>& samples) {
  return SmoothSamples<2>(filter, samples);
}

KnotState EvaluateKnot(const std::vector<PathSample>& control, std::size_t index, double knot_s) {
  const SplinePoint<PathSample> k = SplineAt(control, index, knot_s);
  return {k.r, k.first, k.second, k.third, k.fourth};
}

}  // namespace lambdajet::trajectory
