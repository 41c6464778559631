#include "drive/core/path_clock.hpp"

#include <algorithm>
#include <cmath>

namespace lambdajet::drive {

void PathClock::StandAt(double tau_s) {
  tau_s_ = tau_s;
  RunAt(0.0);
}

void PathClock::RunAt(double rate) {
  rate_ = rate;
  rate_per_s_ = 0.0;
  target_ = rate;
  phase_ = kPhases;
}

// In the direction of the change (sign d): w' rises to a peak P, stays, falls to 0. The change of rate is
// (P^2 - w0'^2)/(2J) + P T2 + P^2/(2J), hence P^2 = J d dw + w0'^2/2 for T2 = 0; where P would exceed the limit A,
// P = A and T2 makes up the rest.
void PathClock::Retarget(double rate, const RateLimits& limits) {
  const double jerk = limits.jerk_per_s2;
  // The limits may have become narrower since the running change began; what is there must be brought down first.
  const double largest = std::max(limits.acceleration_per_s, std::abs(rate_per_s_));
  const double coasting = rate_ + rate_per_s_ * std::abs(rate_per_s_) / (2.0 * jerk);
  const double d = rate >= coasting ? 1.0 : -1.0;
  const double change = d * (rate - rate_);
  const double first = d * rate_per_s_;
  double peak = std::sqrt(std::max(0.0, jerk * change + 0.5 * first * first));
  double steady_s = 0.0;
  if (peak > largest) {
    peak = largest;
    steady_s = std::max(0.0, (change - (2.0 * peak * peak - first * first) / (2.0 * jerk)) / peak);
  }
  phases_[0] = {std::max(0.0, (peak - first) / jerk), d * jerk};
  phases_[1] = {steady_s, 0.0};
  phases_[2] = {peak / jerk, -d * jerk};
  phase_ = 0;
  target_ = rate;
}

void PathClock::Advance(double dt_s) {
  while (phase_ < kPhases && dt_s >= phases_[static_cast<std::size_t>(phase_)].left_s) {
    const Phase& phase = phases_[static_cast<std::size_t>(phase_)];
    Integrate(phase.left_s, phase.jerk_per_s2);
    dt_s -= phase.left_s;
    ++phase_;
    if (phase_ == kPhases) {  // sheds the rounding of three phases
      rate_ = target_;
      rate_per_s_ = 0.0;
    }
  }
  if (phase_ < kPhases) {
    Phase& phase = phases_[static_cast<std::size_t>(phase_)];
    Integrate(dt_s, phase.jerk_per_s2);
    phase.left_s -= dt_s;
  } else {
    tau_s_ += rate_ * dt_s;
  }
}

double PathClock::StoppingTau(const RateLimits& limits) const {
  PathClock stopping = *this;
  stopping.Retarget(0.0, limits);
  double duration_s = 0.0;
  for (const Phase& phase : stopping.phases_) {
    duration_s += phase.left_s;
  }
  stopping.Advance(duration_s + 1e-9);
  return stopping.tau_s_ - tau_s_;
}

void PathClock::Integrate(double dt_s, double jerk_per_s2) {
  tau_s_ += ((jerk_per_s2 / 6.0 * dt_s + rate_per_s_ / 2.0) * dt_s + rate_) * dt_s;
  rate_ += (jerk_per_s2 / 2.0 * dt_s + rate_per_s_) * dt_s;
  rate_per_s_ += jerk_per_s2 * dt_s;
}

}  // namespace lambdajet::drive
