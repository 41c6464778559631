// Chooses at which speed a corner is crossed, and for how long that speed is kept about it.
//
// Model: the smoothing takes the mean of the motion over its kernel k, so about a corner it leaves the contour by what the
// jet has gone by within the kernel. At speed v for a time tau and with acceleration a before and after, that is
// change (v K + a M(tau) / 4), change the length by which the unit tangent changes, K the kink's deviation a mm/s and
// M(tau) = E_k[max(0, |t| - tau / 2)^2]. Braking later and holding a lower speed for longer costs way at low speed; braking
// earlier costs time before: of a few tau the one that loses least time against crossing at full speed is taken, among those
// that keep the tolerance, the acceleration at the corner, change (v / T1 + a max(0, 1 - tau / T1) / 2), and the jerk: where tau
// is below T1 that of a, which turns from one tangent to the other, else the kink's own, change v times the kernel's slope.
// Units: mm, s. Threads: pure. Cost: a few tens of ns a corner.
#pragma once

#include <array>

#include "trajectory/core/feed/smoothing.hpp"

namespace lambdajet::trajectory {

class CornerRule {
 public:
  CornerRule(const SmoothingFilter& filter, double kink_deviation_s, double acceleration_mm_per_s2,
             double jerk_mm_per_s3);

  struct Crossing {
    double speed_mm_per_s = 0.0;
    double hold_mm = 0.0;  // either side of the corner
    bool tolerance =
        false;  // what sets the speed is the contour's tolerance; else it is the feed or the acceleration
  };
  // `angle_rad` in (0, pi]; `deviation_mm` is what the corner may be left by.
  Crossing Cross(double angle_rad, double deviation_mm, double feed_mm_per_s) const;

 private:
  static constexpr std::size_t kHolds = 13;

  double first_s_;   // T1
  double second_s_;  // T2
  double reach_s_;   // of the kernel, either side
  double kink_deviation_s_;
  double acceleration_;
  double jerk_;
  double kernel_slope_per_s2_ = 0.0;  // its steepest
  std::array<double, kHolds> hold_s_{};
  std::array<double, kHolds> spread_s2_{};  // M
};

}  // namespace lambdajet::trajectory
