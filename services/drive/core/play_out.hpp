// Turns the buffered plan and the path clock into set-points a short lead ahead of time, and takes them back when the
// wish changes.
//
// Model: set-points lie on a grid of common time, one period apart, up to `lead` ahead, so that neither a late wake-up
// nor a missed cycle bends the path. Every grid point keeps its play head (a copy of the clock and where it stands). When
// the rate wanted changes, the head goes back to the first grid point that the servo can still replace and plays on from
// there: a deep queue and a quick reaction at once.
// Set-point at program time tau, rate w: q + w^2 e + lag q' w', with its exact derivative as velocity feed-forward.
// At a gate not yet passed, and at the plan's end, the path itself stands (the planner sees to it), so the head stops and
// starts there without a ramp. Units: mm, s; common time ns. Threads: one. Cost: bounded by lead/period, no allocation.
#pragma once

#include <array>
#include <cstdint>

#include "drive/core/drive_hardware.hpp"
#include "drive/core/path_clock.hpp"
#include "drive/core/segment_buffer.hpp"

namespace lambdajet::drive {

enum class PlaySource : std::uint8_t { kStand, kPositioning, kPlan };

struct PlayHead {
  std::int64_t time_ns = 0;
  PlaySource source = PlaySource::kStand;
  PathClock clock;
  double wanted_rate = 0.0;  // taken up when a gate opens
  std::uint32_t segment = 0;
  std::uint32_t gate_waiting = 0;
  bool finished = false;  // stands at the plan's end
  bool dry = false;       // ran to the end of the buffer: must not happen, see DriveCore's starvation watch

  bool standing() const { return clock.rate() == 0.0 && clock.settled(); }
};

// What the path does at a head.
struct PathPoint {
  double tau_s = 0.0;
  double s_mm = 0.0;
  double s_rate_mm_per_s = 0.0;
  double s_acceleration_mm_per_s2 = 0.0;
};

class PlayOut {
 public:
  struct Timing {
    std::int64_t period_ns = 1'000'000;
    std::int64_t lead_ns = 50'000'000;
    std::int64_t guard_ns = 2'000'000;  // what is due earlier than this is left as it is
  };
  PlayOut(const Timing& timing, const SegmentBuffer& buffer);

  // Stands at a position with no plan, from now on.
  void Stand(std::int64_t now_ns, const std::array<double, kActuatorCount>& position_mm);
  // Goes to a position by a rest-to-rest quintic within the limits.
  void Position(std::int64_t now_ns, const std::array<double, kActuatorCount>& to_mm,
                double velocity_mm_per_s, double acceleration_mm_per_s2);
  // Plays the plan from tau from a common time on: at `rate` at once, or standing there for a Retarget.
  void Start(std::int64_t now_ns, std::int64_t start_at_ns, double tau_s, double rate);
  void CancelStart(std::int64_t now_ns);
  void Retarget(std::int64_t now_ns, double rate, const RateLimits& limits);
  // Gates up to this one are open; `enough_ahead`: the buffer bears the start behind a gate.
  void OpenGates(std::int64_t now_ns, std::uint32_t gate_passed, bool enough_ahead);
  void SetPlan(std::uint32_t segment_count, double elastic_lag_s2);
  void ForgetPlan();

  // Next grid point if it lies within the lead.
  bool Due(std::int64_t now_ns) const {
    return head_.time_ns + timing_.period_ns <= now_ns + timing_.lead_ns;
  }
  bool Behind(std::int64_t now_ns) const { return head_.time_ns < now_ns; }
  Setpoint Advance();

  const PlayHead& head() const { return head_; }
  PlayHead At(std::int64_t time_ns) const;  // newest head not after the time
  PathPoint PointAt(std::int64_t time_ns) const;
  Setpoint SetpointAt(std::int64_t time_ns) const;
  bool start_pending() const { return start_at_ns_ != 0; }

 private:
  static constexpr std::size_t kHistory = 512;
  void Rewind(std::int64_t now_ns);
  void Restart(std::int64_t now_ns);
  void AdvancePlan(PlayHead& head, double dt_s) const;
  bool Forward(PlayHead& head, PathClock& clock) const;
  void Backward(PlayHead& head, PathClock& clock) const;
  void AdvancePositioning(PlayHead& head, double dt_s) const;
  void BeginIfDue(PlayHead& head) const;
  Setpoint Evaluate(const PlayHead& head) const;

  Timing timing_;
  const SegmentBuffer& buffer_;
  PlayHead head_;
  std::array<PlayHead, kHistory> history_{};
  std::uint64_t advanced_ = 0;

  std::array<double, kActuatorCount> stand_mm_{};
  std::array<double, kActuatorCount> from_mm_{};
  std::array<double, kActuatorCount> to_mm_{};
  double positioning_s_ = 0.0;
  std::int64_t start_at_ns_ = 0;
  double start_tau_s_ = 0.0;
  double start_rate_ = 0.0;
  std::uint32_t segment_count_ = 0;
  double elastic_lag_s2_ = 0.0;
  std::uint32_t gate_passed_ = 0;
  bool enough_ahead_ = true;
};

}  // namespace lambdajet::drive
