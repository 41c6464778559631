// Integrates the sheet's elastic deflection along a moving effector exactly, from one slider reading to the next.
//
// Model: seed paper 000, elastic error; lumped mass on a spring at the tool, m u'' + c u' + k u = -m a(t), written with lag
// = m/k and damping = c/k as  lag u'' + damping u' + u = -lag a(t). Over one step a(t) is a cubic, so that
//     u(t) = u_p(t) + e^{-s t} [w0 C(t) + (w0' + s w0) S(t)],   s = damping / (2 lag),   x = 1/lag - s^2,
// with u_p the cubic particular solution, w = u - u_p, C = cos(sqrt(x) t), S = sin(sqrt(x) t)/sqrt(x), or cosh and sinh for
// x < 0: exact for any step, damping and stiffness; no time step to choose.
// Units: mm, s; lag s^2, damping s.
// Shapes: the scalar S is double or a Ceres Jet.
// Validity: lag at or below kLeastLagS2 is taken as that (a rigid machine).
// Threads: values.
// Cost: one exp, sin and cos a step.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "kinematics/core/lambda_kernel.hpp"

namespace lambdajet::calibration {

inline constexpr double kLeastLagS2 =
    1e-7;  // a natural frequency of 500 Hz: stiffer than any camera can tell

// Acceleration over one step, a(t) = c0 + c1 t + c2 t^2 + c3 t^3.
template <class S>
using AccelerationCubic = std::array<S, 4>;

template <class S>
struct Deflection {
  S u_mm;
  S velocity_mm_per_s;
};

// C and S of the header, times e^{-s t}; `squared` is x of either sign.
template <class S>
struct Swing {
  S cosine;
  S sine_s;
};

template <class S>
Swing<S> SwingOf(const S& decay_per_s, const S& squared_per_s2, double t_s) {
  using std::cos;
  using std::exp;
  using std::sin;
  using std::sqrt;
  const double x = kinematics::lambda::ValueOf(squared_per_s2) * t_s * t_s;
  if (std::abs(x) < 1e-8) {  // critical damping: the root's derivative does not exist, the series' does
    const S y = squared_per_s2 * (t_s * t_s);
    const S fade = exp(-decay_per_s * t_s);
    return {fade * (1.0 - y * 0.5), fade * t_s * (1.0 - y * (1.0 / 6.0))};
  }
  if (x > 0.0) {
    const S omega = sqrt(squared_per_s2);
    const S fade = exp(-decay_per_s * t_s);
    return {fade * cos(omega * t_s), fade * sin(omega * t_s) / omega};
  }
  const S rate = sqrt(-squared_per_s2);  // below decay_per_s, so neither exponential can overflow
  const S slow = exp((rate - decay_per_s) * t_s);
  const S fast = exp((-rate - decay_per_s) * t_s);
  return {0.5 * (slow + fast), 0.5 * (slow - fast) / rate};
}

template <class S>
Deflection<S> Advance(const Deflection<S>& start, const S& lag_s2, const S& damping_s,
                      const AccelerationCubic<S>& a, double t_s) {
  const S lag = kinematics::lambda::ValueOf(lag_s2) > kLeastLagS2 ? lag_s2 : S(kLeastLagS2);
  const S damping = kinematics::lambda::ValueOf(damping_s) > 0.0 ? damping_s : S(0.0);
  const S b3 = -lag * a[3];
  const S b2 = -lag * a[2] - 3.0 * damping * b3;
  const S b1 = -lag * a[1] - 2.0 * damping * b2 - 6.0 * lag * b3;
  const S b0 = -lag * a[0] - damping * b1 - 2.0 * lag * b2;
  const S decay = damping / (2.0 * lag);
  const S squared = 1.0 / lag - decay * decay;
  const Swing<S> swing = SwingOf(decay, squared, t_s);
  const S w0 = start.u_mm - b0;
  const S v0 = start.velocity_mm_per_s - b1;
  const S drive = v0 + decay * w0;
  const S w = w0 * swing.cosine + drive * swing.sine_s;
  const S w_rate = drive * swing.cosine - w0 * squared * swing.sine_s - decay * w;
  return {((b3 * t_s + b2) * t_s + b1) * t_s + b0 + w, (3.0 * b3 * t_s + 2.0 * b2) * t_s + b1 + w_rate};
}

}  // namespace lambdajet::calibration
