#include "trajectory/rpc/plan_watch.hpp"

#include "foundation/contract/trouble.hpp"

namespace lambdajet::trajectory {
namespace {

constexpr auto kLook = std::chrono::milliseconds(10);
constexpr auto kIdle = std::chrono::milliseconds(1000);
constexpr std::size_t kMostUpdatesWaiting = 16;

}  // namespace

PlanWatch::PlanWatch() : thread_([this] { Work(); }) {}

PlanWatch::~PlanWatch() {
  {
    const std::lock_guard lock(mutex_);
    closed_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

grpc::ServerWriteReactor<v1::GetPlanResponse>* PlanWatch::Open(std::shared_ptr<const PlanRecord> record,
                                                               double period_s) {
  const std::lock_guard lock(mutex_);
  if (watchers_.size() >= kMostWatchers) {
    return RefuseStream<v1::GetPlanResponse>(
        Trouble(absl::StatusCode::kResourceExhausted, "TOO_MANY_WATCHERS",
                std::to_string(watchers_.size()) + " clients watch already; try again later"));
  }
  auto stream = PushStream<v1::GetPlanResponse>::New(kMostUpdatesWaiting);
  auto* reactor = stream->Begin();
  Watcher watcher{std::move(stream), std::move(record), std::chrono::duration<double>(period_s), {}};
  if (Tell(watcher, std::chrono::steady_clock::now())) {
    watchers_.push_back(std::move(watcher));
    changed_.notify_all();
  }
  return reactor;
}

bool PlanWatch::Tell(Watcher& watcher, SteadyTime now) {
  if (watcher.stream->over()) {
    return false;
  }
  const bool ended = watcher.record->state != PlanState::kRunning;
  const double progress = watcher.record->progress;
  if (!ended && (now < watcher.next || progress == watcher.told_progress)) {
    return true;
  }
  v1::GetPlanResponse message;
  ToWire(*watcher.record, message);
  watcher.told_progress = progress;
  watcher.next = now + std::chrono::duration_cast<std::chrono::steady_clock::duration>(watcher.period);
  watcher.stream->Push(std::move(message));
  if (ended) {
    watcher.stream->Finish(absl::OkStatus());
  }
  return !ended;
}

void PlanWatch::Work() {
  std::unique_lock lock(mutex_);
  while (!closed_) {
    const bool idle = watchers_.empty();
    changed_.wait_for(lock, idle ? kIdle : kLook, [&] { return closed_ || (idle && !watchers_.empty()); });
    const auto now = std::chrono::steady_clock::now();
    watchers_.remove_if([now](Watcher& watcher) { return !Tell(watcher, now); });
  }
  for (const Watcher& watcher : watchers_) {
    watcher.stream->Finish(
        Trouble(absl::StatusCode::kUnavailable, "CLOSING", "trajectory ends; ask again when it serves"));
  }
}

}  // namespace lambdajet::trajectory
