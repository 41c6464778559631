#include "trajectory/core/feed/smoothing.hpp"

#include <algorithm>
#include <cmath>

namespace lambdajet::trajectory {
namespace {

// Of T1: wider, and the contour is left further where curvature jumps; narrower, and the jerk is higher there.
constexpr double kCorrectionShare = 0.5;
constexpr double kStanding2_mm2 = 1e-18;  // of way over two samples

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

// Outward correction by half the variance times the normal acceleration, averaged over `width` samples: where curvature
// jumps, the sharp correction's own jerk would be larger than that of the path.
void CorrectOutwards(const std::vector<PathSample>& in, double half_variance_samples, int width,
                     std::vector<PathSample>& out) {
  std::vector<PathSample>& outward = out;
  outward.assign(in.size(), PathSample::Zero());
  std::vector<PathSample> averaged;
  for (std::size_t i = 1; i + 1 < in.size(); ++i) {
    const Eigen::Vector2d along = (in[i + 1] - in[i - 1]).head<2>();
    const double along2 = along.squaredNorm();
    if (along2 >= kStanding2_mm2) {
      const Eigen::Vector2d bend = (in[i + 1] - 2.0 * in[i] + in[i - 1]).head<2>();
      outward[i].head<2>() = -half_variance_samples * (bend - along * (along.dot(bend) / along2));
    }
  }
  MovingAverage(outward, width, averaged);
  out = in;
  for (std::size_t i = 1; i + 1 < in.size(); ++i) {
    if ((in[i + 1] - in[i - 1]).head<2>().squaredNorm() >= kStanding2_mm2) {  // what stands stays where it is
      out[i] += averaged[i];
    }
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
  filter.correction_width = OddWidth(kCorrectionShare * t1, knot_s);
  filter.third_width = ramp_s2 > 0.0 ? std::max(1, OddWidth(ramp_s2 / t2, knot_s)) : 1;
  return filter;
}

double SmoothingFilter::variance_s2() const {
  const double n1 = first_width, n2 = second_width, n3 = third_width;
  return knot_s * knot_s * ((n1 * n1 - 1.0) / 12.0 + (n2 * n2 - 1.0) / 12.0 + (n3 * n3 - 1.0) / 12.0 + 0.5);
}

namespace {

// The filter's answer, in y, to a motion along x whose y is given: as the planner will make it.
template <class Shape, class Take>
void Answer(const SmoothingFilter& filter, Shape y, Take take) {
  const int reach = filter.reach() + filter.correction_width / 2 + 1;
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
  std::vector<PathSample> a, b;
  CorrectOutwards(samples, 0.5 * filter.variance_s2() / (filter.knot_s * filter.knot_s),
                  filter.correction_width, a);
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
