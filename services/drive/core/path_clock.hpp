// Keeps the program time tau of a plan and changes its rate d tau/dt by jerk-limited moves only.
//
// Model: feed hold, override, resume and retrace are one thing, a new rate wanted. From (w, w') the clock goes to the
// wanted rate with w'' = ±jerk or 0 in at most three phases, |w'| bounded, and without overshoot; tau is the exact
// integral, so tau does not depend on how often the clock is advanced.
// Units: s; the rate is a pure number, 1 at programmed feed. Threads: a value; copy it to go back in time.
// Cost: at most three short polynomials an advance; no allocation.
#pragma once

#include <array>
#include <cstddef>

namespace lambdajet::drive {

struct RateLimits {
  double acceleration_per_s = 4.0;  // largest |d rate/dt|
  double jerk_per_s2 = 40.0;        // |d2 rate/dt2|
};

class PathClock {
 public:
  // Stands at tau.
  void StandAt(double tau_s);
  // Runs at once at a rate: only where the path itself stands still (start of a plan, a gate).
  void RunAt(double rate);
  // Goes over to a rate from whatever the clock does now.
  void Retarget(double rate, const RateLimits& limits);
  void Advance(double dt_s);

  double tau_s() const { return tau_s_; }
  double rate() const { return rate_; }
  double rate_per_s() const { return rate_per_s_; }
  double rate_per_s2() const {
    return settled() ? 0.0 : phases_[static_cast<std::size_t>(phase_)].jerk_per_s2;
  }
  double target() const { return target_; }
  bool settled() const { return phase_ == kPhases; }

  // Program time that passes until a stop begun now is finished; signed as the rate.
  double StoppingTau(const RateLimits& limits) const;

 private:
  static constexpr int kPhases = 3;
  struct Phase {
    double left_s = 0.0;
    double jerk_per_s2 = 0.0;
  };
  void Integrate(double dt_s, double jerk_per_s2);

  double tau_s_ = 0.0;
  double rate_ = 0.0;
  double rate_per_s_ = 0.0;
  double target_ = 0.0;
  std::array<Phase, kPhases> phases_{};
  int phase_ = kPhases;
};

}  // namespace lambdajet::drive
