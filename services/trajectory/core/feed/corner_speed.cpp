#include "trajectory/core/feed/corner_speed.hpp"

#include <algorithm>
#include <cmath>

namespace lambdajet::trajectory {
namespace {

constexpr double kShareOfAcceleration = 0.97;  // at the corner
constexpr double kShareOfJerk = 0.98;
constexpr double kLeastSpeed_mm_per_s = 0.3;

// What the smoothing makes of a unit sample of path length: its kernel, one weight a knot.
std::vector<double> KernelOf(const SmoothingFilter& filter) {
  const int reach = filter.reach();
  const auto n = static_cast<std::size_t>(2 * reach + 9);
  std::vector<PathSample> in(n, PathSample::Zero());
  in[n / 2].z() = 1.0;
  const std::vector<PathSample> control = Smooth(filter, in);
  std::vector<double> kernel;
  for (int i = -reach; i <= reach; ++i) {
    kernel.push_back(
        EvaluateKnot(control, static_cast<std::size_t>(static_cast<int>(n / 2) + i), filter.knot_s).r.z());
  }
  return kernel;
}

}  // namespace

CornerRule::CornerRule(const SmoothingFilter& filter, double kink_deviation_s, double acceleration_mm_per_s2,
                       double jerk_mm_per_s3)
    : first_s_(filter.first_s),
      second_s_(filter.second_s),
      reach_s_(filter.half_support_s()),
      kink_deviation_s_(kink_deviation_s),
      acceleration_(acceleration_mm_per_s2),
      jerk_(jerk_mm_per_s3) {
  const std::vector<double> kernel = KernelOf(filter);
  const int reach = static_cast<int>(kernel.size()) / 2;
  for (std::size_t i = 1; i < kernel.size(); ++i) {
    kernel_slope_per_s2_ =
        std::max(kernel_slope_per_s2_, std::abs(kernel[i] - kernel[i - 1]) / (filter.knot_s * filter.knot_s));
  }
  for (std::size_t h = 0; h < kHolds; ++h) {
    hold_s_[h] = 2.0 * reach_s_ * static_cast<double>(h) / static_cast<double>(kHolds - 1);
    for (int i = -reach; i <= reach; ++i) {
      const double beyond = std::max(0.0, std::abs(i) * filter.knot_s - 0.5 * hold_s_[h]);
      spread_s2_[h] += kernel[static_cast<std::size_t>(i + reach)] * beyond * beyond;
    }
  }
}

CornerRule::Crossing CornerRule::Cross(double angle_rad, double deviation_mm, double feed_mm_per_s) const {
  const double change = 2.0 * std::sin(0.5 * angle_rad);
  if (feed_mm_per_s <= kLeastSpeed_mm_per_s) {
    return {feed_mm_per_s, 0.0, false};
  }
  Crossing best{kLeastSpeed_mm_per_s, reach_s_ * kLeastSpeed_mm_per_s, true};
  double least = 1e300;
  for (std::size_t h = 0; h < kHolds; ++h) {
    const double hold = hold_s_[h], together = std::max(0.0, 1.0 - hold / first_s_);
    const double by_tolerance =
        (deviation_mm / change - 0.25 * acceleration_ * spread_s2_[h]) / kink_deviation_s_;
    double by_limits = (kShareOfAcceleration / change - 0.5 * together) * acceleration_ * first_s_;
    if (together > 0.0) {
      const double turning = 2.0 * acceleration_ * std::cos(0.5 * angle_rad) / first_s_;
      const double room = kShareOfJerk * kShareOfJerk * jerk_ * jerk_ - turning * turning;
      by_limits = std::min(by_limits, std::sqrt(std::max(0.0, room)) * first_s_ * second_s_ / change);
    } else {
      by_limits = std::min(by_limits, kShareOfJerk * jerk_ / (kernel_slope_per_s2_ * change));
    }
    const double v = std::min({by_tolerance, by_limits, feed_mm_per_s});
    if (v < kLeastSpeed_mm_per_s) {
      continue;
    }
    const double apart = feed_mm_per_s - v;
    const double lost = apart / feed_mm_per_s * (hold + apart / acceleration_);
    if (lost < least) {
      least = lost;
      best = {v, 0.5 * hold * v, by_tolerance <= std::min(by_limits, feed_mm_per_s)};
    }
  }
  return best;
}

}  // namespace lambdajet::trajectory
