#include "cell/rpc/watch_hub.hpp"

#include <chrono>
#include <deque>
#include <optional>
#include <utility>

#include "cell/rpc/wire.hpp"
#include "foundation/contract/trouble.hpp"
#include "platform/rpc/streams.hpp"

namespace lambdajet::cell {
namespace {
using SteadyTime = std::chrono::steady_clock::time_point;
constexpr auto kLook = std::chrono::milliseconds(50);
constexpr int kRecordsAtOnce = 32;
}  // namespace

class WatchHub::Watcher final : public grpc::ServerWriteReactor<v1::JobEvent>,
                                public std::enable_shared_from_this<Watcher> {
 public:
  Watcher(JobDesk& desk, std::uint64_t token, std::string job_id, double period_s)
      : desk_(desk),
        token_(token),
        job_id_(std::move(job_id)),
        period_(std::chrono::microseconds(static_cast<std::int64_t>(period_s * 1e6))) {}

  void Hold() { held_ = shared_from_this(); }

  // Writes what there is to hear, if the last message has gone out.
  void Look(SteadyTime now, std::uint64_t newest) {
    const std::lock_guard lock(mutex_);
    if (!writing_ && !over_) {
      WriteNext(now, newest);
    }
  }

  void End(const absl::Status& status) {
    const std::lock_guard lock(mutex_);
    over_ = true;
    if (!finished_ && !writing_) {
      finished_ = true;
      Finish(lambdajet::ToWire(status));
    }
    end_ = status;
  }

  bool done() const {
    const std::lock_guard lock(mutex_);
    return finished_;
  }

  void OnWriteDone(bool ok) override {
    const std::lock_guard lock(mutex_);
    writing_ = false;
    if ((!ok || over_) && !finished_) {
      over_ = finished_ = true;
      Finish(lambdajet::ToWire(end_));
    } else if (!finished_) {
      WriteNext(std::chrono::steady_clock::now(), desk_.last_token());
    }
  }
  void OnCancel() override { End(absl::CancelledError("the client has gone")); }
  void OnDone() override {
    std::shared_ptr<Watcher> last;  // outlives the lock
    const std::lock_guard lock(mutex_);
    last = std::move(held_);
  }

 private:
  void WriteNext(SteadyTime now, std::uint64_t newest) {
    if (waiting_.empty() && newest > token_) {
      const auto records = desk_.Since(token_, job_id_, kRecordsAtOnce);
      if (records.ok()) {
        waiting_.assign(records->begin(), records->end());
        token_ = records->empty() ? newest : token_;
      }
    }
    if (!waiting_.empty()) {
      message_ = ToWire(waiting_.front());
      token_ = waiting_.front().token;
      waiting_.pop_front();
    } else if (!MakeProgress(now)) {
      return;
    }
    next_progress_ = now + period_;
    writing_ = true;
    StartWrite(&message_);
  }

  bool MakeProgress(SteadyTime now) {
    if (now < next_progress_) {
      return false;
    }
    const std::string active = desk_.Machine().job_id;
    if (active.empty() || (!job_id_.empty() && active != job_id_)) {
      return false;
    }
    const auto job = desk_.Find(active);
    if (!job.ok()) {
      return false;
    }
    message_.Clear();
    *message_.mutable_job() = ToWire(*job);
    return true;
  }

  JobDesk& desk_;
  mutable std::mutex mutex_;
  std::uint64_t token_;
  const std::string job_id_;
  const std::chrono::microseconds period_;
  SteadyTime next_progress_{};
  std::deque<JournalRecord> waiting_;
  v1::JobEvent message_;
  bool writing_ = false;
  bool over_ = false;
  bool finished_ = false;
  absl::Status end_;
  std::shared_ptr<Watcher> held_;
};

WatchHub::WatchHub(JobDesk& desk) : desk_(desk), thread_([this] { Work(); }) {}

WatchHub::~WatchHub() { Close(); }

void WatchHub::Close() {
  {
    const std::lock_guard lock(mutex_);
    closed_ = true;
    wake_.notify_all();
  }
  if (thread_.joinable()) {
    thread_.join();
  }
}

grpc::ServerWriteReactor<v1::JobEvent>* WatchHub::Open(std::uint64_t token, const std::string& job_id,
                                                       double period_s, const absl::Status& refusal) {
  const std::lock_guard lock(mutex_);
  if (!refusal.ok() || closed_ || watchers_.size() >= kMostWatchers) {
    return RefuseStream<v1::JobEvent>(
        !refusal.ok()
            ? refusal
            : Trouble(absl::StatusCode::kResourceExhausted, "TOO_MANY_WATCHERS",
                      std::to_string(watchers_.size()) + " clients watch already; try again later"));
  }
  const std::uint64_t from = token == 0 ? desk_.last_token() : token;
  auto watcher = std::make_shared<Watcher>(desk_, from, job_id, period_s);
  watcher->Hold();
  watchers_.push_back(watcher);
  return watcher.get();
}

void WatchHub::Work() {
  std::unique_lock lock(mutex_);
  while (!closed_) {
    wake_.wait_for(lock, kLook, [&] { return closed_; });
    watchers_.remove_if([](const auto& watcher) { return watcher->done(); });
    const auto watchers = watchers_;
    lock.unlock();
    const std::uint64_t newest = desk_.last_token();
    for (const auto& watcher : watchers) {
      watcher->Look(std::chrono::steady_clock::now(), newest);
    }
    lock.lock();
  }
  for (const auto& watcher : watchers_) {
    watcher->End(absl::OkStatus());
  }
  watchers_.clear();
}

}  // namespace lambdajet::cell
