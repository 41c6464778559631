#include "calibration/desk/calibration_desk.hpp"

#include <cstdio>
#include <random>
#include <utility>

#include "foundation/contract/trouble.hpp"
#include "platform/machine_file/machine_file.hpp"

namespace lambdajet::calibration {
namespace {

constexpr std::size_t kMostWaiting = 8;
const std::string kUnnamed = "unnamed";

absl::Status Unknown(const char* reason, const std::string& what) {
  return Trouble(absl::StatusCode::kNotFound, reason, what);
}

std::string NewId() {
  std::random_device random;
  char id[48];
  std::snprintf(id, sizeof id, "identification-%08x%08x", random(), random());
  return id;
}

std::vector<Measurement> LooksOf(const std::vector<RecordedLook>& run) {
  std::vector<Measurement> looks;
  for (const RecordedLook& recorded : run) {
    looks.push_back(recorded.look);
  }
  return looks;
}

absl::StatusOr<MeasuringPlan> Refused(MeasuringPlan plan) {
  if (plan.reason != PlanReason::kPlanned) {
    return Trouble(absl::StatusCode::kFailedPrecondition, PlanReasonName(plan.reason), plan.explanation);
  }
  return plan;
}

// The machine as designed: from the store, or, where that is new, from the file, which then becomes version 0.
absl::StatusOr<MachineDescription> AsDesigned(CalibrationStore& store, const std::string& machine_file,
                                              const Clock& clock) {
  const auto kept = store.AsDesigned();
  if (!kept.ok()) {
    return kept.status();
  }
  if (!kept->empty()) {
    return ParseMachine(*kept, "version 0 in the store");
  }
  if (machine_file.empty()) {
    return Trouble(absl::StatusCode::kFailedPrecondition, "NO_MACHINE_FILE",
                   "the store has no version yet: name the machine file with --machine=FILE");
  }
  auto machine = ReadMachineFile(machine_file);
  if (!machine.ok()) {
    return machine.status();
  }
  machine->version = 0;
  machine->hash = MachineHash(*machine);
  Version version;
  version.author = "machine file";
  version.created_utc_ns = clock.now_ns();
  version.hash = machine->hash;
  version.parameters = machine->parameters;
  version.covariance = machine->covariance;
  if (const absl::Status begun = store.Begin(MachineText(*machine), version); !begun.ok()) {
    return begun;
  }
  return machine;
}

}  // namespace

absl::StatusOr<std::unique_ptr<CalibrationDesk>> CalibrationDesk::Open(const std::string& store_path,
                                                                       const std::string& machine_file,
                                                                       const std::string& machine_id,
                                                                       const Clock& clock) {
  auto store = CalibrationStore::Open(store_path);
  if (!store.ok()) {
    return store.status();
  }
  if (const auto ended = (*store)->EndInterrupted(); !ended.ok()) {
    return ended.status();
  }
  auto machine = AsDesigned(**store, machine_file, clock);
  if (!machine.ok()) {
    return machine.status();
  }
  if (machine->machine_id != machine_id) {
    return Trouble(absl::StatusCode::kFailedPrecondition, "OTHER_MACHINE",
                   "the store and machine file are of \"" + machine->machine_id +
                       "\", this service is set up for \"" + machine_id + "\"");
  }
  const auto number = (*store)->ActiveVersion();
  if (!number.ok()) {
    return number.status();
  }
  const auto version = (*store)->FindVersion(*number);
  if (!version.ok() || !*version) {
    return version.ok() ? Unknown("UNKNOWN_VERSION", "the active version is not in the store")
                        : version.status();
  }
  std::string yaml = MachineText(*machine);
  std::unique_ptr<CalibrationDesk> desk(
      new CalibrationDesk(std::move(*store), std::move(*machine), std::move(yaml), clock));
  desk->SetActive(**version);
  return desk;
}

CalibrationDesk::CalibrationDesk(std::unique_ptr<CalibrationStore> store, MachineDescription as_designed,
                                 std::string yaml, const Clock& clock)
    : store_(std::move(store)),
      as_designed_(std::make_shared<const MachineDescription>(std::move(as_designed))),
      as_designed_yaml_(std::move(yaml)),
      clock_(clock),
      worker_(std::make_unique<WorkPool>(1, kMostWaiting)) {}

CalibrationDesk::~CalibrationDesk() { Close(); }

void CalibrationDesk::Close() {
  {
    const std::lock_guard lock(mutex_);
    for (auto& [id, running] : running_) {
      running->cancelled = true;
    }
  }
  worker_.reset();
}

MachineDescription CalibrationDesk::MachineOf(const Version& version) const {
  MachineDescription machine = *as_designed_;
  machine.version = version.number;
  machine.parameters = version.parameters;
  machine.covariance = version.covariance;
  machine.hash = MachineHash(machine);
  return machine;
}

void CalibrationDesk::SetActive(const Version& version) {
  const std::lock_guard lock(mutex_);
  active_ = std::make_shared<const MachineDescription>(MachineOf(version));
  for (const MachineListener& listener : listeners_) {
    listener(*active_, as_designed_yaml_);
  }
}

void CalibrationDesk::Listen(MachineListener listener) {
  const std::lock_guard lock(mutex_);
  listener(*active_, as_designed_yaml_);
  listeners_.push_back(std::move(listener));
}

SharedMachine CalibrationDesk::active() const {
  const std::lock_guard lock(mutex_);
  return active_;
}

absl::StatusOr<std::vector<RecordedLook>> CalibrationDesk::Run(std::uint64_t plan) {
  if (before_reading_) {
    before_reading_();
  }
  auto looks = store_->Looks(plan);
  if (looks.ok() && looks->empty()) {
    return Unknown("UNKNOWN_RUN",
                   "no look of plan " + std::to_string(plan) + " has come; ListRuns names those that have");
  }
  return looks;
}

absl::StatusOr<MeasuringPlan> CalibrationDesk::PlanRun(const MeasuringPlanOptions& options) const {
  return Refused(PlanMeasuringRun(*active(), options));
}

absl::StatusOr<MeasuringPlan> CalibrationDesk::PlanShortRun(int looks) const {
  return Refused(PlanVerification(*active(), looks));
}

absl::StatusOr<std::pair<Verification, SharedMachine>> CalibrationDesk::Verify(std::uint64_t plan) {
  const auto run = Run(plan);
  if (!run.ok()) {
    return run.status();
  }
  SharedMachine machine = active();
  Verification found = VerifyBase(*machine, LooksOf(*run));
  if (found.verdict == Verdict::kTooFew) {
    return Trouble(absl::StatusCode::kFailedPrecondition, "TOO_FEW", found.explanation);
  }
  return std::pair(std::move(found), std::move(machine));
}

absl::StatusOr<OperationView> CalibrationDesk::StartIdentification(std::uint64_t plan,
                                                                   const std::string& author) {
  const auto run = Run(plan);
  if (!run.ok()) {
    return run.status();
  }
  StoredOperation operation;
  operation.id = NewId();
  operation.plan = plan;
  operation.author = author.empty() ? kUnnamed : author;
  if (const absl::Status added = store_->AddOperation(operation); !added.ok()) {
    return added;
  }
  auto running = std::make_shared<Running>();
  running->phase = "waiting";
  {
    const std::lock_guard lock(mutex_);
    running_[operation.id] = running;
  }
  const absl::Status queued = worker_->Submit(
      [this, operation, looks = LooksOf(*run), running] { IdentifyRun(operation, looks, running); });
  if (!queued.ok()) {
    operation.state = OperationState::kFailed;
    operation.reason = TroubleReason(queued);
    operation.message = "too many identifications wait already; try again later";
    (void)store_->EndOperation(operation);  // the caller is told what counts: the queue is full
    const std::lock_guard lock(mutex_);
    running_.erase(operation.id);
    return queued;
  }
  return FindOperation(operation.id);
}

void CalibrationDesk::IdentifyRun(StoredOperation operation, std::vector<Measurement> looks,
                                  std::shared_ptr<Running> running) {
  IdentificationOptions options;
  options.watch = [&running](double progress, const char* phase) {
    const std::lock_guard lock(running->mutex);
    running->progress = progress;
    running->phase = phase;
    return !running->cancelled.load();
  };
  const Identification found = Identify(*as_designed_, looks, options);
  absl::Status kept;
  if (found.reason == IdentificationReason::kIdentified) {
    kept = Keep(found, operation);
  } else {
    operation.state = found.reason == IdentificationReason::kCancelled ? OperationState::kCancelled
                                                                       : OperationState::kFailed;
    operation.reason = IdentificationReasonName(found.reason);
    operation.message = found.explanation;
    kept = store_->EndOperation(operation);
  }
  if (!kept.ok()) {  // the store is full or broken: say so for as long as the process lives
    operation.state = OperationState::kFailed;
    operation.reason = TroubleReason(kept);
    operation.message = std::string(kept.message());
    (void)store_->EndOperation(operation);
  }
  const std::lock_guard lock(mutex_);
  running_.erase(operation.id);
}

absl::Status CalibrationDesk::Keep(const Identification& found, StoredOperation& operation) {
  const auto newest = store_->Versions(1, std::nullopt);
  if (!newest.ok()) {
    return newest.status();
  }
  Version version;
  version.number = newest->empty() ? 1 : newest->front().number + 1;
  version.parent = active()->version;
  version.author = operation.author;
  version.created_utc_ns = clock_.now_ns();
  version.run = operation.plan;
  version.parameters = found.parameters;
  version.covariance = found.covariance;
  version.hash = MachineOf(version).hash;
  operation.state = OperationState::kDone;
  operation.message = found.explanation;
  operation.report = ReportToText(ReportOf(found, *as_designed_, version.number));
  return store_->EndWithVersion(operation, version).status();
}

absl::StatusOr<OperationView> CalibrationDesk::FindOperation(const std::string& id) {
  std::shared_ptr<Running> running;
  {
    const std::lock_guard lock(mutex_);
    const auto at = running_.find(id);
    running = at == running_.end() ? nullptr : at->second;
  }
  const auto stored = store_->FindOperation(id);
  if (!stored.ok()) {
    return stored.status();
  }
  if (!*stored) {
    return Unknown("UNKNOWN_OPERATION", "no identification has this id");
  }
  const StoredOperation& operation = **stored;
  OperationView view{operation.id,     operation.state,   1.0,         "",
                     operation.reason, operation.message, std::nullopt};
  if (operation.state == OperationState::kRunning && running != nullptr) {
    const std::lock_guard lock(running->mutex);
    view.progress = running->progress;
    view.phase = running->phase;
  }
  if (operation.state == OperationState::kDone) {
    auto report = ReportFromText(operation.report);
    if (!report.ok()) {
      return report.status();
    }
    view.report = std::move(*report);
  }
  return view;
}

absl::StatusOr<OperationView> CalibrationDesk::Cancel(const std::string& id) {
  {
    const std::lock_guard lock(mutex_);
    const auto at = running_.find(id);
    if (at != running_.end()) {
      at->second->cancelled = true;
    }
  }
  return FindOperation(id);
}

absl::StatusOr<Version> CalibrationDesk::FindVersion(std::optional<std::uint32_t> number) {
  const std::uint32_t wanted = number ? *number : active()->version;
  const auto version = store_->FindVersion(wanted);
  if (!version.ok()) {
    return version.status();
  }
  if (!*version) {
    return Unknown("UNKNOWN_VERSION", "there is no version " + std::to_string(wanted));
  }
  return **version;
}

absl::StatusOr<SharedMachine> CalibrationDesk::Activate(std::uint32_t number, const std::string& author) {
  const auto version = FindVersion(number);
  if (!version.ok()) {
    return version.status();
  }
  if (active()->version != number) {
    if (const absl::Status written =
            store_->Activate(number, author.empty() ? kUnnamed : author, clock_.now_ns());
        !written.ok()) {
      return written;
    }
    SetActive(*version);
  }
  return active();
}

}  // namespace lambdajet::calibration
