#include "cell/desk/job_desk.hpp"

#include <algorithm>
#include <chrono>
#include <random>
#include <utility>

#include "foundation/contract/trouble.hpp"

namespace lambdajet::cell {
namespace {

constexpr double kCheckpoint_s = 2.0;
constexpr double kAdmissionRetry_s = 1.0;
constexpr double kJournalRetry_s = 0.5;
constexpr std::size_t kMostAnnouncements = 256;
constexpr std::size_t kMostAdmissionsWaiting = 1000;
constexpr int kListeningTurns =
    100;  // of a new cell's loop: two seconds of it; whoever is not heard by then is lost

absl::Status Precondition(const Refusal& refusal) {
  return Trouble(absl::StatusCode::kFailedPrecondition, refusal.reason, refusal.message);
}

absl::Status WrongState(const Job& job, std::string_view right) {
  return Trouble(absl::StatusCode::kFailedPrecondition, "WRONG_JOB_STATE",
                 "job " + job.order.job_id + " is " + std::string(Name(job.progress.state)) + "; " +
                     std::string(right) + " is right",
                 {{"job_state", std::string(Name(job.progress.state))}});
}

}  // namespace

JobDesk::JobDesk(std::unique_ptr<Journal> journal, const Clock& clock, std::uint64_t session)
    : journal_(std::move(journal)), clock_(clock), conductor_(session) {}

std::uint64_t NewSession() {
  std::random_device random;
  return (static_cast<std::uint64_t>(random()) << 32U) | random();
}

absl::StatusOr<std::unique_ptr<JobDesk>> JobDesk::Open(const std::string& path, const Clock& clock,
                                                       std::uint64_t session) {
  auto journal = Journal::Open(path);
  if (!journal.ok()) {
    return journal.status();
  }
  auto desk = std::make_unique<JobDesk>(std::move(*journal), clock, session);
  if (absl::Status status = desk->TakeUp(); !status.ok()) {
    return status;
  }
  return desk;
}

absl::Status JobDesk::TakeUp() {
  const Lock lock(mutex_);
  const auto token = journal_->LastToken();
  const auto open = journal_->Unfinished();
  if (!token.ok() || !open.ok()) {
    return token.ok() ? open.status() : token.status();
  }
  last_token_ = *token;
  for (const Job& job : *open) {
    if (job.progress.state == JobState::kAdmitting) {
      admissions_.push_back(job.order.job_id);
    } else if (HoldsMachine(job.progress.state) && !active_) {
      active_ = job;
      recorder_.Begin(job.progress.started_ns);
      conductor_.Reconcile(job, clock_.now_ns());
    }
  }
  return absl::OkStatus();
}

void JobDesk::Close() {
  const Lock lock(mutex_);
  closed_ = true;
  changed_.notify_all();
}

template <typename Condition>
bool JobDesk::WaitFor(Lock& lock, double patience_s, Condition&& condition) {
  const auto patience = std::chrono::microseconds(static_cast<std::int64_t>(std::max(patience_s, 0.0) * 1e6));
  return changed_.wait_for(lock, patience, [&] { return closed_ || condition(); }) && !closed_;
}

// --- Writing down ------------------------------------------------------------------------------------------------------

absl::StatusOr<Job> JobDesk::Current(const std::string& job_id) {
  if (active_ && active_->order.job_id == job_id) {
    return *active_;
  }
  return journal_->Find(job_id);
}

LiveJob JobDesk::Live(const Job& job) const {
  LiveJob live{job};
  if (conductor_.phase() == Phase::kFollowing && conductor_.job_id() == job.order.job_id) {
    live.job.progress.s_mm = std::max(job.progress.s_mm, conductor_.s_mm());
    live.feed_mm_per_s = machine_.drive ? machine_.drive->s_rate_mm_per_s : 0.0;
  }
  return live;
}

absl::Status JobDesk::WriteDown(const Job& job) {
  const auto record = journal_->Append(job, clock_.now_ns());
  if (!record.ok()) {
    journal_trouble_ = std::string(record.status().message());
    return record.status();
  }
  journal_trouble_.clear();
  last_token_ = record->token;
  if (records_.size() < kMostAnnouncements) {
    records_.push_back(*record);
  }
  changed_.notify_all();
  return absl::OkStatus();
}

absl::Status JobDesk::Change(Job job, Happening happening, const News& news) {
  const auto next = Next(job.progress.state, happening);
  if (!next) {
    return WrongState(job, std::string("a state that knows ") + std::string(Name(happening)));
  }
  JobProgress& progress = job.progress;
  const std::int64_t now_ns = clock_.now_ns();
  progress.state = *next;
  progress.reason = news.reason;
  progress.message = news.message;
  progress.faults = news.faults;
  progress.s_mm = std::max(progress.s_mm, news.s_mm);
  if (news.plan && news.plan->plan_id != 0 && news.plan->plan_id != progress.plan_id) {
    const bool whole = happening == Happening::kAdmitted || progress.s_mm <= 0.0;
    progress.plan_id = news.plan->plan_id;
    progress.model_version = news.plan->model_version;
    progress.predicted_95_mm = news.plan->predicted_95_mm;
    if (whole) {
      progress.length_mm = news.plan->length_mm;
      progress.expected_duration_s = news.plan->duration_s + news.plan->gate_time_s;
    }
  }
  if (happening == Happening::kMoves &&
      (progress.plan_ids.empty() || progress.plan_ids.back() != progress.plan_id)) {
    progress.plan_ids.push_back(progress.plan_id);
  }
  if (happening == Happening::kMoves && progress.started_ns == 0) {
    progress.started_ns = now_ns;
  }
  progress.interruptions += happening == Happening::kInterrupted ? 1 : 0;
  progress.s_mm = happening == Happening::kCompleted ? progress.length_mm : progress.s_mm;
  progress.ended_ns = HasEnded(*next) ? now_ns : 0;
  if (active_ && active_->order.job_id == job.order.job_id) {
    active_ = job;  // the machine's truth goes on in memory even if the disk fails
  }
  return WriteDown(job);
}

absl::Status JobDesk::Change(const News& news) {
  auto job = Current(news.job_id);
  return job.ok() ? Change(std::move(*job), news.happening, news) : job.status();
}

// Carries out what the conductor wants; the planner's answers come back later.
void JobDesk::Carry(std::vector<Action> actions) {
  for (Action& action : actions) {
    if (auto* command = std::get_if<CommandOut>(&action)) {
      commands_.push_back(std::move(*command));
    } else if (const auto* news = std::get_if<News>(&action)) {
      const bool first = news->happening == Happening::kMoves && active_ && active_->progress.started_ns == 0;
      (void)Change(*news);
      if (first) {
        recorder_.Begin(clock_.now_ns());
      }
    } else {
      const auto* plan = std::get_if<PlanWanted>(&action);
      const auto* streaming = std::get_if<StreamingWanted>(&action);
      const std::string& job_id = plan != nullptr ? plan->job_id : streaming->job_id;
      const auto program = journal_->Program(job_id);
      if (!program.ok() || !active_) {
        conductor_.Take(
            PlanOutcome{job_id, std::nullopt, {}, "JOURNAL_FAILED", std::string(program.status().message())},
            clock_.now_ns());
        continue;
      }
      machine_tasks_.push_back({active_->order, *program, streaming != nullptr ? streaming->plan_id : 0,
                                plan != nullptr ? plan->from : streaming->from});
      changed_.notify_all();
    }
  }
}

void JobDesk::CheckpointIfDue(std::int64_t now_ns) {
  const bool over = !active_ || !HoldsMachine(active_->progress.state);
  const bool anything = !recorder_.gathered().trace.empty() || !recorder_.gathered().events.empty();
  if (!active_ || (now_ns < next_checkpoint_ns_ && !(over && journal_trouble_.empty())) || !anything) {
    return;
  }
  next_checkpoint_ns_ = After(now_ns, kCheckpoint_s);
  if (conductor_.job_id() == active_->order.job_id && !over) {
    active_->progress.s_mm = std::max(active_->progress.s_mm, conductor_.s_mm());
  }
  const absl::Status written =
      journal_->Checkpoint(active_->order.job_id, active_->progress.s_mm, recorder_.gathered());
  if (written.ok()) {
    recorder_.Take();
  } else {
    journal_trouble_ = std::string(written.message());
  }
}

// What the journal could not take, in a full disk say, is in memory still: the job as it is now, ended or not.
void JobDesk::WriteDownAgainIfDue(std::int64_t now_ns) {
  if (!journal_trouble_.empty() && now_ns >= next_writing_ns_) {
    next_writing_ns_ = After(now_ns, kJournalRetry_s);
    (void)WriteDown(*active_);
  }
}

JobDesk::Outgoing JobDesk::Cycle() {
  const Lock lock(mutex_);
  const std::int64_t now_ns = clock_.now_ns();
  ++turns_;
  if (machine_.drive) {
    ++machine_.drive->quiet_turns;
  }
  if (machine_.main_motion) {
    ++machine_.main_motion->quiet_turns;
  }
  conductor_.Step(machine_, now_ns);
  for (auto actions = conductor_.TakeActions(); !actions.empty(); actions = conductor_.TakeActions()) {
    Carry(std::move(actions));
  }
  if (active_) {
    recorder_.Cycle(machine_, active_->progress.state, now_ns);
    CheckpointIfDue(now_ns);
    WriteDownAgainIfDue(now_ns);
  }
  changed_.notify_all();
  return {std::exchange(commands_, {}), std::exchange(records_, {})};
}

// --- Clients -----------------------------------------------------------------------------------------------------------

absl::StatusOr<LiveJob> JobDesk::Submit(const Submission& submission, double patience_s) {
  Lock lock(mutex_);
  const auto known = journal_->FindRequest(submission.request_id);
  if (!known.ok()) {
    return known.status();
  }
  if (*known && (*known)->order.content_sha256 != submission.content_sha256) {
    return Trouble(absl::StatusCode::kAlreadyExists, "REQUEST_ID_REUSED",
                   "request_id '" + submission.request_id + "' stands for job " + (*known)->order.job_id +
                       " with other content; a new request_id for a new wish is right",
                   {{"job_id", (*known)->order.job_id}});
  }
  if (*known) {
    return Live(active_ && active_->order.job_id == (*known)->order.job_id ? *active_ : **known);
  }
  if (submission.machine_version && model_version_ &&
      model_version_->version != *submission.machine_version) {
    return Trouble(absl::StatusCode::kFailedPrecondition, "WRONG_MACHINE_VERSION",
                   "machine_version is " + std::to_string(*submission.machine_version) + "; active is " +
                       std::to_string(model_version_->version),
                   {{"active_version", std::to_string(model_version_->version)}});
  }
  if (admissions_.size() >= kMostAdmissionsWaiting) {
    return Trouble(absl::StatusCode::kResourceExhausted, "TOO_MANY_ADMISSIONS",
                   std::to_string(admissions_.size()) + " jobs wait for admission; try again later");
  }
  Job job;
  job.order = {"",
               submission.request_id,
               submission.name,
               submission.program_sha256,
               submission.content_sha256,
               submission.compensate,
               submission.feed_scale,
               submission.machine_version.has_value(),
               submission.machine_version.value_or(0),
               clock_.now_ns(),
               submission.program_format,
               submission.toolpath};
  const auto record = journal_->Add(job, submission.program, clock_.now_ns());
  if (!record.ok()) {
    return record.status();
  }
  last_token_ = record->token;
  records_.push_back(*record);
  const std::string job_id = record->job.order.job_id;
  admissions_.push_back(job_id);
  changed_.notify_all();
  absl::StatusOr<Job> now = record->job;
  WaitFor(lock, patience_s, [&] {
    now = Current(job_id);
    return !now.ok() || now->progress.state != JobState::kAdmitting || !now->progress.reason.empty();
  });
  if (!now.ok()) {
    return now.status();
  }
  return Live(*now);
}

absl::Status JobDesk::CheckMayStart(const Job& job) {
  if (active_ && active_->order.job_id != job.order.job_id && HoldsMachine(active_->progress.state)) {
    return Trouble(absl::StatusCode::kFailedPrecondition, "ANOTHER_JOB_RUNS",
                   "job " + active_->order.job_id + " holds the machine; wait for its end or stop it",
                   {{"job_id", active_->order.job_id}});
  }
  if (!model_version_) {
    return Trouble(absl::StatusCode::kFailedPrecondition, "NO_MACHINE_DESCRIPTION",
                   "no machine description has been heard; is calibration running?");
  }
  return absl::OkStatus();
}

absl::StatusOr<LiveJob> JobDesk::WaitUntilStarted(Lock& lock, const std::string& job_id, double patience_s) {
  absl::StatusOr<Job> now = Current(job_id);
  WaitFor(lock, patience_s, [&] {
    now = Current(job_id);
    return !now.ok() || now->progress.state != JobState::kStarting;
  });
  if (!now.ok()) {
    return now.status();
  }
  const JobState state = now->progress.state;
  if (state == JobState::kReady || state == JobState::kInterrupted || state == JobState::kRefused) {
    return Precondition(
        {now->progress.reason.empty() ? "NOT_STARTED" : now->progress.reason, now->progress.message});
  }
  return Live(*now);
}

// A job that has just completed is still being unloaded for a moment.
void JobDesk::WaitUntilUnloaded(Lock& lock, double patience_s) {
  WaitFor(lock, patience_s, [&] { return conductor_.phase() != Phase::kUnloading; });
}

// Nor has a cell that has just begun heard everybody.
void JobDesk::WaitUntilListened(Lock& lock, double patience_s) {
  WaitFor(lock, patience_s, [&] {
    return turns_ >= kListeningTurns || (machine_.drive && machine_.main_motion && model_version_);
  });
}

absl::StatusOr<LiveJob> JobDesk::Start(const std::string& job_id, double patience_s) {
  Lock lock(mutex_);
  WaitUntilListened(lock, patience_s);
  WaitUntilUnloaded(lock, patience_s);
  const auto job = Current(job_id);
  if (!job.ok()) {
    return job.status();
  }
  if (HoldsMachine(job->progress.state) || job->progress.state == JobState::kCompleted) {
    return WaitUntilStarted(lock, job_id, patience_s);  // asked twice, started once
  }
  if (job->progress.state != JobState::kReady) {
    return WrongState(*job, job->progress.state == JobState::kInterrupted ? "ResumeJob" : "READY");
  }
  if (absl::Status may = CheckMayStart(*job); !may.ok()) {
    return may;
  }
  if (const auto refusal = conductor_.Start(*job, kDefaultOverlap_mm, machine_, clock_.now_ns())) {
    return Precondition(*refusal);
  }
  active_ = *job;
  Carry(conductor_.TakeActions());
  return WaitUntilStarted(lock, job_id, patience_s);
}

absl::StatusOr<LiveJob> JobDesk::Resume(const std::string& job_id, double overlap_mm, double patience_s) {
  Lock lock(mutex_);
  WaitUntilListened(lock, patience_s);
  WaitUntilUnloaded(lock, patience_s);
  const auto job = Current(job_id);
  if (!job.ok()) {
    return job.status();
  }
  if (job->progress.state == JobState::kInterrupted) {
    if (absl::Status may = CheckMayStart(*job); !may.ok()) {
      return may;
    }
    if (const auto refusal = conductor_.Start(*job, overlap_mm, machine_, clock_.now_ns())) {
      return Precondition(*refusal);
    }
    active_ = *job;
    Carry(conductor_.TakeActions());
    return WaitUntilStarted(lock, job_id, patience_s);
  }
  if (job->progress.state != JobState::kHeld && job->progress.state != JobState::kRunning) {
    return WrongState(*job, "HELD or INTERRUPTED");
  }
  if (job->progress.state == JobState::kRunning && (!machine_.drive || machine_.drive->gate_waiting == 0)) {
    return Live(*job);
  }
  if (const auto refusal = conductor_.Resume(machine_, clock_.now_ns())) {
    return Precondition(*refusal);
  }
  WaitFor(lock, patience_s, [&] { return !conductor_.operator_command_pending(); });
  if (conductor_.operator_trouble()) {
    return Precondition(*conductor_.operator_trouble());
  }
  WaitFor(lock, patience_s, [&] { return !active_ || active_->progress.state != JobState::kHeld; });
  const auto now = Current(job_id);
  return now.ok() ? absl::StatusOr<LiveJob>(Live(*now)) : now.status();
}

absl::StatusOr<LiveJob> JobDesk::Hold(const std::string& job_id, double patience_s) {
  Lock lock(mutex_);
  const auto job = Current(job_id);
  if (!job.ok()) {
    return job.status();
  }
  if (job->progress.state == JobState::kHeld && job->progress.reason == "COMMANDED") {
    return Live(*job);
  }
  if (job->progress.state != JobState::kRunning && job->progress.state != JobState::kHeld) {
    return WrongState(*job, "RUNNING");
  }
  if (const auto refusal = conductor_.Hold(machine_, clock_.now_ns())) {
    return Precondition(*refusal);
  }
  WaitFor(lock, patience_s, [&] { return !conductor_.operator_command_pending(); });
  if (conductor_.operator_trouble()) {
    return Precondition(*conductor_.operator_trouble());
  }
  WaitFor(lock, patience_s, [&] { return !active_ || active_->progress.state != JobState::kRunning; });
  const auto now = Current(job_id);
  return now.ok() ? absl::StatusOr<LiveJob>(Live(*now)) : now.status();
}

absl::StatusOr<std::optional<LiveJob>> JobDesk::Stop(const std::string& job_id) {
  const Lock lock(mutex_);
  std::optional<Job> job;
  if (!job_id.empty()) {
    const auto found = Current(job_id);
    if (!found.ok()) {
      return found.status();
    }
    job = *found;
    if (!HoldsMachine(job->progress.state)) {
      return std::optional(Live(*job));  // nothing of it moves
    }
  }
  conductor_.Stop(clock_.now_ns());
  Carry(conductor_.TakeActions());
  if (!job && active_ && HoldsMachine(active_->progress.state)) {
    job = active_;
  }
  return job ? std::optional(Live(*job)) : std::nullopt;
}

absl::StatusOr<LiveJob> JobDesk::Cancel(const std::string& job_id) {
  const Lock lock(mutex_);
  const auto job = Current(job_id);
  if (!job.ok()) {
    return job.status();
  }
  if (job->progress.state == JobState::kCancelled) {
    return Live(*job);
  }
  if (!Next(job->progress.state, Happening::kCancelled)) {
    return WrongState(*job, HasEnded(job->progress.state) ? "a job that has not ended" : "StopJob first");
  }
  News news;
  news.job_id = job_id;
  news.reason = "CANCELLED";
  news.message = "given up by a client";
  const absl::Status changed = Change(*job, Happening::kCancelled, news);
  if (!changed.ok()) {
    return changed;
  }
  conductor_.Forget(job_id);
  const auto now = Current(job_id);
  return now.ok() ? absl::StatusOr<LiveJob>(Live(*now)) : now.status();
}

absl::StatusOr<double> JobDesk::Override(double factor, double patience_s) {
  Lock lock(mutex_);
  if (const auto refusal = conductor_.Override(factor, machine_, clock_.now_ns())) {
    return Precondition(*refusal);
  }
  Carry(conductor_.TakeActions());
  const bool answered = WaitFor(lock, patience_s, [&] { return !conductor_.operator_command_pending(); });
  if (answered && conductor_.operator_trouble()) {
    return Precondition(*conductor_.operator_trouble());
  }
  if (!answered || !machine_.drive) {
    return Trouble(absl::StatusCode::kDeadlineExceeded, "NOT_CONFIRMED",
                   "the drive has not confirmed the override in time");
  }
  return machine_.drive->feed_override;
}

absl::StatusOr<MachineWord> JobDesk::Reset(double patience_s) {
  Lock lock(mutex_);
  WaitUntilListened(lock, patience_s);
  WaitUntilUnloaded(lock, patience_s);
  if (const auto refusal = conductor_.Reset(machine_, clock_.now_ns())) {
    return Precondition(*refusal);
  }
  const bool over = WaitFor(lock, patience_s, [&] { return !conductor_.busy(); });
  if (over && conductor_.reset_trouble()) {
    return Precondition(*conductor_.reset_trouble());
  }
  return MachineNow();
}

absl::StatusOr<LiveJob> JobDesk::Find(const std::string& job_id) {
  const Lock lock(mutex_);
  const auto job = Current(job_id);
  return job.ok() ? absl::StatusOr<LiveJob>(Live(*job)) : job.status();
}

absl::StatusOr<std::vector<LiveJob>> JobDesk::List(std::int64_t before, std::optional<JobState> state,
                                                   int most, std::int64_t& last) {
  const Lock lock(mutex_);
  const auto jobs = journal_->List(before, state, most, last);
  if (!jobs.ok()) {
    return jobs.status();
  }
  std::vector<LiveJob> live;
  live.reserve(jobs->size());
  for (const Job& job : *jobs) {
    live.push_back(Live(job));
  }
  return live;
}

absl::StatusOr<std::vector<JournalRecord>> JobDesk::Since(std::uint64_t token, const std::string& job_id,
                                                          int most) {
  const Lock lock(mutex_);
  return journal_->Since(token, job_id, most);
}

std::uint64_t JobDesk::last_token() {
  const Lock lock(mutex_);
  return last_token_;
}

absl::StatusOr<JobRecord> JobDesk::Record(const std::string& job_id) {
  const Lock lock(mutex_);
  auto record = journal_->Record(job_id);
  if (record.ok() && active_ && active_->order.job_id == job_id) {
    Append(*record, recorder_.gathered());
  }
  return record;
}

// --- The machine -------------------------------------------------------------------------------------------------------

std::vector<Veto> JobDesk::Vetoes() const {
  std::vector<Veto> vetoes = StartVetoes(machine_, clock_.now_ns());
  if (!model_version_) {
    vetoes.push_back(
        {"NO_MACHINE_DESCRIPTION", "no machine description has been heard; is calibration running?"});
  }
  if (active_ && HoldsMachine(active_->progress.state)) {
    vetoes.push_back({"JOB_RUNS", "job " + active_->order.job_id + " holds the machine"});
  }
  if (!journal_trouble_.empty()) {
    vetoes.push_back({"JOURNAL_FAILED", journal_trouble_});
  }
  for (const NodeWord& service : services_) {
    if (service.name == "trajectory" &&
        service.mode != "SERVING") {  // a start needs a plan; nothing else is needed for it
      vetoes.push_back({"TRAJECTORY_UNREACHABLE", "trajectory does not answer; start it"});
    }
  }
  return vetoes;
}

MachineWord JobDesk::MachineNow() const {
  MachineWord word;
  const std::int64_t now_ns = clock_.now_ns();
  const auto add = [&](const char* name, const ModuleView* module) {
    const bool heard = module != nullptr && Heard(*module, now_ns);
    word.nodes.push_back(
        {name, heard ? std::string(Name(module->mode)) : "LOST",
         heard ? (module->reason == ModuleReason::kNone ? "" : std::string(Name(module->reason)))
               : "NOT_HEARD",
         module == nullptr ? 0.0 : SecondsBetween(module->heard_ns, now_ns)});
  };
  add("drive", machine_.drive ? &*machine_.drive : nullptr);
  add("main_motion", machine_.main_motion ? &*machine_.main_motion : nullptr);
  word.nodes.insert(word.nodes.end(), services_.begin(), services_.end());
  for (const Veto& veto : Vetoes()) {
    word.vetoes.push_back(veto.reason + ": " + veto.message);
  }
  word.model_version = model_version_.value_or(ModelVersion{});
  word.job_id = active_ && HoldsMachine(active_->progress.state) ? active_->order.job_id : "";
  return word;
}

MachineWord JobDesk::Machine() {
  const Lock lock(mutex_);
  return MachineNow();
}

void JobDesk::Hear(const DriveView& drive) {
  const Lock lock(mutex_);
  machine_.drive = drive;
}

void JobDesk::Hear(const MainMotionView& main_motion) {
  const Lock lock(mutex_);
  machine_.main_motion = main_motion;
}

void JobDesk::Hear(std::uint64_t plan_id, const EventDeviation& event) {
  const Lock lock(mutex_);
  if (active_ && active_->progress.plan_id == plan_id) {
    recorder_.Add(event);
  }
}

void JobDesk::HearModel(const ModelVersion& version) {
  const Lock lock(mutex_);
  model_version_ = version;
}

void JobDesk::HearService(const std::string& name, bool serving, const std::string& reason) {
  const Lock lock(mutex_);
  auto found = std::find_if(services_.begin(), services_.end(),
                            [&](const NodeWord& word) { return word.name == name; });
  if (found == services_.end()) {
    found = services_.insert(services_.end(), NodeWord{name, "", "", 0.0});
  }
  found->mode = serving ? "SERVING" : "LOST";
  found->reason = reason;
}

// --- The planner -------------------------------------------------------------------------------------------------------

std::optional<AdmissionTask> JobDesk::NextAdmission() {
  Lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [&] { return closed_ || !admissions_.empty(); });
    if (closed_) {
      return std::nullopt;
    }
    const std::string job_id = admissions_.front();
    admissions_.pop_front();
    const auto job = journal_->Find(job_id);
    const auto program = journal_->Program(job_id);
    if (job.ok() && program.ok() && job->progress.state == JobState::kAdmitting) {
      return AdmissionTask{job->order, *program};
    }
  }
}

