#include "trajectory/core/feed/planning_model.hpp"

#include <algorithm>

namespace lambdajet::trajectory {
namespace {

constexpr double kPathMargin = 0.995;  // planned against the limit, before smoothing
constexpr double kActuatorMargin = 0.99;

// The lead's third derivative is m/k times the path's fifth: this much of T2 T3 keeps it to a share of the actuators' jerk.
double LeadRamp(const MachineDescription& m) {
  constexpr double kShareOfJerk = 0.5;
  constexpr double kJumpAndLever = 3.0;  // jerk turning from one sign to the other, and the mechanism's lever
  const double jerk = std::min(m.actuators[0].jerk_mm_per_s3, m.actuators[1].jerk_mm_per_s3);
  return kJumpAndLever * m.value(Parameter::kElasticLagS2) * m.path.jerk_mm_per_s3 / (kShareOfJerk * jerk);
}

}  // namespace

PlanningModel::PlanningModel(const MachineDescription& m, const PlanOptions& o)
    : machine(m),
      options(o),
      sheet(m),
      filter(SmoothingFilter::ForLimits(o.knot_s, m.path.acceleration_mm_per_s2, m.path.jerk_mm_per_s3,
                                        o.compensate ? LeadRamp(m) : 0.0)),
      overshoot(filter.overshoot()),
      kink_deviation_s(filter.kink_deviation_s()),
      path_acceleration_mm_per_s2(kPathMargin * m.path.acceleration_mm_per_s2),
      corner(filter, kink_deviation_s, path_acceleration_mm_per_s2, m.path.jerk_mm_per_s3) {
  for (std::size_t j = 0; j < 2; ++j) {
    bounds.velocity_mm_per_s[j] = kActuatorMargin * m.actuators[j].velocity_mm_per_s;
    bounds.acceleration_mm_per_s2[j] = kActuatorMargin * m.actuators[j].acceleration_mm_per_s2;
  }
  if (o.compensate) {
    elastic_lag_s2 = m.value(Parameter::kElasticLagS2);
    damping_time_s = m.value(Parameter::kDampingTimeS);
  }
}

}  // namespace lambdajet::trajectory
