#include "trajectory/rpc/plan_desk.hpp"

#include <algorithm>
#include <chrono>
#include <utility>

#include "accuracy/core/prediction.hpp"

namespace lambdajet::trajectory {
namespace {

constexpr std::size_t kPlanThreads = 1;
constexpr std::size_t kMostPlansWaiting = 16;
constexpr int kDraws = 200;

// Of the work: planning is most of it where the feed is found from a tolerance, about half where it is not.
double PlanningShare(const PlanOptions& options) { return options.hold.empty() ? 0.5 : 0.97; }

// Without an answer where nothing is cut.
double PredictedBound(const MachineDescription& machine, const PlannedProgram& planned, PlanRecord& record) {
  accuracy::PredictionOptions options;
  options.draws = kDraws;
  const double begin = record.progress;
  options.cancelled = [&record, begin, drawn = 0]() mutable {
    record.progress = begin + (1.0 - begin) * std::min(1.0, static_cast<double>(drawn++) / kDraws);
    return record.cancel.load();
  };
  const auto prediction = accuracy::Predict(machine, planned.samples, planned.plan.compensated, options);
  return prediction.reason == accuracy::PredictionReason::kPredicted ? prediction.predicted_95_mm : 0.0;
}

}  // namespace

PlanDesk::PlanDesk(Metrics& metrics)
    : plans_done_(metrics.AddCounter("lambdajet_plans_total", "Plans made.", {{"outcome", "done"}})),
      plans_failed_(metrics.AddCounter("lambdajet_plans_total", "Plans made.", {{"outcome", "refused"}})),
      planning_time_(metrics.AddHistogram("lambdajet_planning_seconds", "Time to plan a program.",
                                          {0.01, 0.03, 0.1, 0.3, 1, 3, 10, 30, 100})),
      pool_(kPlanThreads, kMostPlansWaiting) {}

// Called with the mutex held.
std::shared_ptr<PlanRecord> PlanDesk::NewRecord(std::uint64_t id, PlanOptions options,
                                                std::shared_ptr<const MachineDescription> machine) {
  auto record = std::make_shared<PlanRecord>();
  record->id = id;
  record->number = ++numbers_;
  record->machine = std::move(machine);
  record->options = std::move(options);
  return record;
}

// Called with the mutex held.
void PlanDesk::Replace(std::shared_ptr<PlanRecord> record) {
  std::erase_if(records_, [&record](const auto& r) { return r->id == record->id; });
  records_.push_back(std::move(record));
  GiveUpOldest();
}

absl::StatusOr<std::shared_ptr<const PlanRecord>> PlanDesk::Begin(
    MadeProgram program, PlanOptions options, std::shared_ptr<const MachineDescription> machine) {
  options.notation = program.notation;
  const std::uint64_t id = PlanIdOf(program.text, options, *machine);
  const std::lock_guard lock(mutex_);
  if (!program.faults.empty()) {
    const auto refused = NewRecord(id, std::move(options), std::move(machine));
    auto planned = std::make_shared<PlannedProgram>();
    planned->faults = std::move(program.faults);
    refused->planned = std::move(planned);
    refused->progress = 1.0;
    refused->state = PlanState::kFailed;
    Replace(refused);
    plans_failed_.Increment();
    return std::shared_ptr<const PlanRecord>(refused);
  }
  if (auto there = There(id)) {
    return there;
  }
  const auto record = NewRecord(id, std::move(options), std::move(machine));
  record->program = std::move(program.text);
  if (const absl::Status queued = pool_.Submit([this, record] { Work(record); }); !queued.ok()) {
    return queued;
  }
  Replace(record);
  return std::shared_ptr<const PlanRecord>(record);
}

// Called with the mutex held.
std::shared_ptr<const PlanRecord> PlanDesk::There(std::uint64_t id) const {
  const auto there =
      std::find_if(records_.begin(), records_.end(), [id](const auto& r) { return r->id == id; });
  const bool usable =
      there != records_.end() && (*there)->state != PlanState::kCancelled && !(*there)->cancel;
  return usable ? *there : nullptr;
}

void PlanDesk::Work(const std::shared_ptr<PlanRecord>& record) {
  const auto begin = std::chrono::steady_clock::now();
  auto planned = std::make_shared<PlannedProgram>();
  if (!record->cancel) {
    TolerancePlan answer =
        PlanToTolerance(record->program, *record->machine, record->options,
                        [&record, share = PlanningShare(record->options)](double progress) {
                          record->progress = share * progress;
                          return !record->cancel;
                        });
    *planned = std::move(answer.planned);
    record->tolerance = std::move(answer.report);
  }
  if (planned->faults.empty() && !record->cancel) {
    record->predicted_95_mm = PredictedBound(*record->machine, *planned, *record);
  }
  Settle(record, std::move(planned), begin);
}

void PlanDesk::Settle(const std::shared_ptr<PlanRecord>& record,
                      std::shared_ptr<const PlannedProgram> planned,
                      std::chrono::steady_clock::time_point begin) {
  const bool done = planned->faults.empty();
  std::string program = std::exchange(record->program, {});
  if (done) {
    record->kept = KeptText(std::move(program), kMostKeptBytes);
  }
  record->planned = std::move(planned);
  record->progress = 1.0;
  {
    const std::lock_guard lock(mutex_);
    record->state = record->cancel ? PlanState::kCancelled : done ? PlanState::kDone : PlanState::kFailed;
    GiveUpOldest();
  }
  ended_.notify_all();
  (done ? plans_done_ : plans_failed_).Increment();
  planning_time_.Observe(std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
}

// Called with the mutex held. Those that wait or are planned do not count: a burst of them must not push out what is done.
void PlanDesk::GiveUpOldest() {
  const auto ended = [this](const auto& r) { return r->state != PlanState::kRunning && r->id != kept_; };
  for (auto count = std::count_if(records_.begin(), records_.end(), ended);
       count > static_cast<std::ptrdiff_t>(kMostPlans); --count) {
    records_.erase(std::find_if(records_.begin(), records_.end(), ended));
  }
}

std::shared_ptr<const PlanRecord> PlanDesk::Find(std::uint64_t id) const {
  const std::lock_guard lock(mutex_);
  const auto there =
      std::find_if(records_.begin(), records_.end(), [id](const auto& r) { return r->id == id; });
  return there == records_.end() ? nullptr : *there;
}

std::shared_ptr<const PlanRecord> PlanDesk::Cancel(std::uint64_t id) {
  const std::lock_guard lock(mutex_);
  for (const auto& record : records_) {
    if (record->id == id) {
      record->cancel = record->state == PlanState::kRunning;
      return record;
    }
  }
  return nullptr;
}

bool PlanDesk::Await(const PlanRecord& record, double most_s) const {
  std::unique_lock lock(mutex_);
  return ended_.wait_for(lock, std::chrono::duration<double>(most_s),
                         [&record] { return record.state != PlanState::kRunning; });
}

std::vector<std::shared_ptr<const PlanRecord>> PlanDesk::List() const {
  const std::lock_guard lock(mutex_);
  return {records_.rbegin(), records_.rend()};
}

void PlanDesk::KeepFor(std::uint64_t id) {
  const std::lock_guard lock(mutex_);
  kept_ = id;
}

void PlanDesk::CancelAll() {
  const std::lock_guard lock(mutex_);
  for (const auto& record : records_) {
    record->cancel = true;
  }
}

}  // namespace lambdajet::trajectory
