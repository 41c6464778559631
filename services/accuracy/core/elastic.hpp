// Bends the levers: what acceleration does to a mass that hangs on a spring at the tool.
//
// Model: seed paper 000, elastic error delta = F/k; lumped, m u'' + c u' + k u = -m a(t), written with the
// elastic lag L = m/k and the damping time C = c/k as L u'' + C u' + u = -L a. Quasi-static |u| = m a/k; a
// step of a overshoots by exp(-pi z/sqrt(1 - z^2)). If a stiffness is given per drive, the compliance at the
// tool is inv(k J^T J). Units: mm, s, kg, N; 1 kg mm/s^2 = 1e-3 N. Threads: pure; a response is its owner's.
// Cost: a step some 10 ns, a change of step length one exponential more; no allocation.
#pragma once

#include <Eigen/Core>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace lambdajet::accuracy {

inline double InertiaForceN(double mass_kg, double acceleration_mm_per_s2) {
  return 1e-3 * mass_kg * acceleration_mm_per_s2;
}

inline double StaticDeflectionMm(double force_n, double stiffness_n_per_mm) {
  return force_n / stiffness_n_per_mm;
}

inline double NaturalFrequencyHz(double elastic_lag_s2) {
  return 1.0 / (2.0 * std::numbers::pi * std::sqrt(elastic_lag_s2));
}

// Damping ratio z of elastic lag L and damping time C.
inline double DampingRatio(double elastic_lag_s2, double damping_time_s) {
  return 0.5 * damping_time_s / std::sqrt(elastic_lag_s2);
}

// Peak over final value of the response to a step of acceleration: 2 without damping, 1 from critical damping
// on.
inline double StepPeakFactor(double damping_ratio) {
  if (damping_ratio >= 1.0) {
    return 1.0;
  }
  return 1.0 + std::exp(-std::numbers::pi * damping_ratio / std::sqrt(1.0 - damping_ratio * damping_ratio));
}

// Of the tool, mm/N, from one stiffness per drive and the Jacobian of actuators to tool coordinates.
inline Eigen::Matrix2d ToolCompliance(const Eigen::Matrix2d& J_q_x, double drive_stiffness_n_per_mm) {
  return (drive_stiffness_n_per_mm * J_q_x.transpose() * J_q_x).inverse();
}

// Plays L d'' + C d' + d = f(t) exactly for an f that is constant over each step.
class SpringResponse {
 public:
  SpringResponse(double elastic_lag_s2, double damping_time_s)
      : lag_(elastic_lag_s2), damping_(damping_time_s) {}

  const Eigen::Vector2d& deflection() const { return d_; }

  void Advance(double step_s, const Eigen::Vector2d& f) {
    if (lag_ < kRigidS2) {  // stiffer than anything a control cycle can excite
      d_ = f;
      rate_.setZero();
      return;
    }
    if (step_s != step_s_) {
      Prepare(step_s);
    }
    const Eigen::Vector2d x = d_ - f;
    const Eigen::Vector2d next_rate = m10_ * x + m11_ * rate_;
    d_ = f + m00_ * x + m01_ * rate_;
    rate_ = next_rate;
  }

 private:
  static constexpr double kRigidS2 = 1e-9;

  // Matrix exponential of [[0, 1], [-1/L, -C/L]] h by its two eigenvalues -g +- sqrt(g^2 - 1/L).
  void Prepare(double h) {
    step_s_ = h;
    const double g = 0.5 * damping_ / lag_;
    const double spread = g * g - 1.0 / lag_;
    const double root = std::sqrt(std::abs(spread));
    const double decay = std::exp(-g * h);
    double c = 1.0;
    double s = h;  // sin(w h)/w, and its overdamped twin
    if (spread < 0.0) {
      c = std::cos(root * h);
      s = root * h > 1e-8 ? std::sin(root * h) / root : h;
    } else if (root * h < 300.0) {
      c = std::cosh(root * h);
      s = root * h > 1e-8 ? std::sinh(root * h) / root : h;
    } else {  // the fast mode is gone; keep the slow one without overflow
      const double slow = std::exp((root - g) * h);
      Set(0.5 * slow, 0.5 * slow / root, g);
      return;
    }
    Set(decay * c, decay * s, g);
  }

  void Set(double c, double s, double g) {
    m00_ = c + g * s;
    m01_ = s;
    m10_ = -s / lag_;
    m11_ = c - g * s;
  }

  double lag_;
  double damping_;
  double step_s_ = -1.0;
  double m00_ = 1.0, m01_ = 0.0, m10_ = 0.0, m11_ = 1.0;
  Eigen::Vector2d d_ = Eigen::Vector2d::Zero();
  Eigen::Vector2d rate_ = Eigen::Vector2d::Zero();
};

}  // namespace lambdajet::accuracy
