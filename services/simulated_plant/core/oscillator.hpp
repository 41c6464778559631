// Steps x'' + 2 z w x' + w^2 x = f exactly for a force that is constant over the step.
//
// Model: underdamped, critical and overdamped alike by the matrix exponential of the 2x2 system, computed once; the
// constant force shifts the rest position to f/w^2. Units: s, rad/s; x in any unit. Threads: a value. Cost: 4 products.
#pragma once

#include <cmath>

namespace lambdajet::simulated_plant {

class Oscillator {
 public:
  Oscillator() = default;
  Oscillator(double frequency_rad_per_s, double damping_ratio, double step_s)
      : square_(frequency_rad_per_s * frequency_rad_per_s) {
    const double decay = damping_ratio * frequency_rad_per_s;
    const double q = square_ - decay * decay;
    // cos and sin/omega, or their hyperbolic forms.
    const double omega = std::sqrt(std::abs(q));
    const double c = q >= 0.0 ? std::cos(omega * step_s) : std::cosh(omega * step_s);
    double s = step_s;
    if (omega * step_s > 1e-8) {
      s = (q >= 0.0 ? std::sin(omega * step_s) : std::sinh(omega * step_s)) / omega;
    }
    const double e = std::exp(-decay * step_s);
    xx_ = e * (c + decay * s);
    xv_ = e * s;
    vx_ = -e * square_ * s;
    vv_ = e * (c - decay * s);
  }

  void Step(double force, double& x, double& v) const {
    const double rest = force / square_;
    const double from_rest = x - rest;
    x = rest + xx_ * from_rest + xv_ * v;
    v = vx_ * from_rest + vv_ * v;
  }

 private:
  double square_ = 1.0;
  double xx_ = 1.0, xv_ = 0.0, vx_ = 0.0, vv_ = 1.0;
};

}  // namespace lambdajet::simulated_plant
