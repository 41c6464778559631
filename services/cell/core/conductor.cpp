#include "cell/core/conductor.hpp"

#include <algorithm>
#include <cstdio>
#include <utility>

namespace lambdajet::cell {
namespace {

constexpr double kCommandPatience_s = 0.4;
constexpr int kMostSendings = 3;
constexpr int kMostPreparingCommands = 16;
constexpr double kReconcile_s = 3.0;
constexpr double kPreparing_s = 90.0;
constexpr double kPlanning_s = 600.0;
constexpr double kAnswer_s = 3.0;
constexpr double kStreamingAnswer_s = 15.0;
constexpr double kFilling_s = 15.0;
constexpr double kPositioning_s = 120.0;
constexpr double kMotionAfterStart_s = 2.0;
constexpr double kStreamingCheck_s = 1.0;
constexpr double kMainMotionAfterDrive_s = 10.0;
constexpr std::uint32_t kEventsFilledEnough = 16;
constexpr double kLinkStands_s = 0.5;  // both heard for so long after a hold for a lost link: it is back
constexpr int kMostLinkResumes = 10;   // in one run; a link that is lost more often needs a person

std::string Text(double value, const char* unit) {
  char text[48];
  std::snprintf(text, sizeof text, "%.3f %s", value, unit);
  return text;
}

bool IsPlaying(ModuleMode mode) {
  return mode == ModuleMode::kRunning || mode == ModuleMode::kHolding || mode == ModuleMode::kHeld ||
         mode == ModuleMode::kResuming;
}

bool HasFallen(ModuleMode mode) {
  return mode == ModuleMode::kStopped || mode == ModuleMode::kFault || mode == ModuleMode::kSafe ||
         mode == ModuleMode::kOff || mode == ModuleMode::kInitialising || mode == ModuleMode::kReady;
}

std::string ReasonOf(const ModuleView& module) {
  return module.reason == ModuleReason::kNone ? std::string(Name(module.mode))
                                              : std::string(Name(module.reason));
}

// The first veto's reason with all of their words.
Refusal Together(const std::vector<Veto>& vetoes) {
  Refusal refusal{vetoes.front().reason, vetoes.front().message};
  for (std::size_t i = 1; i < vetoes.size(); ++i) {
    refusal.message += "; " + vetoes[i].reason + ": " + vetoes[i].message;
  }
  return refusal;
}

}  // namespace

// --- Words out
// ---------------------------------------------------------------------------------------------------------

void Conductor::Enter(Phase phase, std::int64_t now_ns, double deadline_s) {
  phase_ = phase;
  entered_ns_ = now_ns;
  deadline_ns_ = After(now_ns, deadline_s);
}

void Conductor::Tell(Happening happening, std::string reason, std::string message) {
  News news{job_id_, happening, std::move(reason), std::move(message), s_mm_};
  if (happening == Happening::kMoves || happening == Happening::kNoted) {
    news.plan = plan_;
  }
  if (const auto next = Next(job_state_, happening)) {
    job_state_ = *next;
  }
  actions_.emplace_back(std::move(news));
}

std::vector<Action> Conductor::TakeActions() { return std::exchange(actions_, {}); }

// --- Commands, acknowledged by state
// -----------------------------------------------------------------------------------

void Conductor::Send(std::uint32_t targets, Verb verb, std::int64_t now_ns, double value,
                     std::int64_t start_at_ns) {
  const CommandOut command{++sequence_number_, targets, verb, plan_, value, start_at_ns};
  for (std::uint32_t i = 0; i < pending_.size(); ++i) {
    if ((targets & (1U << i)) != 0) {
      pending_[i] = Pending{command, true, false, ModuleReason::kNone, now_ns, 1};
      pending_[i].command.targets = 1U << i;
    }
  }
  actions_.emplace_back(command);
}

void Conductor::Transmit(Pending& pending, std::int64_t now_ns) {
  pending.command.sequence_number = ++sequence_number_;
  pending.sent_ns = now_ns;
  ++pending.sent;
  actions_.emplace_back(pending.command);
}

void Conductor::HearEcho(Pending& pending, const ModuleView* module, std::int64_t now_ns) {
  if (!pending.waiting) {
    return;
  }
  if (module != nullptr && module->echo.session == session_ &&
      module->echo.sequence_number == pending.command.sequence_number && module->echo.answer != 0) {
    pending.waiting = false;
    pending.refused = module->echo.answer == 2;
    pending.reason = module->echo.reason;
    return;
  }
  const bool start_past = pending.command.verb == Verb::kStart && now_ns > pending.command.start_at_ns;
  if (SecondsBetween(pending.sent_ns, now_ns) < kCommandPatience_s) {
    return;
  }
  if (pending.sent < kMostSendings && !start_past) {
    Transmit(pending, now_ns);
  } else {
    pending.waiting = false;
    pending.refused = true;
    pending.reason = ModuleReason::kNone;
  }
}

bool Conductor::Waiting(std::uint32_t targets) const {
  return ((targets & kDriveTarget) != 0 && pending_[0].waiting) ||
         ((targets & kMainMotionTarget) != 0 && pending_[1].waiting);
}

std::optional<Refusal> Conductor::CommandTrouble(std::uint32_t targets) const {
  for (std::uint32_t i = 0; i < pending_.size(); ++i) {
    if ((targets & (1U << i)) == 0 || !pending_[i].refused) {
      continue;
    }
    const std::string who = i == 0 ? "drive" : "main_motion";
    const std::string verb(Name(pending_[i].command.verb));
    if (pending_[i].reason == ModuleReason::kNone) {
      return Refusal{"COMMAND_NOT_ANSWERED", who + " has not answered " + verb + "; look at the link"};
    }
    return Refusal{std::string(Name(pending_[i].reason)), who + " refuses " + verb};
  }
  return std::nullopt;
}

// --- Wishes
// ------------------------------------------------------------------------------------------------------------

std::optional<Refusal> Conductor::Start(const Job& job, double overlap_mm, const MachineView& machine,
                                        std::int64_t now_ns) {
  if (busy()) {
    return Refusal{"MACHINE_BUSY",
                   job_id_.empty() ? "the machine is being reset" : "job " + job_id_ + " holds it"};
  }
  const bool resumes = job.progress.state == JobState::kInterrupted;
  auto vetoes = StartVetoes(machine, now_ns);
  if (resumes) {  // a resume makes both modules ready itself; it only needs to hear them
    std::erase_if(vetoes, [](const Veto& veto) {
      return veto.reason != "DRIVE_LOST" && veto.reason != "MAIN_MOTION_LOST";
    });
  }
  if (!vetoes.empty()) {
    return Together(vetoes);
  }
  job_id_ = job.order.job_id;
  job_state_ = job.progress.state;
  s_mm_ = job.progress.s_mm;
  from_ = resumes && s_mm_ > 0.0 ? std::optional(ResumeFrom{s_mm_, overlap_mm}) : std::nullopt;
  plan_ = PlanFacts{};
  moved_ = resumes;
  resetting_ = false;
  Tell(Happening::kStartAsked);
  preparing_commands_ = 0;
  Enter(Phase::kPreparing, now_ns, kPreparing_s);
  return std::nullopt;
}

std::optional<Refusal> Conductor::Hold(const MachineView& machine, std::int64_t now_ns) {
  if (phase_ != Phase::kFollowing || !DriveHeard(machine, now_ns)) {
    return Refusal{"NOT_RUNNING", "nothing is being played that could be held"};
  }
  operator_command_ = true;
  operator_trouble_.reset();
  Send(kDriveTarget, Verb::kHold, now_ns);
  return std::nullopt;
}

std::optional<Refusal> Conductor::Resume(const MachineView& machine, std::int64_t now_ns) {
  if (phase_ != Phase::kFollowing || !DriveHeard(machine, now_ns)) {
    return Refusal{"NOT_HELD", "nothing is held that could go on"};
  }
  operator_command_ = true;
  operator_trouble_.reset();
  Send(kDriveTarget, Verb::kResume, now_ns);
  return std::nullopt;
}

std::optional<Refusal> Conductor::Override(double factor, const MachineView& machine, std::int64_t now_ns) {
  if (!DriveHeard(machine, now_ns)) {
    return Refusal{"DRIVE_LOST", "drive is not heard; an override needs it"};
  }
  if (Waiting(kDriveTarget)) {
    return Refusal{"MACHINE_BUSY", "another command is on its way to the drive; ask again"};
  }
  operator_command_ = true;
  operator_trouble_.reset();
  Send(kDriveTarget, Verb::kOverride, now_ns, factor);
  return std::nullopt;
}

void Conductor::Stop(std::int64_t now_ns) {
  Send(kBothTargets, Verb::kStop, now_ns);
  operator_command_ = false;
  if (phase_ == Phase::kFollowing || phase_ == Phase::kReconciling || phase_ == Phase::kUnloading) {
    return;  // followed until both stand still
  }
  const Refusal why{"STOPPED", "stopped by a client; reset the machine, then start or resume"};
  if (resetting_) {
    EndPreparing(why, now_ns);
  } else if (busy()) {
    GiveUpStart(why, now_ns);
  }
}

std::optional<Refusal> Conductor::Reset(const MachineView& machine, std::int64_t now_ns) {
  if (busy()) {
    return Refusal{"MACHINE_BUSY", job_id_.empty() ? "it is being reset already"
                                                   : "job " + job_id_ + " holds the machine; stop it first"};
  }
  if (!DriveHeard(machine, now_ns) || !MainMotionHeard(machine, now_ns)) {
    const bool drive = !DriveHeard(machine, now_ns);
    return Refusal{
        drive ? "DRIVE_LOST" : "MAIN_MOTION_LOST",
        std::string(drive ? "drive" : "main_motion") + " is not heard; start it, or look at the link"};
  }
  job_id_.clear();
  resetting_ = true;
  reset_trouble_.reset();
  preparing_commands_ = 0;
  Enter(Phase::kPreparing, now_ns, kPreparing_s);
  return std::nullopt;
}

void Conductor::Reconcile(const Job& job, std::int64_t now_ns) {
  job_id_ = job.order.job_id;
  job_state_ = job.progress.state;
  s_mm_ = job.progress.s_mm;
  plan_ = PlanFacts{};
  plan_.plan_id = job.progress.plan_id;
  plan_.length_mm = job.progress.length_mm;
  plan_.model_version = job.progress.model_version;
  plan_.predicted_95_mm = job.progress.predicted_95_mm;
  plan_.duration_s = job.progress.expected_duration_s;
  from_ =
      job.progress.plan_ids.size() > 1 ? std::optional(ResumeFrom{s_mm_, kDefaultOverlap_mm}) : std::nullopt;
  moved_ = from_.has_value() || s_mm_ > 0.0;
  resetting_ = false;
  Enter(Phase::kReconciling, now_ns, kReconcile_s);
}

void Conductor::Forget(const std::string& job_id) {
  if (!busy() && job_id_ == job_id) {
    job_id_.clear();
  }
}

// --- Every step
// --------------------------------------------------------------------------------------------------------

void Conductor::Step(const MachineView& machine, std::int64_t now_ns) {
  HearEcho(pending_[0], machine.drive ? &*machine.drive : nullptr, now_ns);
  HearEcho(pending_[1], machine.main_motion ? &*machine.main_motion : nullptr, now_ns);
  if (operator_command_ && !Waiting(kDriveTarget)) {
    operator_command_ = false;
    operator_trouble_ = CommandTrouble(kDriveTarget);
  }
  switch (phase_) {
    case Phase::kIdle:
      ListenAgain(machine, now_ns);
      break;
    case Phase::kReconciling:
      StepReconciling(machine, now_ns);
      break;
    case Phase::kPreparing:
      StepPreparing(machine, now_ns);
      break;
    case Phase::kFollowing:
      Follow(machine, now_ns);
      break;
    case Phase::kUnloading:
      if (!Waiting(kBothTargets) || Late(now_ns)) {
        phase_ = Phase::kIdle;
        job_id_.clear();
      }
      break;
    default:
      StepStart(machine, now_ns);
      break;
  }
}

// --- Making both modules ready
// -----------------------------------------------------------------------------------------

// One module's next step towards READY and referenced; true when it is there.
bool Conductor::Prepare(const ModuleView& module, bool referenced, std::uint32_t target,
                        std::int64_t now_ns) {
  if (Waiting(target)) {
    return false;
  }
  const auto tell = [&](Verb verb) {
    ++preparing_commands_;
    Send(target, verb, now_ns);
    return false;
  };
  switch (module.mode) {
    case ModuleMode::kSafe:
      return tell(Verb::kHome);
    case ModuleMode::kStopped:
    case ModuleMode::kFault:
      return tell(Verb::kReset);
    case ModuleMode::kReady:
      if (!referenced) {
        return tell(Verb::kHome);
      }
      return module.plan == 0 || tell(Verb::kUnload);
    case ModuleMode::kArmed:
    case ModuleMode::kComplete:
      return tell(Verb::kUnload);
    case ModuleMode::kRunning:
    case ModuleMode::kHolding:
    case ModuleMode::kHeld:
    case ModuleMode::kResuming:
      return tell(Verb::kStop);
    default:
      return false;  // OFF, INITIALISING, STOPPING pass by themselves
  }
}

void Conductor::StepPreparing(const MachineView& machine, std::int64_t now_ns) {
  if (const auto trouble = CommandTrouble(kBothTargets)) {
    return EndPreparing(trouble, now_ns);
  }
  if (!DriveHeard(machine, now_ns) || !MainMotionHeard(machine, now_ns)) {
    if (Late(now_ns) || SecondsBetween(entered_ns_, now_ns) > kReconcile_s) {
      EndPreparing(Refusal{DriveHeard(machine, now_ns) ? "MAIN_MOTION_LOST" : "DRIVE_LOST",
                           "a module went silent while it was made ready"},
                   now_ns);
    }
    return;
  }
  const bool drive_ready = Prepare(*machine.drive, machine.drive->referenced, kDriveTarget, now_ns);
  const bool main_motion_ready = Prepare(*machine.main_motion, true, kMainMotionTarget, now_ns);
  if (drive_ready && main_motion_ready) {
    EndPreparing(std::nullopt, now_ns);
  } else if (Late(now_ns) || preparing_commands_ > kMostPreparingCommands) {
    const ModuleView& module =
        drive_ready ? static_cast<const ModuleView&>(*machine.main_motion) : *machine.drive;
    EndPreparing(
        Refusal{ReasonOf(module), std::string(drive_ready ? "main_motion" : "drive") +
                                      " does not become READY, it is " + std::string(Name(module.mode))},
        now_ns);
  }
}

void Conductor::EndPreparing(std::optional<Refusal> trouble, std::int64_t now_ns) {
  pending_ = {};
  if (resetting_) {
    resetting_ = false;
    reset_trouble_ = std::move(trouble);
    phase_ = Phase::kIdle;
    return;
  }
  if (trouble) {
    return GiveUpStart(*trouble, now_ns);
  }
  actions_.emplace_back(PlanWanted{job_id_, from_});
  Enter(Phase::kPlanning, now_ns, kPlanning_s);
}

// --- Start
// -------------------------------------------------------------------------------------------------------------

void Conductor::Take(const PlanOutcome& outcome, std::int64_t now_ns) {
  if (phase_ != Phase::kPlanning || outcome.job_id != job_id_) {
    return;
  }
  if (!outcome.faults.empty()) {
    const bool fresh = !moved_;
    if (fresh) {
      actions_.emplace_back(News{job_id_, Happening::kRefused, "PROGRAM_REFUSED",
                                 "the active machine version cannot cut this program", s_mm_,
                                 outcome.faults});
      job_id_.clear();
      phase_ = Phase::kIdle;
      return;
    }
    return GiveUpStart(Refusal{outcome.faults.front().reason, outcome.faults.front().message}, now_ns);
  }
  if (!outcome.plan) {
    return GiveUpStart(Refusal{outcome.reason, outcome.message}, now_ns);
  }
  plan_ = *outcome.plan;
  Tell(Happening::kNoted);
  Send(kBothTargets, Verb::kLoad, now_ns);
  Enter(Phase::kLoading, now_ns, kAnswer_s);
}

void Conductor::Take(const StreamingOutcome& outcome, std::int64_t now_ns) {
  if (outcome.job_id != job_id_ || outcome.plan_id != plan_.plan_id) {
    return;
  }
  streaming_asked_ = false;
  if (outcome.plan) {
    plan_ = *outcome.plan;
  }
  if (phase_ == Phase::kStreaming) {
    if (!outcome.reason.empty()) {
      return GiveUpStart(Refusal{outcome.reason, outcome.message}, now_ns);
    }
    return Enter(Phase::kFilling, now_ns, kFilling_s);
  }
  if (phase_ == Phase::kFollowing && outcome.reason != streaming_reason_) {
    streaming_reason_ = outcome.reason;
    Tell(Happening::kNoted, outcome.reason, outcome.message);
  }
}

void Conductor::StepStart(const MachineView& machine, std::int64_t now_ns) {
  if (const auto trouble = CommandTrouble(kBothTargets)) {
    return GiveUpStart(*trouble, now_ns);
  }
  if (!DriveHeard(machine, now_ns) || !MainMotionHeard(machine, now_ns)) {
    return GiveUpStart(Refusal{DriveHeard(machine, now_ns) ? "MAIN_MOTION_LOST" : "DRIVE_LOST",
                               "a module went silent during the start"},
                       now_ns);
  }
  if (Late(now_ns) && phase_ != Phase::kFilling && phase_ != Phase::kPositioning &&
      phase_ != Phase::kAwaitingMotion) {
    return GiveUpStart(
        Refusal{phase_ == Phase::kPlanning || phase_ == Phase::kStreaming ? "TRAJECTORY_TIMEOUT"
                                                                          : "COMMAND_NOT_ANSWERED",
                "no answer in time during the start"},
        now_ns);
  }
  switch (phase_) {
    case Phase::kLoading:
      if (!Waiting(kBothTargets)) {
        actions_.emplace_back(StreamingWanted{job_id_, plan_.plan_id, from_});
        Enter(Phase::kStreaming, now_ns, kStreamingAnswer_s);
      }
      break;
    case Phase::kFilling:
      StepFilling(machine, now_ns);
      break;
    case Phase::kArming:
      if (!Waiting(kBothTargets)) {
        Enter(Phase::kPositioning, now_ns, kPositioning_s);
      }
      break;
    case Phase::kPositioning:
      StepPositioning(machine, now_ns);
      break;
    case Phase::kStarting:
      if (!Waiting(kBothTargets)) {
        Enter(Phase::kAwaitingMotion, now_ns, kStartAhead_s + kMotionAfterStart_s);
      }
      break;
    case Phase::kAwaitingMotion:
      StepAwaitingMotion(machine, now_ns);
      break;
    default:
      break;
  }
}

void Conductor::StepFilling(const MachineView& machine, std::int64_t now_ns) {
  const DriveView& drive = *machine.drive;
  const MainMotionView& main_motion = *machine.main_motion;
  const bool segments = drive.plan == plan_.plan_id &&
                        (drive.next_segment >= plan_.segment_count || drive.buffered_s >= kFilledEnough_s);
  const bool events = main_motion.plan == plan_.plan_id &&
                      main_motion.next_event >= std::min(plan_.event_count, kEventsFilledEnough) &&
                      main_motion.next_gate > std::min(plan_.gate_count, kEventsFilledEnough);
  if (segments && events) {
    Send(kBothTargets, Verb::kArm, now_ns);
    Enter(Phase::kArming, now_ns, kAnswer_s);
  } else if (Late(now_ns)) {
    GiveUpStart(
        Refusal{"BUFFERS_NOT_FILLED",
                "drive holds " + std::to_string(drive.next_segment) + " of " +
                    std::to_string(plan_.segment_count) + " segments (" + Text(drive.buffered_s, "s") +
                    "), main_motion " + std::to_string(main_motion.next_event) + " of " +
                    std::to_string(plan_.event_count) + " events; is trajectory heard on the bus?"},
        now_ns);
  }
}

void Conductor::StepPositioning(const MachineView& machine, std::int64_t now_ns) {
  for (const ModuleView* module : {static_cast<const ModuleView*>(&*machine.drive),
                                   static_cast<const ModuleView*>(&*machine.main_motion)}) {
    if (module->mode != ModuleMode::kArmed && module->mode != ModuleMode::kReady) {
      return GiveUpStart(Refusal{ReasonOf(*module), "a module left READY while it was being armed"}, now_ns);
    }
  }
  if (machine.drive->mode == ModuleMode::kArmed && machine.main_motion->mode == ModuleMode::kArmed) {
    drive_session_ = machine.drive->session;
    main_motion_session_ = machine.main_motion->session;
    moved_ = true;
    Send(kBothTargets, Verb::kStart, now_ns, 0.0, After(now_ns, kStartAhead_s));
    return Enter(Phase::kStarting, now_ns, kAnswer_s);
  }
  if (Late(now_ns)) {
    GiveUpStart(Refusal{"NOT_ARMED", "a module has not become ARMED in " + Text(kPositioning_s, "s")},
                now_ns);
  }
}

void Conductor::StepAwaitingMotion(const MachineView& machine, std::int64_t now_ns) {
  const ModuleMode drive = machine.drive->mode;
  const ModuleMode main_motion = machine.main_motion->mode;
  const auto started = [](ModuleMode mode) { return IsPlaying(mode) || mode == ModuleMode::kComplete; };
  if (started(drive) && started(main_motion)) {
    return BeginFollowing(machine, now_ns);
  }
  const auto fell = Loss(machine, now_ns);
  if (fell || Late(now_ns)) {
    GiveUpStart(fell.value_or(Refusal{"NOT_STARTED", "a module is not RUNNING at the common start time"}),
                now_ns);
  }
}

void Conductor::GiveUpStart(const Refusal& why, std::int64_t now_ns) {
  const bool started = phase_ == Phase::kStarting || phase_ == Phase::kAwaitingMotion;
  pending_ = {};
  if (why.reason != "STOPPED") {
    if (started) {
      Send(kBothTargets, Verb::kStop, now_ns);
    } else if (phase_ != Phase::kPreparing && phase_ != Phase::kPlanning) {
      Send(kBothTargets, Verb::kUnload, now_ns);
    }
    pending_ = {};  // nobody waits for these
  }
  Tell(moved_ ? Happening::kInterrupted : Happening::kStartFailed, why.reason, why.message);
  if (!moved_) {
    job_id_.clear();
  }
  phase_ = Phase::kIdle;
}

// --- Following the motion
// ----------------------------------------------------------------------------------------------

void Conductor::BeginFollowing(const MachineView& machine, std::int64_t now_ns) {
  drive_session_ = machine.drive->session;
  main_motion_session_ = machine.main_motion->session;
  drive_complete_ns_ = 0;
  link_resumes_ = 0;
  link_held_ns_ = 0;
  streaming_asked_ = false;
  streaming_reason_.clear();
  stand_reason_.clear();
  next_streaming_ns_ = After(now_ns, kStreamingCheck_s);
  Enter(Phase::kFollowing, now_ns, 0.0);
  if (job_state_ != JobState::kRunning && job_state_ != JobState::kHeld) {
    Tell(Happening::kMoves);
  }
}

std::optional<Refusal> Conductor::ModuleFell(const ModuleView& module, const char* name,
                                             std::uint64_t session) const {
  if (module.session != session) {
    return Refusal{"RESTARTED", std::string(name) +
                                    " has started anew; resume makes it ready and goes on from what was cut"};
  }
  if (HasFallen(module.mode)) {
    return Refusal{ReasonOf(module), std::string(name) + " is " + std::string(Name(module.mode)) +
                                         "; find the cause, then resume from what was cut"};
  }
  if (module.plan != plan_.plan_id) {
    return Refusal{"WRONG_PLAN", std::string(name) + " plays another plan"};
  }
  return std::nullopt;
}

std::optional<Refusal> Conductor::Loss(const MachineView& machine, std::int64_t now_ns) const {
  if (!DriveHeard(machine, now_ns)) {
    return Refusal{"DRIVE_LOST", "drive is not heard; it holds or stops by itself"};
  }
  if (!MainMotionHeard(machine, now_ns)) {
    return Refusal{"MAIN_MOTION_LOST", "main_motion is not heard; drive holds by itself"};
  }
  if (auto fell = ModuleFell(*machine.main_motion, "main_motion", main_motion_session_)) {
    return fell;
  }
  return ModuleFell(*machine.drive, "drive", drive_session_);
}

void Conductor::ConfirmCut(const MachineView& machine) {
  if (machine.main_motion && machine.drive && machine.main_motion->plan == plan_.plan_id &&
      machine.drive->plan == plan_.plan_id && machine.main_motion->mode == ModuleMode::kRunning) {
    s_mm_ = std::max(s_mm_, std::min(machine.main_motion->s_mm, machine.drive->s_mm));
  }
}

void Conductor::Follow(const MachineView& machine, std::int64_t now_ns) {
  ConfirmCut(machine);
  if (const auto loss = Loss(machine, now_ns)) {
    return Interrupt(*loss);
  }
  FollowDriveMode(*machine.drive, *machine.main_motion, now_ns);
  if (phase_ == Phase::kFollowing) {
    ResumeAfterLinkLoss(*machine.drive, now_ns);
    KeepStreaming(*machine.drive, now_ns);
  }
}

// A link that was lost for less than the drive's patience leaves the drive held, nothing stopped and nothing latched: the
// cell lets it go on, backed up and pierced again as after any hold.
void Conductor::ResumeAfterLinkLoss(const DriveView& drive, std::int64_t now_ns) {
  if (drive.mode != ModuleMode::kHeld || drive.reason != ModuleReason::kPeerLost) {
    link_held_ns_ = 0;
    return;
  }
  link_held_ns_ = link_held_ns_ == 0 ? now_ns : link_held_ns_;
  if (Waiting(kDriveTarget) || link_resumes_ >= kMostLinkResumes ||
      SecondsBetween(link_held_ns_, now_ns) < kLinkStands_s) {
    return;
  }
  ++link_resumes_;
  link_held_ns_ = 0;
  Tell(Happening::kNoted, "PEER_LOST", "the link between the modules was lost for a moment; going on");
  Send(kDriveTarget, Verb::kResume, now_ns);
}

void Conductor::FollowDriveMode(const DriveView& drive, const MainMotionView& main_motion,
                                std::int64_t now_ns) {
  if (drive.mode == ModuleMode::kComplete) {
    if (main_motion.mode == ModuleMode::kComplete) {
      return Complete(now_ns);
    }
    drive_complete_ns_ = drive_complete_ns_ == 0 ? now_ns : drive_complete_ns_;
    if (SecondsBetween(drive_complete_ns_, now_ns) > kMainMotionAfterDrive_s) {
      Interrupt(Refusal{"MAIN_MOTION_NOT_COMPLETE", "drive has played the plan; main_motion is still " +
                                                        std::string(Name(main_motion.mode))});
    }
    return;
  }
  const bool stands = drive.mode == ModuleMode::kHolding || drive.mode == ModuleMode::kHeld;
  const std::string reason = stands ? std::string(Name(drive.reason)) : "";
  if (stands && (job_state_ != JobState::kHeld || reason != stand_reason_)) {
    const std::string message = drive.reason == ModuleReason::kStarved
                                    ? "goes on by itself when segments come again"
                                    : "held on the path; resume goes on";
    Tell(job_state_ == JobState::kHeld ? Happening::kNoted : Happening::kStands, reason, message);
    stand_reason_ = reason;
  } else if (drive.mode == ModuleMode::kRunning && job_state_ == JobState::kHeld) {
    Tell(Happening::kMoves);
    stand_reason_.clear();
  }
}

void Conductor::KeepStreaming(const DriveView& drive, std::int64_t now_ns) {
  const bool all_there = plan_.segment_count != 0 && drive.next_segment >= plan_.segment_count;
  if (streaming_asked_ || all_there || now_ns < next_streaming_ns_) {
    return;
  }
  streaming_asked_ = true;
  next_streaming_ns_ = After(now_ns, kStreamingCheck_s);
  actions_.emplace_back(StreamingWanted{job_id_, plan_.plan_id, from_});
}

void Conductor::Complete(std::int64_t now_ns) {
  s_mm_ = std::max(s_mm_, plan_.length_mm);
  Send(kBothTargets, Verb::kUnload, now_ns);
  Tell(Happening::kCompleted);
  Enter(Phase::kUnloading, now_ns, kAnswer_s);
}

void Conductor::Interrupt(const Refusal& why) {
  Tell(Happening::kInterrupted, why.reason, why.message);
  pending_ = {};
  operator_command_ = false;
  phase_ = Phase::kIdle;  // job_id_ stays: the modules may only have been out of hearing
}

// --- Finding a job again
// -----------------------------------------------------------------------------------------------

bool Conductor::HasPlan(const MachineView& machine, std::int64_t now_ns) const {
  return DriveHeard(machine, now_ns) && MainMotionHeard(machine, now_ns) && plan_.plan_id != 0 &&
         machine.drive->plan == plan_.plan_id && machine.main_motion->plan == plan_.plan_id;
}

void Conductor::ListenAgain(const MachineView& machine, std::int64_t now_ns) {
  if (job_id_.empty() || job_state_ != JobState::kInterrupted || !HasPlan(machine, now_ns)) {
    return;
  }
  const auto lives = [](ModuleMode mode) { return IsPlaying(mode) || mode == ModuleMode::kComplete; };
  if (lives(machine.drive->mode) && lives(machine.main_motion->mode)) {
    BeginFollowing(machine, now_ns);
  }
}

void Conductor::StepReconciling(const MachineView& machine, std::int64_t now_ns) {
  const auto lives = [](ModuleMode mode) { return IsPlaying(mode) || mode == ModuleMode::kComplete; };
  if (HasPlan(machine, now_ns) && lives(machine.drive->mode) && lives(machine.main_motion->mode)) {
    return BeginFollowing(machine, now_ns);
  }
  if (!Late(now_ns)) {
    return;
  }
  if (!DriveHeard(machine, now_ns) || !MainMotionHeard(machine, now_ns)) {
    return Interrupt(Refusal{DriveHeard(machine, now_ns) ? "MAIN_MOTION_LOST" : "DRIVE_LOST",
                             "the cell was restarted and does not hear both modules"});
  }
  // READY or ARMED and still referenced: the drive was not started, and nobody but this cell takes plans away.
  const DriveView& drive = *machine.drive;
  const bool untouched =
      drive.referenced && (drive.mode == ModuleMode::kReady || drive.mode == ModuleMode::kArmed);
  if (job_state_ == JobState::kStarting && untouched) {
    phase_ = Phase::kLoading;  // what the modules hold is unloaded again
    return GiveUpStart(Refusal{"CELL_RESTARTED", "the cell was restarted before the motion began"}, now_ns);
  }
  Interrupt(
      Refusal{HasFallen(machine.drive->mode) ? ReasonOf(*machine.drive) : ReasonOf(*machine.main_motion),
              "the machine stopped playing this job while the cell was away"});
}

}  // namespace lambdajet::cell
