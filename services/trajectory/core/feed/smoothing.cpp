#include "trajectory/core/feed/smoothing.hpp"

#include <algorithm>
#include <cmath>

namespace lambdajet::trajectory {
namespace {

int OddWidth(double duration_s, double knot_s) {
  return 2 * static_cast<int>(std::ceil(0.5 * (duration_s / knot_s - 1.0) - 1e-9)) + 1;
}

// Running mean over an odd number of samples; ends are held. The sum is taken anew now and then, so that rounding does not
// add up over a long program.
void MovingAverage(const std::vector<PathSample>& in, int width, std::vector<PathSample>& out) {
  constexpr std::size_t kFresh = 256;
  const auto n = static_cast<std::ptrdiff_t>(in.size());
  const std::ptrdiff_t half = width / 2;
  const auto at = [&](std::ptrdiff_t i) -> const PathSample& {
    return in[static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(i, 0, n - 1))];
  };
  out.resize(in.size());
  PathSample sum = PathSample::Zero();
  for (std::ptrdiff_t i = 0; i < n; ++i) {
    if (static_cast<std::size_t>(i) % kFresh == 0) {
      sum.setZero();
      for (std::ptrdiff_t j = i - half; j <= i + half; ++j) {
        sum += at(j);
      }
    } else {
      sum += at(i + half) - at(i - half - 1);
    }
    out[static_cast<std::size_t>(i)] = sum / width;
  }
}

// Outward correction by half the variance times the normal acceleration.
void CorrectOutwards(const std::vector<PathSample>& in, double half_variance_samples,
                     std::vector<PathSample>& out) {
  out = in;
  for (std::size_t i = 1; i + 1 < in.size(); ++i) {
    const Eigen::Vector2d along = (in[i + 1] - in[i - 1]).head<2>();
    const double along2 = along.squaredNorm();
    if (along2 < 1e-18) {
      continue;
    }
    const Eigen::Vector2d bend = (in[i + 1] - 2.0 * in[i] + in[i - 1]).head<2>();
    out[i].head<2>() -= half_variance_samples * (bend - along * (along.dot(bend) / along2));
  }
}

}  // namespace

SmoothingFilter SmoothingFilter::ForLimits(double knot_s, double acceleration_mm_per_s2,
                                           double jerk_mm_per_s3, double ramp_s2) {
  SmoothingFilter filter;
  filter.knot_s = knot_s;
  // From nothing to the limit within T1. Where it turns from one sign to the other, the planner finds the jerk too high
  // and slows there.
  const double t1 = acceleration_mm_per_s2 / jerk_mm_per_s3;
  filter.first_width = std::max(1, OddWidth(t1, knot_s));
  const double t2 = std::max(0.25 * t1, std::sqrt(ramp_s2));
  filter.second_width = std::max(1, OddWidth(t2, knot_s));
  filter.third_width = ramp_s2 > 0.0 ? std::max(1, OddWidth(ramp_s2 / t2, knot_s)) : 1;
  return filter;
}

double SmoothingFilter::variance_s2() const {
  const double n1 = first_width, n2 = second_width, n3 = third_width;
  return knot_s * knot_s * ((n1 * n1 - 1.0) / 12.0 + (n2 * n2 - 1.0) / 12.0 + (n3 * n3 - 1.0) / 12.0 + 0.5);
}

double SmoothingFilter::overshoot() const {
  // Answer of the corrected kernel to a step, computed as the planner will: y'' of a parabola that begins in the middle.
  const int n = 4 * reach() + 8;
  std::vector<PathSample> in(static_cast<std::size_t>(n), PathSample::Zero());
  for (int i = n / 2; i < n; ++i) {
    const double t = (i - n / 2) * knot_s;
    in[static_cast<std::size_t>(i)].y() = 0.5 * t * t;
  }
  for (int i = 0; i < n; ++i) {
    in[static_cast<std::size_t>(i)].x() = 1e6 * i;  // so that y is normal to the path
  }
  const std::vector<PathSample> control = Smooth(*this, in);
  double peak = 1.0;
  for (int i = n / 2 - reach() - 2; i < n / 2 + reach() + 2; ++i) {
    peak = std::max(peak, EvaluateKnot(control, static_cast<std::size_t>(i), knot_s).second.y());
  }
  return peak;
}

double SmoothingFilter::kink_deviation_s() const {
  // Half of the mean absolute time of the kernel, less the outward correction; close to 0.2 sigma for smooth kernels.
  const double sigma = std::sqrt(variance_s2());
  return 0.25 * sigma;
}

std::vector<PathSample> Smooth(const SmoothingFilter& filter, const std::vector<PathSample>& samples) {
  std::vector<PathSample> a, b;
  CorrectOutwards(samples, 0.5 * filter.variance_s2() / (filter.knot_s * filter.knot_s), a);
  MovingAverage(a, filter.first_width, b);
  MovingAverage(b, filter.second_width, a);
  if (filter.third_width == 1) {
    return a;
  }
  MovingAverage(a, filter.third_width, b);
  return b;
}

KnotState EvaluateKnot(const std::vector<PathSample>& control, std::size_t index, double h) {
  const PathSample& a = control[index - 2];
  const PathSample& b = control[index - 1];
  const PathSample& c = control[index];
  const PathSample& d = control[index + 1];
  const PathSample& e = control[index + 2];
  // Differences about the middle keep what is at rest exactly at rest.
  const PathSample da = a - c, db = b - c, dd = d - c, de = e - c;
  KnotState k;
  k.r = c + (da + 26.0 * db + 26.0 * dd + de) / 120.0;
  k.first = (de - da + 10.0 * (dd - db)) / (24.0 * h);
  k.second = (da + 2.0 * db + 2.0 * dd + de) / (6.0 * h * h);
  k.third = (de - da - 2.0 * (dd - db)) / (2.0 * h * h * h);
  k.fourth = (da - 4.0 * db - 4.0 * dd + de) / (h * h * h * h);
  return k;
}

}  // namespace lambdajet::trajectory