std::optional<MachineTask> JobDesk::NextMachineTask() {
  Lock lock(mutex_);
  changed_.wait(lock, [&] { return closed_ || !machine_tasks_.empty(); });
  if (closed_) {
    return std::nullopt;
  }
  MachineTask task = std::move(machine_tasks_.front());
  machine_tasks_.pop_front();
  return task;
}

void JobDesk::Admitted(const std::string& job_id, const Admission& admission) {
  Lock lock(mutex_);
  auto job = journal_->Find(job_id);
  if (!job.ok() || job->progress.state != JobState::kAdmitting) {
    return;  // given up meanwhile
  }
  News news;
  news.job_id = job_id;
  news.reason = admission.reason;
  news.message = admission.message;
  news.faults = admission.faults;
  news.plan = admission.plan;
  using enum Admission::Verdict;
  const Happening happening = admission.verdict == kAdmitted  ? Happening::kAdmitted
                              : admission.verdict == kRefused ? Happening::kRefused
                              : admission.verdict == kFailed  ? Happening::kFailed
                                                              : Happening::kNoted;
  absl::Status written;
  if (happening != Happening::kNoted || job->progress.reason != admission.reason) {
    written = Change(std::move(*job), happening, news);
  }
  if (happening == Happening::kNoted || !written.ok()) {
    // Trajectory is away, or the journal cannot be written: every other admission would fail too, so this one keeps its place.
    admissions_.push_front(job_id);
    WaitFor(lock, kAdmissionRetry_s, [] { return false; });
  }
}

void JobDesk::Answer(const PlanOutcome& outcome) {
  const Lock lock(mutex_);
  conductor_.Take(outcome, clock_.now_ns());
}

void JobDesk::Answer(const StreamingOutcome& outcome) {
  const Lock lock(mutex_);
  conductor_.Take(outcome, clock_.now_ns());
}

}  // namespace lambdajet::cell
