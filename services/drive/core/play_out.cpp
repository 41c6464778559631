#include "drive/core/play_out.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "foundation/contract/expects.hpp"
#include "foundation/motion/nanoseconds.hpp"

namespace lambdajet::drive {
namespace {

constexpr double kTauTouch_s = 1e-9;        // a gate this near counts as reached
constexpr double kQuinticVelocity = 1.875;  // peak z' of the rest-to-rest quintic, per distance and time
constexpr double kQuinticAcceleration = 5.7735026918962577;  // 10/sqrt(3), peak z'' likewise

struct Law {
  double value, first;
};

Law Quintic(double p) {
  return {p * p * p * (10.0 + p * (-15.0 + 6.0 * p)), 30.0 * p * p * (1.0 - p) * (1.0 - p)};
}

}  // namespace

PlayOut::PlayOut(const Timing& timing, const SegmentBuffer& buffer) : timing_(timing), buffer_(buffer) {
  Expects(timing.lead_ns / timing.period_ns + 8 < static_cast<std::int64_t>(kHistory),
          "the lead is shorter than the history of play heads");
}

void PlayOut::Stand(std::int64_t now_ns, const std::array<double, kActuatorCount>& position_mm) {
  stand_mm_ = position_mm;
  start_at_ns_ = 0;
  Restart(now_ns);
}

void PlayOut::Position(std::int64_t now_ns, const std::array<double, kActuatorCount>& to_mm,
                       double velocity_mm_per_s, double acceleration_mm_per_s2) {
  Rewind(now_ns);
  from_mm_ = Evaluate(head_).position_mm;
  to_mm_ = to_mm;
  positioning_s_ = 0.1;
  for (std::size_t i = 0; i < kActuatorCount; ++i) {
    const double distance = std::abs(to_mm_[i] - from_mm_[i]);
    positioning_s_ = std::max({positioning_s_, kQuinticVelocity * distance / velocity_mm_per_s,
                               std::sqrt(kQuinticAcceleration * distance / acceleration_mm_per_s2)});
  }
  head_.source = PlaySource::kPositioning;
  head_.clock.StandAt(0.0);
  head_.clock.RunAt(1.0);
  head_.finished = false;
}

void PlayOut::Start(std::int64_t now_ns, std::int64_t start_at_ns, double tau_s, double rate) {
  Rewind(now_ns);
  start_at_ns_ = start_at_ns;
  start_tau_s_ = tau_s;
  start_rate_ = rate;
}

void PlayOut::CancelStart(std::int64_t now_ns) {
  if (start_at_ns_ != 0) {
    Rewind(now_ns);
    start_at_ns_ = 0;
  }
}

void PlayOut::Retarget(std::int64_t now_ns, double rate, const RateLimits& limits) {
  Rewind(now_ns);
  head_.wanted_rate = rate;
  if (rate < 0.0) {
    head_.gate_waiting = 0;
  }
  if (head_.gate_waiting == 0 && !(head_.finished && rate >= 0.0) && head_.source != PlaySource::kStand) {
    head_.finished = false;
    head_.clock.Retarget(rate, limits);
  }
}

void PlayOut::OpenGates(std::int64_t now_ns, std::uint32_t gate_passed, bool enough_ahead) {
  const bool opens = gate_passed > gate_passed_ || (enough_ahead && !enough_ahead_);
  gate_passed_ = gate_passed;
  enough_ahead_ = enough_ahead;
  if (opens && head_.gate_waiting != 0) {
    Rewind(now_ns);
  }
}

void PlayOut::SetPlan(std::uint32_t segment_count, double elastic_lag_s2) {
  segment_count_ = segment_count;
  elastic_lag_s2_ = elastic_lag_s2;
  gate_passed_ = 0;
}

void PlayOut::ForgetPlan() { SetPlan(0, 0.0); }

Setpoint PlayOut::Advance() {
  head_.time_ns += timing_.period_ns;
  const double dt_s = ToSeconds(timing_.period_ns);
  switch (head_.source) {
    case PlaySource::kStand:
      BeginIfDue(head_);
      break;
    case PlaySource::kPositioning:
      AdvancePositioning(head_, dt_s);
      break;
    case PlaySource::kPlan:
      AdvancePlan(head_, dt_s);
      break;
  }
  history_[advanced_++ % kHistory] = head_;
  return Evaluate(head_);
}

PlayHead PlayOut::At(std::int64_t time_ns) const {
  const std::uint64_t known = std::min<std::uint64_t>(advanced_, kHistory);
  for (std::uint64_t back = 1; back <= known; ++back) {
    const PlayHead& head = history_[(advanced_ - back) % kHistory];
    if (head.time_ns <= time_ns) {
      return head;
    }
  }
  PlayHead standing = head_;
  standing.clock.StandAt(head_.clock.tau_s());
  return standing;
}

PathPoint PlayOut::PointAt(std::int64_t time_ns) const {
  const PlayHead head = At(time_ns);
  PathPoint point;
  if (head.source != PlaySource::kPlan || !buffer_.Holds(head.segment)) {
    point.tau_s = start_tau_s_;
    return point;
  }
  const Segment& segment = buffer_.at(head.segment);
  const double t = head.clock.tau_s() - segment.start_s;
  const double w = head.clock.rate();
  const double first = segment.s_mm.first(t);
  const double dt_s = ToSeconds(time_ns - head.time_ns);
  point.s_rate_mm_per_s = first * w;
  point.s_acceleration_mm_per_s2 = segment.s_mm.second(t) * w * w + first * head.clock.rate_per_s();
  point.s_mm =
      segment.s_mm.value(t) + (point.s_rate_mm_per_s + 0.5 * point.s_acceleration_mm_per_s2 * dt_s) * dt_s;
  point.s_rate_mm_per_s += point.s_acceleration_mm_per_s2 * dt_s;
  point.tau_s = head.clock.tau_s() + (w + 0.5 * head.clock.rate_per_s() * dt_s) * dt_s;
  return point;
}

Setpoint PlayOut::SetpointAt(std::int64_t time_ns) const {
  const PlayHead head = At(time_ns);
  Setpoint setpoint = Evaluate(head);
  const double dt_s = ToSeconds(std::min(time_ns - head.time_ns, timing_.period_ns));
  for (std::size_t i = 0; i < kActuatorCount; ++i) {
    setpoint.position_mm[i] += setpoint.velocity_mm_per_s[i] * std::max(0.0, dt_s);
  }
  setpoint.execute_at_ns = time_ns;
  return setpoint;
}

// Goes back to the first head that the servo can still replace.
void PlayOut::Rewind(std::int64_t now_ns) {
  const std::int64_t earliest = now_ns + timing_.guard_ns;
  while (advanced_ > 1) {
    const PlayHead& previous = history_[(advanced_ - 2) % kHistory];
    if (head_.time_ns <= earliest || previous.time_ns < earliest || previous.time_ns >= head_.time_ns) {
      return;
    }
    --advanced_;
    head_ = previous;
  }
}

void PlayOut::Restart(std::int64_t now_ns) {
  const std::int64_t grid = (now_ns / timing_.period_ns + 1) * timing_.period_ns;
  head_ = PlayHead{};
  head_.time_ns = grid;
  advanced_ = 0;
  history_[advanced_++ % kHistory] = head_;
}

void PlayOut::BeginIfDue(PlayHead& head) const {
  if (start_at_ns_ == 0 || head.time_ns < start_at_ns_) {
    return;
  }
  head.source = PlaySource::kPlan;
  head.segment = buffer_.Find(start_tau_s_, head.segment);
  head.gate_waiting = 0;
  head.finished = false;
  head.clock.StandAt(start_tau_s_);
  head.clock.RunAt(start_rate_);
  head.wanted_rate = start_rate_;
  AdvancePlan(head, ToSeconds(head.time_ns - start_at_ns_));
}

void PlayOut::AdvancePositioning(PlayHead& head, double dt_s) const {
  head.clock.Advance(dt_s);
  if (head.clock.tau_s() >= positioning_s_) {
    head.clock.StandAt(positioning_s_);
    head.finished = true;
  }
}

void PlayOut::AdvancePlan(PlayHead& head, double dt_s) const {
  if (head.gate_waiting != 0) {
    if (head.gate_waiting > gate_passed_ || !enough_ahead_) {
      return;
    }
    head.gate_waiting = 0;
    head.clock.RunAt(head.wanted_rate);
  }
  PathClock clock = head.clock;
  clock.Advance(dt_s);
  if (!Forward(head, clock)) {
    Backward(head, clock);
  }
  head.clock = clock;
}

// Steps over segment ends up to the clock; true if the head was stopped at one.
bool PlayOut::Forward(PlayHead& head, PathClock& clock) const {
  for (std::uint32_t steps = 0; steps < segment_count_ + 1; ++steps) {
    const Segment& segment = buffer_.at(head.segment);
    const double end_s = segment.start_s + segment.duration_s;
    if (clock.tau_s() < end_s - kTauTouch_s) {
      return false;
    }
    const bool gate = segment.gate_at_end > gate_passed_;
    const bool last = head.segment + 1 == segment_count_;
    const bool dry = !buffer_.Holds(head.segment + 1);
    if (gate || last || dry) {
      clock.StandAt(end_s);
      head.gate_waiting = gate ? segment.gate_at_end : 0;
      head.finished = last && !gate;
      head.dry = dry && !gate && !last;
      return true;
    }
    if (clock.tau_s() < end_s) {
      return false;
    }
    ++head.segment;
  }
  return false;
}

void PlayOut::Backward(PlayHead& head, PathClock& clock) const {
  while (clock.tau_s() < buffer_.at(head.segment).start_s) {
    const bool oldest = !buffer_.Holds(head.segment - 1) || head.segment == 0;
    if (oldest) {
      clock.StandAt(buffer_.at(head.segment).start_s);
      return;
    }
    --head.segment;
  }
}

Setpoint PlayOut::Evaluate(const PlayHead& head) const {
  Setpoint setpoint;
  setpoint.execute_at_ns = head.time_ns;
  if (head.source == PlaySource::kStand) {
    setpoint.position_mm = stand_mm_;
    return setpoint;
  }
  const double w = head.clock.rate();
  const double dw = head.clock.rate_per_s();
  if (head.source == PlaySource::kPositioning) {
    const Law law = Quintic(std::clamp(head.clock.tau_s() / positioning_s_, 0.0, 1.0));
    for (std::size_t i = 0; i < kActuatorCount; ++i) {
      setpoint.position_mm[i] = from_mm_[i] + (to_mm_[i] - from_mm_[i]) * law.value;
      setpoint.velocity_mm_per_s[i] = (to_mm_[i] - from_mm_[i]) * law.first * w / positioning_s_;
    }
    return setpoint;
  }
  const Segment& segment = buffer_.at(head.segment);
  const double t = head.clock.tau_s() - segment.start_s;
  for (std::size_t i = 0; i < kActuatorCount; ++i) {
    const Polynomial& q = segment.q_mm[i];
    const Polynomial& e = segment.lead_mm[i];
    const double q1 = q.first(t);
    setpoint.position_mm[i] = q.value(t) + w * w * e.value(t) + elastic_lag_s2_ * q1 * dw;
    setpoint.velocity_mm_per_s[i] = w * (q1 + w * w * e.first(t)) + 2.0 * w * dw * e.value(t) +
                                    elastic_lag_s2_ * (q.second(t) * w * dw + q1 * head.clock.rate_per_s2());
  }
  return setpoint;
}

}  // namespace lambdajet::drive
