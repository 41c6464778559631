#include "drive/core/drive_core.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "foundation/motion/nanoseconds.hpp"

namespace lambdajet::drive {
namespace {

using enum ModuleMode;

constexpr std::size_t kGateCapacity = 65536;
constexpr double kLargestOverride = 1.2;
constexpr std::int64_t kStartSoonest_ns = 5'000'000;
constexpr std::int64_t kStartLatest_ns = 60'000'000'000;
constexpr double kPositionTolerance_mm = 0.01;
constexpr double kVelocityTolerance = 1.05;
constexpr int kCatchUpCycles = 512;
constexpr double kSmallestRateAcceleration =
    0.8;  // a hold must come to an end, whatever the path asks of the actuators

}  // namespace

DriveCore::DriveCore(const DriveConfig& config, DriveHardware& hardware)
    : config_(config),
      hardware_(hardware),
      period_ns_(ToNs(config.period_s)),
      buffer_(config.buffer),
      play_({.period_ns = period_ns_, .lead_ns = ToNs(config.setpoint_lead_s), .guard_ns = 2 * period_ns_},
            buffer_),
      peer_watch_(period_ns_),
      commands_(kTargetDrive, ToNs(config.command_age_limit_s)),
      loop_watch_(period_ns_, config.overrun_window, config.overruns_allowed) {
  gates_.reserve(kGateCapacity);
  state_.header.session = config.session;
}

void DriveCore::AdoptMachine(const MachineDescription& machine) {
  Limits limits;
  limits.version = machine.version;
  limits.known = true;
  limits.actuators = machine.actuators;
  const auto& [one, two] = machine.actuators;
  limits.velocity_mm_per_s = std::min(one.velocity_mm_per_s, two.velocity_mm_per_s);
  limits.acceleration_mm_per_s2 = std::min(one.acceleration_mm_per_s2, two.acceleration_mm_per_s2);
  limits.jerk_mm_per_s3 = std::min(one.jerk_mm_per_s3, two.jerk_mm_per_s3);
  offered_limits_ = limits;
}

void DriveCore::Step(std::int64_t now_ns, const DriveInputs& inputs) {
  now_ns_ = now_ns;
  ++state_.header.sequence_number;
  state_.header.time_ns = now_ns;
  readings_ = hardware_.ReadState(now_ns);
  if (mode_ == kOff) {
    Apply(Event::kPowerUp, ModuleReason::kRestarted);
    play_.Stand(now_ns_, readings_.position_mm);
    Apply(Event::kInitialised, ModuleReason::kRestarted);
  }
  TakeInputs(inputs);
  WatchLoop();
  WatchHardware();
  WatchPeer();
  WatchClock();
  WatchGates();
  WatchBuffer();
  WatchOverride();
  WatchRetrace();
  WatchMotion();
  WatchArming();
  PlayAhead();
  Report();
}

std::optional<ModeChange> DriveCore::TakeModeChange() { return changes_.Take(); }

// ---- inputs

void DriveCore::TakeInputs(const DriveInputs& inputs) {
  state_.link = inputs.link;
  if (offered_limits_ && !Moving()) {
    limits_ = *offered_limits_;
    offered_limits_.reset();
  }
  for (const MainMotionState& peer : inputs.peer) {
    TakePeer(peer);
  }
  for (const ModuleCommand& command : inputs.commands) {
    commands_.Take(command, now_ns_, state_.command, [this](const ModuleCommand& c) { return Obey(c); });
  }
  for (const ProcessBatch& batch : inputs.process) {
    TakeGates(batch);
  }
  for (const SegmentBatch& batch : inputs.segments) {
    TakeSegments(batch);
  }
}

void DriveCore::TakePeer(const MainMotionState& peer) {
  switch (peer_guard_.Judge(peer.header)) {
    case SampleVerdict::kOld:
      return;
    case SampleVerdict::kTwoWriters:
      Apply(Event::kFault, ModuleReason::kTwoWriters);
      return;
    case SampleVerdict::kRestarted:
      peer_restarted_ = Moving();
      break;
    case SampleVerdict::kFresh:
      break;
  }
  peer_ = peer;
  peer_watch_.Heard(peer.header.time_ns);
}

// kNone: done.
ModuleReason DriveCore::Obey(const ModuleCommand& command) {
  const auto apply = [this](Event event) {
    return Apply(event, ModuleReason::kCommanded) ? ModuleReason::kNone : ModuleReason::kWrongMode;
  };
  switch (command.verb) {
    case Verb::kLoad:
      return ObeyLoad(command);
    case Verb::kArm:
      return ObeyArm(command);
    case Verb::kStart:
      return ObeyStart(command);
    case Verb::kHold:
      return apply(Event::kHold);
    case Verb::kResume:
      return ObeyResume();
    case Verb::kRetrace:
      return ObeyRetrace(command.value);
    case Verb::kOverride:
      return ObeyOverride(command.value);
    case Verb::kStop:
      return apply(Event::kStop);
    case Verb::kReset:
      return apply(readings_.referenced ? Event::kReset : Event::kResetUnreferenced);
    case Verb::kHome:
      return positioning_ ? ModuleReason::kWrongMode : apply(Event::kHome);
    case Verb::kUnload:
      return apply(Event::kUnload);
    case Verb::kNone:
    case Verb::kJog:
      break;
  }
  return ModuleReason::kWrongMode;
}

ModuleReason DriveCore::ObeyLoad(const ModuleCommand& command) {
  if (command.plan == 0 || command.segment_count == 0 || !std::isfinite(command.elastic_lag_s2) ||
      !(command.duration_s > 0.0)) {
    return ModuleReason::kWrongPlan;
  }
  if (positioning_ || !Apply(Event::kLoad, ModuleReason::kCommanded)) {
    return ModuleReason::kWrongMode;
  }
  plan_ = {.id = command.plan, .segment_count = command.segment_count, .duration_s = command.duration_s};
  play_.SetPlan(command.segment_count, command.elastic_lag_s2);
  return ModuleReason::kNone;
}

ModuleReason DriveCore::ObeyArm(const ModuleCommand& command) {
  if (mode_ == kSafe || !readings_.referenced) {
    return ModuleReason::kNotReferenced;
  }
  if (mode_ != kReady) {
    return ModuleReason::kWrongMode;
  }
  if (plan_.id == 0 || command.plan != plan_.id) {
    return ModuleReason::kWrongPlan;
  }
  if (!limits_.known) {
    return ModuleReason::kNoMachineDescription;
  }
  if (!ClockFit()) {
    return ModuleReason::kClockOffset;
  }
  arming_ = true;
  return ModuleReason::kNone;
}

ModuleReason DriveCore::ObeyStart(const ModuleCommand& command) {
  if (command.plan != plan_.id) {
    return ModuleReason::kWrongPlan;
  }
  if (mode_ != kArmed || start_at_ns_ != 0) {
    return ModuleReason::kWrongMode;
  }
  if (!PeerFit() || peer_.mode != kArmed) {
    return peer_lost_ ? ModuleReason::kPeerLost : ModuleReason::kPeerStopped;
  }
  if (!ClockFit()) {
    return ModuleReason::kClockOffset;
  }
  const std::int64_t start_ns =
      command.start_at_ns == 0 ? now_ns_ + 2 * kStartSoonest_ns : command.start_at_ns;
  if (start_ns < now_ns_ + kStartSoonest_ns || start_ns > now_ns_ + kStartLatest_ns) {
    return ModuleReason::kStaleCommand;
  }
  start_at_ns_ = start_ns;
  return Apply(Event::kStart, ModuleReason::kCommanded) ? ModuleReason::kNone : ModuleReason::kWrongMode;
}

ModuleReason DriveCore::ObeyResume() {
  if (mode_ == kRunning && dwelling_gate_ != 0) {
    stop_gate_released_ = true;
    return ModuleReason::kNone;
  }
  if (mode_ != kHeld && mode_ != kHolding) {
    return ModuleReason::kWrongMode;
  }
  if (!PeerFit()) {
    return peer_lost_ ? ModuleReason::kPeerLost : ModuleReason::kPeerStopped;
  }
  GoOn(ModuleReason::kCommanded);
  return ModuleReason::kNone;
}

ModuleReason DriveCore::ObeyOverride(double value) {
  if (!(value >= 0.0 && value <= kLargestOverride)) {
    return ModuleReason::kActuatorLimit;
  }
  override_ = value;
  return ModuleReason::kNone;
}

ModuleReason DriveCore::ObeyRetrace(double distance_mm) {
  if (!(distance_mm > 0.0 && std::isfinite(distance_mm))) {
    return ModuleReason::kActuatorLimit;
  }
  if (mode_ != kHeld) {
    return ModuleReason::kWrongMode;
  }
  if (!PeerFit()) {
    return peer_lost_ ? ModuleReason::kPeerLost : ModuleReason::kPeerStopped;
  }
  resume_afterwards_ = false;
  backing_ = {Event::kRetrace, distance_mm, ModuleReason::kCommanded};
  return ModuleReason::kNone;
}

void DriveCore::TakeSegments(const SegmentBatch& batch) {
  const SampleVerdict verdict = segment_guard_.Judge(batch.header);
  if (verdict == SampleVerdict::kTwoWriters) {
    Apply(Event::kFault, ModuleReason::kTwoWriters);
    return;
  }
  if (verdict == SampleVerdict::kOld || batch.plan != plan_.id || batch.count > kSegmentsPerBatch ||
      batch.segment_count != plan_.segment_count) {
    return;
  }
  const double playing_tau_s = plan_.begun ? play_.PointAt(now_ns_).tau_s : plan_.tau_s;
  for (std::uint32_t i = 0; i < batch.count; ++i) {
    const SegmentAnswer answer = buffer_.Accept(batch.segments[i], playing_tau_s);
    if (answer == SegmentAnswer::kNotFinite || answer == SegmentAnswer::kNotJoined) {
      ++rejected_segments_;
    }
  }
}

void DriveCore::TakeGates(const ProcessBatch& batch) {
  const SampleVerdict verdict = process_guard_.Judge(batch.header);
  if (verdict == SampleVerdict::kOld || verdict == SampleVerdict::kTwoWriters || batch.plan != plan_.id) {
    return;
  }
  for (std::uint32_t i = 0; i < std::min(batch.gate_count, kEventsPerBatch); ++i) {
    if (batch.gates[i].id == gates_.size() + 1 && gates_.size() < kGateCapacity) {
      gates_.push_back(batch.gates[i]);
    }
  }
}

// ---- watches

void DriveCore::WatchLoop() {
  if (loop_watch_.Turn(now_ns_) && Moving()) {
    Apply(Event::kStop, ModuleReason::kOverruns);
  }
  if (play_.Behind(now_ns_) && Moving()) {  // the servo has run dry and braked by itself
    Apply(Event::kFault, ModuleReason::kOverruns);
  }
}

void DriveCore::WatchHardware() {
  if (readings_.sensor_fault) {
    if (mode_ != kFault) {
      Apply(Event::kFault, ModuleReason::kSensorFault);
    }
    return;
  }
  if (homing_ && readings_.referenced) {
    homing_ = false;
    Apply(Event::kHomed, ModuleReason::kNone);
  }
  const Setpoint wanted = play_.SetpointAt(now_ns_);
  bool far = false;
  for (std::size_t i = 0; i < kActuatorCount; ++i) {
    state_.actuator_setpoint_mm[i] = wanted.position_mm[i];
    state_.following_error_mm[i] = wanted.position_mm[i] - readings_.position_mm[i];
    far = far || !(std::abs(state_.following_error_mm[i]) <= config_.following_error_limit_mm);
  }
  const bool powered = Moving() || mode_ == kReady || mode_ == kComplete;
  following_cycles_ = far && powered ? following_cycles_ + 1 : 0;
  if (following_cycles_ >= config_.following_error_cycles) {
    following_cycles_ = 0;
    Apply(Event::kFault, ModuleReason::kFollowingError);
  }
}

void DriveCore::WatchPeer() {
  const bool was_lost = peer_lost_;
  peer_lost_ = peer_watch_.Turn(now_ns_, ToNs(config_.peer_deadline_s));
  if (PeerFit()) {
    peer_unfit_since_ns_ = 0;
    // Main motion missed the drive for a moment, or an input that the program waits for, and has taken the jet off; the
    // path must not go on without it.
    const bool jetless =
        (peer_.mode == kHolding || peer_.mode == kHeld) &&
        (peer_.reason == ModuleReason::kPeerLost || peer_.reason == ModuleReason::kInputTimeout);
    if (jetless && (mode_ == kRunning || (mode_ == kResuming && ramping_up_))) {
      Apply(Event::kHold, peer_.reason);
    }
    return;
  }
  if (peer_unfit_since_ns_ == 0 || (peer_lost_ && !was_lost)) {
    peer_unfit_since_ns_ = now_ns_;
  }
  // Water that still flows where it was told to cease is why nothing goes on, and what a person must see to.
  const bool flowing = !peer_lost_ && peer_.mode == kFault && peer_.reason == ModuleReason::kJetNotClosed;
  const ModuleReason reason = peer_lost_ ? ModuleReason::kPeerLost
                              : flowing  ? ModuleReason::kJetNotClosed
                                         : ModuleReason::kPeerStopped;
  reason_ = flowing && mode_ == kHeld ? reason : reason_;
  if (mode_ == kRunning || mode_ == kResuming) {
    Apply(Event::kHold, reason);
  } else if (mode_ == kHeld && now_ns_ - peer_unfit_since_ns_ > ToNs(config_.peer_patience_s)) {
    Apply(Event::kStop, reason);
  } else if (mode_ == kArmed && start_at_ns_ != 0) {
    start_at_ns_ = 0;
    play_.CancelStart(now_ns_);
    reason_ = reason;
  }
}

void DriveCore::WatchClock() {
  if (config_.hold_on_clock_offset && mode_ == kRunning && !ClockFit()) {
    Apply(Event::kHold, ModuleReason::kClockOffset);
  }
}

// Main motion opens gates; a dwell opens after its own time, a stop by RESUME.
void DriveCore::WatchGates() {
  if (plan_.id == 0) {
    return;
  }
  if (!peer_lost_ && peer_.plan == plan_.id && peer_.gate_passed > gate_passed_) {
    const std::uint32_t waiting = play_.At(now_ns_).gate_waiting;
    // Only the gate at which the drive stands can have been passed.
    gate_passed_ = waiting != 0 && peer_.gate_passed >= waiting ? waiting : gate_passed_;
  }
  const std::uint32_t waiting = play_.At(now_ns_).gate_waiting;
  const Gate* gate = waiting != 0 && waiting <= gates_.size() ? &gates_[waiting - 1] : nullptr;
  const bool own = gate != nullptr && (gate->kind == GateKind::kDwell || gate->kind == GateKind::kStop);
  if (!own || waiting <= gate_passed_) {
    dwelling_gate_ = 0;
    stop_gate_released_ = false;
  } else if (dwelling_gate_ != waiting) {
    dwelling_gate_ = waiting;
    dwell_since_ns_ = now_ns_;
    stop_gate_released_ = false;
  } else if (gate->kind == GateKind::kStop ? stop_gate_released_
                                           : now_ns_ - dwell_since_ns_ >= ToNs(gate->argument)) {
    gate_passed_ = waiting;
  }
}

void DriveCore::WatchBuffer() {
  if (plan_.id == 0 || !plan_.begun) {
    return;
  }
  const double reserve_s = config_.starvation_reserve_s;
  PathClock start = play_.head().clock;
  start.RunAt(rate_wanted_);
  const RateLimits limits = RateLimitsNow();
  const bool enough_ahead =
      WholePlanHeld() || buffer_.end_tau_s() - start.tau_s() > start.StoppingTau(limits) + reserve_s;
  play_.OpenGates(now_ns_, gate_passed_, enough_ahead);
  if (mode_ == kRunning || (mode_ == kResuming && ramping_up_)) {
    const PlayHead& head = play_.head();
    if (head.gate_waiting == 0 && AheadTau() < head.clock.StoppingTau(limits) + reserve_s) {
      Apply(Event::kHold, ModuleReason::kStarved);
    }
  } else if (mode_ == kHeld && reason_ == ModuleReason::kStarved && PeerFit() && !backing_ &&
             (WholePlanHeld() || AheadTau() >= config_.refill_s)) {
    GoOn(ModuleReason::kStarved);  // the cut is taken up as after any hold
  }
}

void DriveCore::WatchOverride() {
  const double allowed = AllowedRate();
  if (allowed == rate_wanted_) {
    return;
  }
  rate_wanted_ = allowed;
  if (mode_ == kRunning || (mode_ == kResuming && ramping_up_)) {
    play_.Retarget(now_ns_, allowed, RateLimitsNow());
  }
}

void DriveCore::WatchRetrace() {
  if (!retracing_) {
    return;
  }
  // Where a stop commanded now would begin: set-points up to there are left as they are.
  const PlayHead head = play_.At(now_ns_ + 2 * period_ns_);
  const RateLimits limits = RateLimitsNow();
  // Turns to a stop when the stopping distance reaches the mark; the head stands by itself at the oldest segment.
  PathClock stopping = head.clock;
  const double stop_tau_s = std::max(buffer_.first_tau_s(), stopping.tau_s() + stopping.StoppingTau(limits));
  const Segment& segment = buffer_.at(buffer_.Find(stop_tau_s, head.segment));
  const double s_mm = segment.s_mm.value(stop_tau_s - segment.start_s);
  const bool at_gate = head.segment > buffer_.first_index() && stop_tau_s <= segment.start_s &&
                       buffer_.at(head.segment - 1).gate_at_end != 0;
  if (s_mm <= retrace_to_s_mm_ || stop_tau_s <= buffer_.first_tau_s() || at_gate) {
    retracing_ = false;
    play_.Retarget(now_ns_, 0.0, limits);
  }
}

void DriveCore::WatchMotion() {
  const PlayHead now = play_.At(now_ns_);
  if ((mode_ == kHolding || mode_ == kStopping) && !retracing_ && Standing()) {
    Apply(Event::kStandstill, reason_);
  }
  if (mode_ == kHeld && backing_ && WaterIsOff()) {
    const Backing backing = *backing_;
    Apply(backing.event, backing.reason);
    BeginRetrace(backing.distance_mm);
  }
  if (mode_ == kHeld && resume_afterwards_ &&
      PeerFit()) {  // as soon as the peer is fit, if it is not just now
    Apply(Event::kResume, reason_);
  }
  if (mode_ == kArmed && start_at_ns_ != 0 && now_ns_ >= start_at_ns_) {
    start_at_ns_ = 0;
    Apply(plan_.begun ? Event::kContinueTime : Event::kStartTime, ModuleReason::kNone);
    plan_.begun = true;
  }
  if (mode_ == kResuming && !ramping_up_ && PeerReadyToResume()) {
    Apply(Event::kPeerReady, ModuleReason::kNone);
  } else if (mode_ == kResuming && ramping_up_) {
    const PlayHead& head = play_.head();
    if (now.finished) {
      Apply(Event::kPlanEnd, ModuleReason::kNone);
    } else if ((now.clock.settled() && now.clock.rate() == rate_wanted_) || now.gate_waiting != 0 ||
               (head.clock.settled() && rate_wanted_ == 0.0)) {
      Apply(Event::kAtRate, ModuleReason::kNone);
    }
  }
  if (mode_ == kRunning && now.source == PlaySource::kPlan && now.finished) {
    Apply(Event::kPlanEnd, ModuleReason::kNone);
  }
}

// ARM is a wish: it comes true when the peer is there, the buffer is filled and the sliders stand at the start.
void DriveCore::WatchArming() {
  if (!arming_ || mode_ != kReady) {
    return;
  }
  if (!positioning_ && !buffer_.empty() && plan_.tau_s >= buffer_.first_tau_s() &&
      plan_.tau_s <= buffer_.end_tau_s()) {
    Apply(Event::kArm, ModuleReason::kCommanded);
    return;
  }
  const bool filled = WholePlanHeld() || buffer_.end_tau_s() - plan_.tau_s >= config_.refill_s;
  if (positioning_ && play_.At(now_ns_).finished && filled && PeerFit()) {
    positioning_ = false;
    arming_ = false;
    play_.Stand(now_ns_, play_.SetpointAt(now_ns_).position_mm);
    Apply(Event::kPositioned, ModuleReason::kNone);
  }
}

// ---- motion

bool DriveCore::Apply(Event event, ModuleReason reason) {
  const std::optional<Transition> transition = Next(mode_, event);
  if (!transition) {
    return false;
  }
  const ModuleMode from = mode_;
  mode_ = transition->mode;
  if (event == Event::kStandstill || event == Event::kHold || mode_ != from) {
    reason_ = reason;
  }
  if (mode_ != from) {
    mode_since_ = state_.header.sequence_number;
    changes_.Put({now_ns_, from, mode_, reason_, plan_.id, play_.PointAt(now_ns_).s_mm});
  }
  if (from == kRunning || from == kResuming) {
    cutting_at_hold_ = (from == kResuming && cutting_at_hold_) || peer_.jet_on;
  }
  Act(transition->action);
  return true;
}

void DriveCore::Act(Action action) {
  switch (action) {
    case Action::kNone:
      break;
    case Action::kBeginHoming:
      homing_ = true;
      arming_ = false;
      hardware_.BeginHoming();
      break;
    case Action::kEnable:
      peer_restarted_ = false;
      play_.Stand(now_ns_, readings_.position_mm);
      hardware_.SetEnabled(true);
      break;
    case Action::kAdoptPlan:
    case Action::kDropPlan:
      play_.Stand(now_ns_, play_.SetpointAt(now_ns_).position_mm);
      play_.ForgetPlan();
      buffer_.Clear();
      gates_.clear();
      peer_restarted_ = false;
      plan_ = {};
      gate_passed_ = 0;
      start_at_ns_ = 0;
      arming_ = false;
      cutting_at_hold_ = false;
      break;
    case Action::kPosition: {
      const Segment& segment = buffer_.at(buffer_.Find(plan_.tau_s, 0));
      const double t = plan_.tau_s - segment.start_s;
      positioning_ = true;
      play_.Position(now_ns_, {segment.q_mm[0].value(t), segment.q_mm[1].value(t)},
                     config_.positioning_share * limits_.velocity_mm_per_s,
                     config_.positioning_acceleration_share * limits_.acceleration_mm_per_s2);
      break;
    }
    case Action::kScheduleStart:
      play_.Start(now_ns_, start_at_ns_, plan_.tau_s, plan_.begun ? 0.0 : rate_wanted_);
      break;
    case Action::kBeginPlay:
      break;
    case Action::kRampDown:
      retracing_ = false;
      backing_.reset();
      ramping_up_ = false;
      resume_afterwards_ = false;
      arming_ = false;
      start_at_ns_ = 0;
      play_.CancelStart(now_ns_);
      play_.Retarget(now_ns_, 0.0, RateLimitsNow());
      break;
    case Action::kBackUp:
      backing_.reset();
      resume_afterwards_ = true;
      break;
    case Action::kRetrace:
      backing_.reset();
      resume_afterwards_ = false;
      break;
    case Action::kResumeAfterwards:
      resume_afterwards_ = true;
      break;
    case Action::kAwaitPeer:
      backing_.reset();
      resume_afterwards_ = false;
      ramping_up_ = false;
      resuming_since_ = state_.header.sequence_number;
      break;
    case Action::kRampUp:
      ramping_up_ = true;
      cutting_at_hold_ = false;
      play_.Retarget(now_ns_, rate_wanted_, RateLimitsNow());
      break;
    case Action::kDisable:
      if (plan_.begun) {
        plan_.tau_s = play_.PointAt(now_ns_).tau_s;
      }
      positioning_ = arming_ = homing_ = retracing_ = ramping_up_ = false;
      backing_.reset();
      start_at_ns_ = 0;
      hardware_.SetEnabled(false);
      play_.Stand(now_ns_, readings_.position_mm);
      break;
  }
}

// Out of a hold. A cut is taken up from a little before, and that way back waits until no water flows.
void DriveCore::GoOn(ModuleReason reason) {
  const bool back_up = cutting_at_hold_ && config_.resume_overlap_mm > 0.0;
  if (back_up && mode_ == kHeld) {
    backing_ = {Event::kBackUp, config_.resume_overlap_mm, reason};
  } else {
    Apply(back_up ? Event::kBackUp : Event::kResume, reason);
  }
}

void DriveCore::BeginRetrace(double distance_mm) {
  retrace_to_s_mm_ = play_.PointAt(now_ns_).s_mm - distance_mm;
  retracing_ = true;
  play_.Retarget(now_ns_, -config_.retrace_rate, RateLimitsNow());
}

void DriveCore::PlayAhead() {
  const bool powered = mode_ != kSafe && mode_ != kStopped && mode_ != kFault && mode_ != kInitialising;
  if (play_.Behind(now_ns_)) {
    play_.Stand(now_ns_, powered ? play_.SetpointAt(now_ns_).position_mm : readings_.position_mm);
  }
  for (int i = 0; i < kCatchUpCycles && play_.Due(now_ns_); ++i) {
    const Setpoint setpoint = play_.Advance();
    if (!powered) {
      continue;
    }
    if (!WithinLimits(setpoint)) {
      Apply(Event::kFault, ModuleReason::kActuatorLimit);
      return;
    }
    hardware_.WriteSetpoint(setpoint);
  }
}

bool DriveCore::WithinLimits(const Setpoint& setpoint) const {
  if (!limits_.known || play_.head().source == PlaySource::kStand) {
    return true;
  }
  bool within = true;
  for (std::size_t i = 0; i < kActuatorCount; ++i) {
    const ActuatorLimits& limit = limits_.actuators[i];
    within = within && setpoint.position_mm[i] >= limit.position_min_mm - kPositionTolerance_mm &&
             setpoint.position_mm[i] <= limit.position_max_mm + kPositionTolerance_mm &&
             std::abs(setpoint.velocity_mm_per_s[i]) <= kVelocityTolerance * limit.velocity_mm_per_s;
  }
  return within;
}

// q'' w^2 + q' dw/dt stays within the actuators' acceleration: what the path leaves is the clock's.
RateLimits DriveCore::RateLimitsNow() const {
  RateLimits limits{config_.rate_acceleration_per_s, config_.rate_jerk_per_s2};
  if (!limits_.known || plan_.id == 0 || buffer_.empty()) {
    return limits;
  }
  const PlayHead& head = play_.head();
  const double horizon_s = head.clock.tau_s() + 1.0;
  double velocity = 0.0;
  double acceleration = 0.0;
  for (std::uint32_t i = buffer_.Find(head.clock.tau_s() - 1.0, head.segment);
       buffer_.Holds(i) && buffer_.at(i).start_s < horizon_s; ++i) {
    velocity = std::max(velocity, buffer_.bounds(i).velocity_mm_per_s);
    acceleration = std::max(acceleration, buffer_.bounds(i).acceleration_mm_per_s2);
  }
  const double rate = std::max(1.0, std::abs(head.clock.rate()));
  const double spare = limits_.acceleration_mm_per_s2 - acceleration * rate * rate;
  if (velocity > 1e-6) {
    limits.acceleration_per_s =
        std::clamp(spare / velocity, kSmallestRateAcceleration, config_.rate_acceleration_per_s);
    limits.jerk_per_s2 = std::clamp(0.5 * limits_.jerk_mm_per_s3 / velocity, 8.0 * kSmallestRateAcceleration,
                                    config_.rate_jerk_per_s2);
  }
  return limits;
}

// An override above 1 is granted as far as the segments in the buffer leave room under the actuators' limits.
double DriveCore::AllowedRate() const {
  if (override_ <= 1.0 || !limits_.known || plan_.id == 0) {
    return override_;
  }
  double rate = override_;
  for (std::uint32_t i = play_.head().segment; buffer_.Holds(i); ++i) {
    const SegmentBounds& bounds = buffer_.bounds(i);
    rate =
        std::min({rate, limits_.velocity_mm_per_s / std::max(1e-9, bounds.velocity_mm_per_s),
                  std::sqrt(limits_.acceleration_mm_per_s2 / std::max(1e-9, bounds.acceleration_mm_per_s2))});
  }
  return std::max(1.0, rate);
}

double DriveCore::AheadTau() const {
  const PlayHead& head = play_.head();
  if (WholePlanHeld()) {
    return 1e9;
  }
  for (std::uint32_t i = head.segment; buffer_.Holds(i); ++i) {
    if (buffer_.at(i).gate_at_end > gate_passed_) {
      return 1e9;  // the path itself stops before the buffer ends
    }
  }
  return buffer_.end_tau_s() - head.clock.tau_s();
}

bool DriveCore::WholePlanHeld() const { return buffer_.next_index() == plan_.segment_count; }

bool DriveCore::Moving() const {
  return mode_ == kArmed || mode_ == kRunning || mode_ == kHolding || mode_ == kHeld || mode_ == kResuming ||
         mode_ == kStopping || positioning_;
}

bool DriveCore::Standing() const { return play_.At(now_ns_).standing() && play_.head().standing(); }

bool DriveCore::PeerFit() const {
  return !peer_lost_ && !peer_restarted_ && !IsDown(peer_.mode) && peer_.plan == plan_.id && plan_.id != 0;
}

// Main motion says so, and says that it has heard of this standstill.
bool DriveCore::WaterIsOff() const {
  return PeerFit() && !peer_.jet_on && !peer_.abrasive_on && peer_.mode != kRunning &&
         peer_.mode != kHolding && peer_.mode != kResuming && peer_.peer_session == config_.session &&
         peer_.peer_sequence_number >= mode_since_;
}

bool DriveCore::PeerReadyToResume() const {
  return PeerFit() && peer_.mode == kRunning && peer_.peer_session == config_.session &&
         peer_.peer_sequence_number >= resuming_since_;
}

// What the measurement itself cannot tell from zero (half a round trip) is not held against the clock.
bool DriveCore::ClockFit() const {
  const LinkFigures& link = state_.link;
  return link.round_trip_s > 0.0 &&
         std::abs(link.clock_offset_s) - 0.5 * link.round_trip_s <= config_.clock_offset_limit_s;
}

void DriveCore::Report() {
  const PlayHead head = play_.At(now_ns_);
  const PathPoint point = play_.PointAt(now_ns_);
  const bool on_plan = head.source == PlaySource::kPlan;
  state_.mode = mode_;
  state_.reason = reason_;
  state_.referenced = readings_.referenced;
  state_.plan = plan_.id;
  state_.segment = on_plan ? head.segment : 0;
  state_.next_segment = buffer_.next_index();
  state_.tau_s = on_plan ? point.tau_s : plan_.tau_s;
  state_.buffered_s = buffer_.empty() ? 0.0 : std::max(0.0, buffer_.end_tau_s() - state_.tau_s);
  state_.tau_rate = on_plan ? head.clock.rate() : 0.0;
  state_.tau_rate_per_s = on_plan ? head.clock.rate_per_s() : 0.0;
  if (on_plan) {
    state_.s_mm = point.s_mm;
  } else if (plan_.id == 0 || !plan_.begun) {
    state_.s_mm = 0.0;
  }
  state_.s_rate_mm_per_s = on_plan ? point.s_rate_mm_per_s : 0.0;
  state_.s_acceleration_mm_per_s2 = on_plan ? point.s_acceleration_mm_per_s2 : 0.0;
  state_.gate_waiting = on_plan && head.gate_waiting > gate_passed_ ? head.gate_waiting : 0;
  state_.gate_passed = gate_passed_;
  state_.feed_override = override_;
  state_.actuator_position_mm = readings_.position_mm;
  state_.actuator_velocity_mm_per_s = readings_.velocity_mm_per_s;
  state_.peer_session = peer_guard_.session();
  state_.peer_sequence_number = peer_guard_.sequence_number();
  state_.loop_overruns = loop_watch_.overruns();
  state_.dropped_samples =
      peer_guard_.dropped() + commands_.dropped() + segment_guard_.dropped() + process_guard_.dropped();
}

}  // namespace lambdajet::drive
