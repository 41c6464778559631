#include "foundation/machine/hexapod_motion.hpp"

#include <array>
#include <cmath>

namespace lambdajet {
std::string_view FaultOf(const HexapodMotion& m) {
  const std::array<double, 9> positive = {m.strut_velocity_mm_per_s, m.strut_acceleration_mm_per_s2,
                                          m.strut_jerk_mm_per_s3,    m.feed_mm_per_s,
                                          m.rapid_mm_per_s,          m.path_acceleration_mm_per_s2,
                                          m.path_jerk_mm_per_s3,     m.corner_tolerance_mm,
                                          m.corner_tolerance_rad};
  for (const double value : positive) {
    if (!(value > 0.0 && std::isfinite(value))) {
      return "limits of motion and corner tolerances must be finite and above 0";
    }
  }
  if (!m.X_MT_zero.p_mm.allFinite() || !m.X_MT_zero.R.allFinite()) {
    return "the program zero must be a pose of finite numbers";
  }
  const double least = m.spindle_least_per_min, most = m.spindle_most_per_min;
  if (!(least >= 0.0 && least <= most && most <= kFastestSpindle_per_min && m.spindle_run_up_s >= 0.0 &&
        m.spindle_run_up_s <= kLongestRunUp_s)) {
    return "a spindle's speeds must be 0 to 10^6 a minute, the least not above the most, its run-up 0 to 600 "
           "s";
  }
  return {};
}

}  // namespace lambdajet
