// Makes the effector lead so that the sheet follows the path although the levers bend.
//
// Model: the sheet follows r if the effector is driven by r + y with T y' + y = (m/k) r'', T = c/k (seed paper 000, elastic
// error). Between knots r'' is a cubic, so y is a cubic plus a decaying exponential: exact, not integrated in steps. A damping
// time below 20 us counts as none. Frames: W. Units: mm, s. Threads: a value.
#pragma once

#include <Eigen/Core>
#include <cmath>

#include "kinematics/core/lambda_mechanism.hpp"
#include "trajectory/core/feed/smoothing.hpp"

namespace lambdajet::trajectory {

class ElasticLead {
 public:
  ElasticLead(double elastic_lag_s2, double damping_time_s, double knot_s)
      : lag_s2_(elastic_lag_s2),
        T_s_(damping_time_s),
        knot_s_(knot_s),
        decay_(damping_time_s > 0.0 ? std::exp(-knot_s / damping_time_s) : 0.0) {}

  // From one knot to the next.
  void Advance(const KnotState& from, const KnotState& to) {
    const Eigen::Vector2d fifth = (to.fourth - from.fourth).head<2>() / knot_s_;
    if (T_s_ > kSmallestDamping_s) {
      y_mm_ = Particular(to, fifth) + decay_ * (y_mm_ - Particular(from, fifth));
    } else {
      y_mm_ = lag_s2_ * to.second.head<2>();
    }
  }

  // Lead and its two derivatives at the knot last advanced to.
  kinematics::Motion At(const KnotState& k) const {
    if (T_s_ <= kSmallestDamping_s) {
      return {y_mm_, lag_s2_ * k.third.head<2>(), lag_s2_ * k.fourth.head<2>()};
    }
    const Eigen::Vector2d first = (lag_s2_ * k.second.head<2>() - y_mm_) / T_s_;
    return {y_mm_, first, (lag_s2_ * k.third.head<2>() - first) / T_s_};
  }

 private:
  static constexpr double kSmallestDamping_s = 2e-5;

  Eigen::Vector2d Particular(const KnotState& k, const Eigen::Vector2d& fifth) const {
    return lag_s2_ *
           (k.second.head<2>() - T_s_ * (k.third.head<2>() - T_s_ * (k.fourth.head<2>() - T_s_ * fifth)));
  }

  double lag_s2_, T_s_, knot_s_, decay_;
  Eigen::Vector2d y_mm_ = Eigen::Vector2d::Zero();
};

}  // namespace lambdajet::trajectory
