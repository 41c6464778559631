#include "main_motion/core/main_motion_core.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "foundation/motion/nanoseconds.hpp"

namespace lambdajet::main_motion {
namespace {

using enum ModuleMode;

constexpr std::size_t kPlanCapacity = 65536;  // gates, and events
constexpr std::size_t kHoleCapacity = 8192;
constexpr double kSame_mm = 1e-6;
constexpr std::int64_t kJetLead_ns = 2'000'000;
constexpr double kAbrasiveAfterWater_s = 0.005;
constexpr double kLongestPrediction_s = 0.3;
constexpr double kDwellGrace_s = 0.1;  // the drive opens a dwell by itself; this long after, main motion does
constexpr double kDelayClamp = 0.5;    // a learnt delay stays within this share of its nominal, plus:
constexpr double kDelaySlack_s = 0.01;
constexpr std::int32_t kFirstHole = 1000;
constexpr std::int64_t kSpread_ns =
    4'000'000;  // half width of the difference that gives slider accelerations

bool OnValve(ProcessAction action) {
  return action != ProcessAction::kCameraTrackOn && action != ProcessAction::kCameraTrackOff;
}
Valve ValveOf(ProcessAction action) {
  if (action == ProcessAction::kAbrasiveFlow) {
    return Valve::kAbrasiveFeeder;
  }
  return action == ProcessAction::kJetOn || action == ProcessAction::kJetOff ? Valve::kJet : Valve::kAbrasive;
}
bool TurnsOn(ProcessAction action) {
  return action == ProcessAction::kJetOn || action == ProcessAction::kAbrasiveOn ||
         action == ProcessAction::kAbrasiveFlow;
}

}  // namespace

MainMotionCore::MainMotionCore(const MainMotionConfig& config, MainMotionHardware& hardware)
    : config_(config),
      hardware_(hardware),
      period_ns_(ToNs(config.period_s)),
      peer_watch_(period_ns_),
      commands_(kTargetMainMotion, ToNs(config.command_age_limit_s)),
      loop_watch_(period_ns_, config.overrun_window, config.overruns_allowed) {
  gates_.reserve(kPlanCapacity);
  events_.reserve(kPlanCapacity);
  progress_.reserve(kPlanCapacity);
  holes_.reserve(kHoleCapacity);
  state_.header.session = config.session;
}

void MainMotionCore::AdoptMachine(const MachineDescription& machine) {
  if (Busy() || (machine_known_ && machine.version == machine_version_)) {
    return;
  }
  machine_known_ = true;
  machine_version_ = machine.version;
  process_ = machine.process;
  const decltype(nominal_s_) nominal_s = {{{process_.jet_off_delay_s, process_.jet_on_delay_s},
                                           {process_.abrasive_off_delay_s, process_.abrasive_on_delay_s},
                                           {process_.abrasive_on_delay_s, process_.abrasive_on_delay_s}}};
  if (nominal_s != nominal_s_) {  // a new identification does not make the valves forget
    nominal_s_ = delay_s_ = nominal_s;
    delays_seen_ = {};
  }
}

void MainMotionCore::Step(std::int64_t now_ns, const MainMotionInputs& inputs) {
  now_ns_ = now_ns;
  ++state_.header.sequence_number;
  state_.header.time_ns = now_ns;
  readings_ = hardware_.ReadState(now_ns);
  if (mode_ == kOff) {
    Apply(Event::kPowerUp, ModuleReason::kRestarted);
    Apply(Event::kInitialised, ModuleReason::kRestarted);
  }
  TakeInputs(inputs);
  WatchLoop();
  WatchHardware();
  WatchPressure();
  WatchPeer();
  TakeEffects();
  TakePictures();
  FollowDrive();
  WatchArming();
  RunGate();
  RunRestore();
  RunEvents();
  RunCamera();
  SettleRecords();
  SettlePictures();
  Report();
}

std::optional<ModeChange> MainMotionCore::TakeModeChange() { return changes_.Take(); }
std::optional<Measurement> MainMotionCore::TakeMeasurement() { return measurements_.Take(); }
std::optional<ProcessRecord> MainMotionCore::TakeProcessRecord() { return records_.Take(); }

// ---- inputs

void MainMotionCore::TakeInputs(const MainMotionInputs& inputs) {
  state_.link = inputs.link;
  for (const ModuleCommand& command : inputs.commands) {
    commands_.Take(command, now_ns_, state_.command, [this](const ModuleCommand& c) { return Obey(c); });
  }
  for (const ProcessBatch& batch : inputs.process) {
    TakeProcess(batch);
  }
  for (const SegmentBatch& batch : inputs.segments) {
    const SampleVerdict verdict = segment_guard_.Judge(batch.header);
    if (batch.plan == plan_ && (verdict == SampleVerdict::kFresh || verdict == SampleVerdict::kRestarted)) {
      track_.LearnSegments(batch);
    }
  }
  for (const DriveState& peer : inputs.peer) {
    TakePeer(peer);
  }
}

void MainMotionCore::TakePeer(const DriveState& peer) {
  switch (peer_guard_.Judge(peer.header)) {
    case SampleVerdict::kOld:
      return;
    case SampleVerdict::kTwoWriters:
      Apply(Event::kFault, ModuleReason::kTwoWriters);
      return;
    case SampleVerdict::kRestarted:
      if (Busy()) {
        Apply(Event::kStop, ModuleReason::kPeerStopped);
      }
      break;
    case SampleVerdict::kFresh:
      break;
  }
  track_.Heard(peer);
  peer_watch_.Heard(peer.header.time_ns);
}

ModuleReason MainMotionCore::Obey(const ModuleCommand& command) {
  const auto apply = [this](Event event) {
    return Apply(event, ModuleReason::kCommanded) ? ModuleReason::kNone : ModuleReason::kWrongMode;
  };
  switch (command.verb) {
    case Verb::kLoad:
      return ObeyLoad(command);
    case Verb::kArm:
      return ObeyArm(command);
    case Verb::kStart:
      return mode_ == kArmed ? ModuleReason::kNone : ModuleReason::kWrongMode;
    case Verb::kHold:
    case Verb::kResume:
    case Verb::kRetrace:
    case Verb::kOverride:
      // The path is the drive's; main motion follows it.
      return Busy() ? ModuleReason::kNone : ModuleReason::kWrongMode;
    case Verb::kStop:
      return apply(Event::kStop);
    case Verb::kReset:
      return apply(readings_.referenced ? Event::kReset : Event::kResetUnreferenced);
    case Verb::kHome:
      return apply(Event::kHome);
    case Verb::kUnload:
      return apply(Event::kUnload);
    case Verb::kNone:
    case Verb::kJog:
      break;
  }
  return ModuleReason::kWrongMode;
}

ModuleReason MainMotionCore::ObeyLoad(const ModuleCommand& command) {
  if (command.plan == 0 || command.gate_total > kPlanCapacity || command.event_total > kPlanCapacity) {
    return ModuleReason::kWrongPlan;
  }
  if (!Apply(Event::kLoad, ModuleReason::kCommanded)) {
    return ModuleReason::kWrongMode;
  }
  plan_ = command.plan;
  gate_total_ = command.gate_total;
  event_total_ = command.event_total;
  return ModuleReason::kNone;
}

ModuleReason MainMotionCore::ObeyArm(const ModuleCommand& command) {
  if (mode_ == kSafe || !readings_.referenced) {
    return ModuleReason::kNotReferenced;
  }
  if (plan_ == 0 || command.plan != plan_) {
    return ModuleReason::kWrongPlan;
  }
  if (!machine_known_) {
    return ModuleReason::kNoMachineDescription;
  }
  return Apply(Event::kArm, ModuleReason::kCommanded) ? ModuleReason::kNone : ModuleReason::kWrongMode;
}

void MainMotionCore::TakeProcess(const ProcessBatch& batch) {
  const SampleVerdict verdict = process_guard_.Judge(batch.header);
  if (verdict == SampleVerdict::kTwoWriters) {
    Apply(Event::kFault, ModuleReason::kTwoWriters);
    return;
  }
  if (verdict == SampleVerdict::kOld || batch.plan != plan_ || batch.gate_total != gate_total_ ||
      batch.event_total != event_total_) {
    return;
  }
  for (std::uint32_t i = 0; i < std::min(batch.gate_count, kEventsPerBatch); ++i) {
    const Gate& gate = batch.gates[i];
    if (gate.id == gates_.size() + 1 && gates_.size() < gate_total_ && std::isfinite(gate.s_mm)) {
      gates_.push_back(gate);
    }
  }
  for (std::uint32_t i = 0; i < std::min(batch.event_count, kEventsPerBatch); ++i) {
    const ProcessEvent& event = batch.events[i];
    if (event.index == events_.size() && events_.size() < event_total_ && std::isfinite(event.s_mm)) {
      events_.push_back(event);
      progress_.push_back(Progress::kWaiting);
    }
  }
}

// ---- watches

void MainMotionCore::WatchLoop() {
  if (loop_watch_.Turn(now_ns_) && (mode_ == kRunning || mode_ == kResuming)) {
    Apply(Event::kStop, ModuleReason::kOverruns);
  }
}

void MainMotionCore::WatchHardware() {
  if (readings_.sensor_fault && mode_ != kFault) {
    Apply(Event::kFault, ModuleReason::kSensorFault);
  }
  if (homing_ && readings_.referenced) {
    homing_ = false;
    Apply(Event::kHomed, ModuleReason::kNone);
  }
  if (closing_ && WaterGone()) {
    closing_ = false;
    Apply(Event::kOutputsOff, reason_);
  }
  if (!closing_) {
    closing_since_ns_ = now_ns_;
  } else if (now_ns_ - closing_since_ns_ > ToNs(config_.water_off_timeout_s)) {
    Apply(Event::kFault, ModuleReason::kJetNotClosed);  // the pump goes idle
  }
}

void MainMotionCore::WatchPressure() {
  const bool low = readings_.jet_on &&
                   readings_.pump_pressure_mpa < config_.pressure_lost_ratio * config_.pump_pressure_mpa;
  if (!low || closing_ || !(mode_ == kRunning || mode_ == kHolding || mode_ == kResuming)) {
    pressure_low_since_ns_ = 0;
  } else if (pressure_low_since_ns_ == 0) {
    pressure_low_since_ns_ = now_ns_;
  } else if (now_ns_ - pressure_low_since_ns_ >= ToNs(config_.pressure_patience_s)) {
    Apply(Event::kFault, ModuleReason::kPressureLost);
  }
}

void MainMotionCore::WatchPeer() {
  peer_lost_ = peer_watch_.Turn(now_ns_, ToNs(config_.drive_deadline_s));
  const bool already_off = (mode_ == kHeld || closing_) && reason_ == ModuleReason::kPeerLost;
  if (peer_lost_ && !already_off) {
    Apply(Event::kPeerLost, ModuleReason::kPeerLost);
  }
}

void MainMotionCore::FollowDrive() {
  if (peer_lost_ || track_.empty() || plan_ == 0) {
    return;
  }
  const DriveState& drive = track_.newest();
  if (IsDown(drive.mode) || (drive.plan != plan_ && Busy() && mode_ != kComplete)) {
    if (Busy() && mode_ != kComplete && mode_ != kArmed) {
      Apply(Event::kStop, ModuleReason::kPeerStopped);
    }
    return;
  }
  if (drive.plan != plan_) {
    return;
  }
  // After a restart of this module the drive knows better how far the plan has come.
  gate_passed_ = std::max(gate_passed_, drive.gate_passed);
  switch (drive.mode) {
    case kRunning:
      Apply(Event::kPeerRunning, ModuleReason::kNone);
      break;
    case kHolding:
      Apply(Event::kPeerHolding, drive.reason);
      break;
    case kHeld:
      if (!closing_) {
        Apply(Event::kPeerHeld, drive.reason);
      }
      break;
    case kResuming:
      if (mode_ == kHolding && !closing_) {  // the drive stood between two of the states heard
        Apply(Event::kPeerHeld, drive.reason);
      }
      Apply(Event::kPeerResuming, ModuleReason::kNone);
      break;
    case kComplete:
      Apply(Event::kPeerComplete, ModuleReason::kNone);
      break;
    default:
      break;
  }
}

void MainMotionCore::WatchArming() {
  if (!arming_ || mode_ != kReady || peer_lost_ || !PlanComplete() || track_.newest().plan != plan_) {
    return;
  }
  const bool needs_pressure = std::any_of(gates_.begin(), gates_.end(),
                                          [](const Gate& gate) { return gate.kind == GateKind::kPierce; });
  if (!needs_pressure ||
      readings_.pump_pressure_mpa >= config_.pressure_ready_ratio * config_.pump_pressure_mpa) {
    arming_ = false;
    Apply(Event::kArmed, ModuleReason::kNone);
  }
}

// ---- gates

void MainMotionCore::RunGate() {
  if (mode_ != kRunning || peer_lost_) {
    gate_running_ = 0;
    return;
  }
  const std::uint32_t waiting = track_.newest().gate_waiting;
  if (waiting == 0 || waiting <= gate_passed_ || waiting > gates_.size() || !DriveStandsAt(waiting)) {
    gate_running_ = 0;
    return;
  }
  const Gate& gate = gates_[waiting - 1];
  if (gate_running_ != waiting) {
    gate_running_ = waiting;
    gate_since_ns_ = now_ns_;
    picture_asked_ = picture_taken_ = false;
    input_before_ = Reads(gate.condition.input());
    if (gate.kind == GateKind::kPierce) {
      BeginPierce(gate.argument);
    }
  }
  switch (gate.kind) {
    case GateKind::kPierce:
      RunPierceGate(gate);
      break;
    case GateKind::kMeasure:
      RunMeasureGate(gate);
      break;
    case GateKind::kDwell:
      if (now_ns_ - gate_since_ns_ >= ToNs(gate.argument + kDwellGrace_s)) {
        PassGate(gate);
      }
      return;
    case GateKind::kInput:
      RunInputGate(gate);
      return;
    case GateKind::kStop:
    case GateKind::kNone:
      return;  // the operator's
  }
  if (gate_running_ != 0 &&
      now_ns_ - gate_since_ns_ > ToNs(config_.gate_timeout_s + std::abs(gate.argument))) {
    Apply(Event::kFault, ModuleReason::kGateTimeout);
  }
}

void MainMotionCore::RunPierceGate(const Gate& gate) {
  if (!AdvancePierce()) {
    return;
  }
  if (holes_.size() < kHoleCapacity) {
    holes_.push_back(track_.newest().actuator_position_mm);
  }
  PassGate(gate);
}

void MainMotionCore::RunMeasureGate(const Gate& gate) {
  if (picture_taken_) {
    PassGate(gate);
    return;
  }
  if (picture_asked_ || now_ns_ - gate_since_ns_ < ToNs(process_.measuring_settle_time_s)) {
    return;
  }
  picture_asked_ = true;
  const auto mark = static_cast<std::int32_t>(std::lround(gate.argument));
  const std::uint32_t request = ++picture_requests_;
  asked_[request % asked_.size()] = {request, gate.id, mark};
  hardware_.TakePicture(request, mark >= kFirstHole ? Feature::kHole : Feature::kMark,
                        now_ns_ + 2 * period_ns_);
}

void MainMotionCore::RunInputGate(const Gate& gate) {
  const bool before = std::exchange(input_before_, Reads(gate.condition.input()));
  const InputEvent event = gate.condition.event();
  const bool wanted = event == InputEvent::kRise || event == InputEvent::kHigh;
  const bool edge = event == InputEvent::kRise || event == InputEvent::kFall;
  if (input_before_ == wanted && (!edge || before != wanted)) {
    PassGate(gate);
  } else if (now_ns_ - gate_since_ns_ > ToNs(gate.argument)) {
    Apply(Event::kInputMissing, ModuleReason::kInputTimeout);
  }
}

bool MainMotionCore::Reads(ProcessInput input) const {
  return input == ProcessInput::kAbrasivePresent
             ? readings_.abrasive_present
             : readings_.pump_pressure_mpa >= config_.pressure_ready_ratio * config_.pump_pressure_mpa;
}

void MainMotionCore::PassGate(const Gate& gate) {
  gate_passed_ = gate.id;
  gate_running_ = 0;
  pierce_ = PiercePhase::kNone;
}

void MainMotionCore::RunRestore() {
  if (mode_ != kResuming || peer_lost_) {
    return;
  }
  if (restoring_ && pierce_ == PiercePhase::kNone) {
    if (readings_.jet_on || readings_.abrasive_on) {
      return;  // told to go off, and still flowing
    }
    BeginPierce(PierceTimeAt(track_.newest().s_mm));
  }
  if (!restoring_ || AdvancePierce()) {
    restoring_ = false;
    pierce_ = PiercePhase::kNone;
    Apply(Event::kRestored, ModuleReason::kNone);
  }
}

void MainMotionCore::BeginPierce(double pierce_time_s) {
  pierce_ = PiercePhase::kPressure;
  pierce_time_s_ = pierce_time_s;
  // What already flows will not come on a second time.
  water_since_ns_ = readings_.jet_on ? now_ns_ : 0;
  abrasive_there_ = readings_.abrasive_on;
  hardware_.SetPump(true);
  hardware_.SetStandOff(config_.stand_off_mm);
}

bool MainMotionCore::AdvancePierce() {
  if (pierce_ == PiercePhase::kPressure &&
      readings_.pump_pressure_mpa >= config_.pressure_ready_ratio * config_.pump_pressure_mpa &&
      std::abs(readings_.stand_off_mm - config_.stand_off_mm) <= config_.stand_off_tolerance_mm) {
    const std::int64_t jet_at_ns = now_ns_ + kJetLead_ns;
    const double behind_s =
        delay_s(Valve::kJet, true) - delay_s(Valve::kAbrasive, true) + kAbrasiveAfterWater_s;
    Command(Valve::kJet, true, jet_at_ns);
    Command(Valve::kAbrasive, true, jet_at_ns + ToNs(std::max(0.0, behind_s)));
    pierce_ = PiercePhase::kJet;
  }
  if (pierce_ == PiercePhase::kJet && water_since_ns_ != 0) {
    pierce_ = PiercePhase::kPiercing;
  }
  if (pierce_ == PiercePhase::kPiercing && abrasive_there_ &&
      now_ns_ >= water_since_ns_ + ToNs(pierce_time_s_)) {
    pierce_ = PiercePhase::kThrough;
  }
  return pierce_ == PiercePhase::kThrough;
}

// ---- process events

void MainMotionCore::RunEvents() {
  if ((mode_ != kRunning && mode_ != kHolding) || closing_ || peer_lost_) {
    return;
  }
  std::array<bool, kValveCount> valve_seen{};
  for (std::uint32_t i = first_unfired_; i < events_.size(); ++i) {
    if (progress_[i] == Progress::kFired) {
      first_unfired_ += i == first_unfired_ ? 1 : 0;
      continue;
    }
    const ProcessEvent& event = events_[i];
    const std::optional<std::int64_t> due_ns =
        BehindClosedGate(event) ? std::nullopt : track_.ArrivalTime(event.s_mm, kLongestPrediction_s);
    if (!due_ns) {
      for (std::size_t valve = 0; valve < kValveCount; ++valve) {
        if (scheduled_[valve] && !valve_seen[valve]) {
          hardware_.CancelOutput(static_cast<Valve>(valve));
          scheduled_[valve] = false;
          progress_[awaited_[valve].event] = Progress::kWaiting;
          awaited_[valve].pending = false;
        }
      }
      return;  // what comes later on the path is not due either
    }
    if (!OnValve(event.action)) {
      RunCameraEvent(event, *due_ns);
      continue;
    }
    bool& seen = valve_seen[static_cast<std::size_t>(ValveOf(event.action))];
    if (!seen) {
      RunValveEvent(event, *due_ns);
      seen = progress_[i] != Progress::kFired;
    }
  }
}

void MainMotionCore::RunValveEvent(const ProcessEvent& event, std::int64_t due_ns) {
  const Valve valve = ValveOf(event.action);
  const auto v = static_cast<std::size_t>(valve);
  const bool on = TurnsOn(event.action);
  const bool ours = scheduled_[v] && awaited_[v].event == event.index;
  if (ours && awaited_[v].command_ns <= now_ns_) {
    scheduled_[v] = false;  // the terminal has switched
    progress_[event.index] = Progress::kFired;
    ++events_executed_;
    return;
  }
  const std::int64_t at_ns = due_ns - ToNs(delay_s(valve, on));
  if (at_ns > now_ns_ + ToNs(config_.output_horizon_s)) {
    if (ours) {
      hardware_.CancelOutput(valve);
      scheduled_[v] = awaited_[v].pending = false;
      progress_[event.index] = Progress::kWaiting;
    }
    return;
  }
  Command(valve, on, at_ns, event.argument);
  awaited_[v].of_event = true;
  awaited_[v].event = event.index;
  scheduled_[v] = true;
  progress_[event.index] = Progress::kScheduled;
  if (at_ns <= now_ns_) {
    scheduled_[v] = false;
    progress_[event.index] = Progress::kFired;
    ++events_executed_;
  }
}

void MainMotionCore::RunCameraEvent(const ProcessEvent& event, std::int64_t due_ns) {
  if (due_ns > now_ns_ + period_ns_) {
    return;
  }
  tracking_ = event.action == ProcessAction::kCameraTrackOn;
  tracked_mark_ = static_cast<std::int32_t>(std::lround(event.argument));
  next_exposure_ns_ = due_ns;
  progress_[event.index] = Progress::kFired;
  ++events_executed_;
}

bool MainMotionCore::BehindClosedGate(const ProcessEvent& event) const {
  const std::uint32_t passed = track_.newest().gate_passed;
  return passed < gates_.size() && gates_[passed].s_mm < event.s_mm - kSame_mm;
}

void MainMotionCore::RunCamera() {
  if (!tracking_ || mode_ != kRunning || peer_lost_) {
    return;
  }
  const std::int64_t interval_ns = ToNs(config_.camera_interval_s);
  next_exposure_ns_ = std::max(next_exposure_ns_, now_ns_);
  while (next_exposure_ns_ <= now_ns_ + 2 * period_ns_) {
    const std::uint32_t request = ++picture_requests_;
    asked_[request % asked_.size()] = {request, 0, tracked_mark_};
    hardware_.TakePicture(request, tracked_mark_ >= kFirstHole ? Feature::kHole : Feature::kMark,
                          next_exposure_ns_);
    next_exposure_ns_ += interval_ns;
  }
}

// ---- what came of it

void MainMotionCore::TakeEffects() {
  for (std::size_t i = 0; i < readings_.effect_count; ++i) {
    const OutputEffect& effect = readings_.effects[i];
    if (effect.valve == Valve::kJet && effect.on) {
      water_since_ns_ = effect.effect_ns;
    }
    if (effect.valve == Valve::kAbrasive) {
      abrasive_there_ = effect.on;
    }
    const auto v = static_cast<std::size_t>(effect.valve);
    on_its_way_until_ns_[v] = effect.on ? 0 : on_its_way_until_ns_[v];
    Awaited& awaited = awaited_[v];
    if (!awaited.pending || awaited.on != effect.on) {
      continue;
    }
    awaited.pending = false;
    LearnDelay(effect, awaited.command_ns);
    if (awaited.of_event) {
      pending_records_.Put({awaited.event, effect.effect_ns, awaited.peer_age_s});
    }
  }
}

void MainMotionCore::LearnDelay(const OutputEffect& effect, std::int64_t command_ns) {
  const double seen_s = ToSeconds(effect.effect_ns - command_ns);
  const double nominal_s = nominal_s_[static_cast<std::size_t>(effect.valve)][effect.on ? 1 : 0];
  const double room_s = kDelayClamp * nominal_s + kDelaySlack_s;
  if (std::abs(seen_s - nominal_s) <= room_s) {
    int& seen = delays_seen_[static_cast<std::size_t>(effect.valve)][effect.on ? 1 : 0];
    ++seen;
    double& delay = delay_s(effect.valve, effect.on);
    // The mean of what was seen, then a slow following: the nominal delay is a data sheet's, the first look is the valve's.
    delay += std::max(config_.valve_learning, 1.0 / seen) * (seen_s - delay);
  }
}

void MainMotionCore::SettleRecords() {
  while (!pending_records_.empty()) {
    const PendingRecord& pending = pending_records_.oldest();
    if (!track_.Covers(pending.effect_ns) && !peer_lost_) {
      return;
    }
    const std::optional<double> s_mm = track_.PathLengthAt(pending.effect_ns);
    const std::optional<double> rate = track_.PathRateAt(pending.effect_ns);
    if (s_mm && rate && pending.event < events_.size()) {
      const ProcessEvent& event = events_[pending.event];
      ProcessRecord record;
      record.header = {config_.session, ++record_sequence_, now_ns_};
      record.plan = plan_;
      record.event = event.index;
      record.action = event.action;
      record.argument = event.argument;
      record.s_wanted_mm = event.s_mm;
      record.s_rate_mm_per_s = *rate;
      record.effect_ns = pending.effect_ns;
      record.deviation_mm = *s_mm - event.s_mm;
      record.due_ns = pending.effect_ns - (*rate > 1e-3 ? ToNs(record.deviation_mm / *rate) : 0);
      record.peer_age_s = pending.peer_age_s;
      records_.Put(record);
    }
    pending_records_.Take();
  }
}

void MainMotionCore::TakePictures() {
  for (std::size_t i = 0; i < readings_.picture_count; ++i) {
    const Picture& picture = readings_.pictures[i];
    const PendingPicture& asked = asked_[picture.request % asked_.size()];
    if (asked.request != picture.request) {
      continue;
    }
    Measurement measurement;
    measurement.plan = plan_;
    measurement.gate = asked.gate;
    measurement.mark = asked.mark;
    measurement.exposure_ns = picture.exposure_ns;
    measurement.seen = picture.seen;
    measurement.x_C_mm = picture.x_C_mm;
    measurement.y_C_mm = picture.y_C_mm;
    const auto hole = static_cast<std::size_t>(std::max(0, asked.mark - kFirstHole));
    if (hole >= 1 && hole <= holes_.size()) {
      measurement.jet_pierce_actuator_position_mm = holes_[hole - 1];
    }
    pending_pictures_.Put(measurement);
  }
}

// A picture waits until drive states on both sides of its exposure have come.
void MainMotionCore::SettlePictures() {
  while (!pending_pictures_.empty()) {
    Measurement& measurement = pending_pictures_.oldest();
    if (!track_.Covers(measurement.exposure_ns + kSpread_ns) && !peer_lost_) {
      return;
    }
    pending_pictures_.Take();
    const std::optional<ActuatorPoint> at = track_.ActuatorsAt(measurement.exposure_ns);
    const std::optional<ActuatorPoint> before = track_.ActuatorsAt(measurement.exposure_ns - kSpread_ns);
    const std::optional<ActuatorPoint> after = track_.ActuatorsAt(measurement.exposure_ns + kSpread_ns);
    if (!at || !before || !after) {
      continue;
    }
    measurement.header = {config_.session, ++measurement_sequence_, now_ns_};
    measurement.actuator_position_mm = at->position_mm;
    measurement.actuator_velocity_mm_per_s = at->velocity_mm_per_s;
    for (std::size_t i = 0; i < kActuatorCount; ++i) {
      measurement.actuator_acceleration_mm_per_s2[i] =
          (after->velocity_mm_per_s[i] - before->velocity_mm_per_s[i]) / ToSeconds(2 * kSpread_ns);
    }
    measurements_.Put(measurement);
    picture_taken_ = picture_taken_ || (gate_running_ != 0 && measurement.gate == gate_running_);
  }
}

// ---- state machine

bool MainMotionCore::Apply(Event event, ModuleReason reason) {
  const std::optional<Transition> transition = Next(mode_, event);
  if (!transition) {
    return false;
  }
  const ModuleMode from = mode_;
  mode_ = transition->mode;
  if (mode_ != from || event == Event::kPeerLost) {
    reason_ = reason;
  }
  if (mode_ != from) {
    changes_.Put({now_ns_, from, mode_, reason_, plan_, state_.s_extrapolated_mm});
  }
  Act(transition->action);
  return true;
}

void MainMotionCore::Act(Action action) {
  switch (action) {
    case Action::kNone:
      break;
    case Action::kBeginHoming:
      homing_ = true;
      arming_ = false;
      hardware_.BeginHoming();
      break;
    case Action::kAdoptPlan:
    case Action::kDropPlan:
      WaterOff();
      arming_ = false;
      plan_ = 0;
      gate_total_ = event_total_ = 0;
      gates_.clear();
      events_.clear();
      progress_.clear();
      holes_.clear();
      first_unfired_ = events_executed_ = gate_passed_ = 0;
      pending_records_.Clear();
      pending_pictures_.Clear();
      asked_ = {};
      tracking_ = false;
      track_.Clear();
      break;
    case Action::kPrepare:
      arming_ = true;
      hardware_.SetStandOff(config_.stand_off_mm);
      hardware_.SetPump(true);
      SetFlowAt(0.0);
      break;
    case Action::kSuspend:
      WaterOff();
      closing_ = true;
      break;
    case Action::kRestore: {
      const double s_mm = track_.newest().s_mm;
      RewindEvents(s_mm);
      restoring_ = WaterWantedAt(s_mm);
      SetFlowAt(s_mm);
      break;
    }
    case Action::kFinish:
      WaterOff();
      hardware_.SetPump(false);
      tracking_ = false;
      break;
    case Action::kShutDown:
      WaterOff();
      closing_ = true;
      hardware_.SetPump(false);
      arming_ = homing_ = false;
      break;
  }
}

void MainMotionCore::Command(Valve valve, bool on, std::int64_t at_ns, double flow_g_per_min) {
  const auto v = static_cast<std::size_t>(valve);
  const bool feeder = valve == Valve::kAbrasiveFeeder;
  if (feeder) {
    hardware_.ScheduleFlow(flow_g_per_min, at_ns);
  } else {
    hardware_.ScheduleOutput(valve, on, at_ns);
  }
  if (on && !feeder) {
    const double latest_s = delay_s(valve, true) + kDelayClamp * nominal_s_[v][1] + kDelaySlack_s;
    on_its_way_until_ns_[v] = std::max(at_ns, now_ns_) + ToNs(latest_s);
  }
  Awaited& awaited = awaited_[v];
  awaited = {};
  awaited.pending = true;
  awaited.on = on;
  awaited.command_ns = std::max(at_ns, now_ns_);
  awaited.peer_age_s = track_.empty() ? 0.0 : ToSeconds(now_ns_ - track_.newest().header.time_ns);
}

// The flow that the last setting on the way to s asked for, or the machine's own.
void MainMotionCore::SetFlowAt(double s_mm) {
  double flow_g_per_min = process_.abrasive_flow_g_per_min;
  bool known = flow_g_per_min > 0.0;
  for (const ProcessEvent& event : events_) {
    if (event.s_mm > s_mm + kSame_mm) {
      break;
    }
    if (event.action == ProcessAction::kAbrasiveFlow) {
      flow_g_per_min = event.argument;
      known = true;
    }
  }
  if (known) {
    Command(Valve::kAbrasiveFeeder, true, now_ns_, flow_g_per_min);
  }
}

void MainMotionCore::TakeBack(Valve valve) {
  const auto v = static_cast<std::size_t>(valve);
  if (scheduled_[v]) {
    scheduled_[v] = false;
    progress_[awaited_[v].event] = Progress::kWaiting;
  }
  hardware_.CancelOutput(valve);
  awaited_[v].pending = false;
}

// Abrasive first, so that the tube is rinsed; both at once, whatever was scheduled.
void MainMotionCore::WaterOff() {
  for (const Valve valve : {Valve::kAbrasive, Valve::kJet}) {
    TakeBack(valve);
    hardware_.ScheduleOutput(valve, false, now_ns_);
  }
  TakeBack(Valve::kAbrasiveFeeder);
  pierce_ = PiercePhase::kNone;
  gate_running_ = 0;
  restoring_ = false;
}

// The sensors see nothing, and nothing that was told to come on can still come.
bool MainMotionCore::WaterGone() const {
  return !readings_.jet_on && !readings_.abrasive_on &&
         std::ranges::all_of(on_its_way_until_ns_,
                             [this](std::int64_t until_ns) { return now_ns_ >= until_ns; });
}

// What lies ahead of s is done again, what lies behind is not.
void MainMotionCore::RewindEvents(double s_mm) {
  for (std::size_t i = 0; i < events_.size(); ++i) {
    progress_[i] = events_[i].s_mm > s_mm + kSame_mm ? Progress::kWaiting : Progress::kFired;
  }
  first_unfired_ = 0;
}

// Water is wanted at s if the last thing on the way that turned it on or off turned it on.
bool MainMotionCore::WaterWantedAt(double s_mm) const {
  double on_mm = -1.0;
  for (const Gate& gate : gates_) {
    if (gate.kind == GateKind::kPierce && gate.id <= gate_passed_ && gate.s_mm <= s_mm + kSame_mm) {
      on_mm = gate.s_mm;
    }
  }
  bool wanted = on_mm >= 0.0;
  for (const ProcessEvent& event : events_) {
    if (event.s_mm > s_mm + kSame_mm) {
      break;
    }
    if (event.s_mm > on_mm + kSame_mm && OnValve(event.action) && ValveOf(event.action) == Valve::kJet) {
      wanted = TurnsOn(event.action);
    }
  }
  return wanted;
}

double MainMotionCore::PierceTimeAt(double s_mm) const {
  double time_s = process_.pierce_time_s;
  for (const Gate& gate : gates_) {
    if (gate.kind == GateKind::kPierce && gate.s_mm <= s_mm + kSame_mm) {
      time_s = gate.argument;
    }
  }
  return time_s;
}

bool MainMotionCore::DriveStandsAt(std::uint32_t gate) const {
  const DriveState& drive = track_.newest();
  return drive.plan == plan_ && drive.mode == kRunning && drive.gate_waiting == gate && drive.tau_rate == 0.0;
}

bool MainMotionCore::PlanComplete() const {
  return gates_.size() == gate_total_ && events_.size() == event_total_;
}

bool MainMotionCore::Busy() const {
  return mode_ == kArmed || mode_ == kRunning || mode_ == kHolding || mode_ == kHeld || mode_ == kResuming ||
         mode_ == kComplete;
}

void MainMotionCore::Report() {
  state_.mode = mode_;
  state_.reason = reason_;
  state_.plan = plan_;
  state_.next_event = static_cast<std::uint32_t>(events_.size());
  state_.events_executed = events_executed_;
  state_.next_gate = static_cast<std::uint32_t>(gates_.size()) + 1;
  state_.gate_passed = gate_passed_;
  state_.jet_on = readings_.jet_on;
  state_.abrasive_on = readings_.abrasive_on;
  state_.pump_pressure_mpa = readings_.pump_pressure_mpa;
  state_.abrasive_g_per_min = readings_.abrasive_g_per_min;
  state_.abrasive_present = readings_.abrasive_present;
  state_.stand_off_mm = readings_.stand_off_mm;
  if (!peer_lost_ && !track_.empty()) {
    state_.s_extrapolated_mm = track_.PathLengthAt(now_ns_).value_or(track_.newest().s_mm);
  }
  state_.peer_session = peer_guard_.session();
  state_.peer_sequence_number = peer_guard_.sequence_number();
  state_.peer_age_s = track_.empty() ? 0.0 : ToSeconds(peer_watch_.age_ns(now_ns_));
  state_.loop_overruns = loop_watch_.overruns();
  state_.dropped_samples =
      peer_guard_.dropped() + commands_.dropped() + process_guard_.dropped() + segment_guard_.dropped();
}

}  // namespace lambdajet::main_motion
