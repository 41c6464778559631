#include "tests/load/open_loop.hpp"

#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <thread>

#include "foundation/contract/trouble.hpp"

namespace lambdajet::load {
namespace {

using Steady = std::chrono::steady_clock;
constexpr auto kLastAnswers = std::chrono::seconds(15);

// Lives until the last answer, also if the run has given up waiting for it.
struct Tally {
  std::mutex mutex;
  std::condition_variable changed;
  int outstanding = 0;
  Measured measured;
};

std::int64_t Nanoseconds(Steady::duration time) {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(time).count();
}

std::string ReasonOf(const absl::Status& status) {
  const std::string reason = TroubleReason(status);
  return reason.empty() ? absl::StatusCodeToString(status.code()) : reason;
}

void Send(const std::shared_ptr<Tally>& tally, const Question& question, std::uint64_t n,
          Steady::time_point due) {
  question(n, [tally, due](const absl::Status& status) {
    const std::int64_t latency_ns = Nanoseconds(Steady::now() - due);
    const std::lock_guard lock(tally->mutex);
    --tally->outstanding;
    if (status.ok()) {
      tally->measured.latency.Record(latency_ns);
    } else {
      ++tally->measured.errors[ReasonOf(status)];
    }
    tally->changed.notify_all();
  });
}

}  // namespace

std::uint64_t Measured::error_count() const {
  std::uint64_t count = 0;
  for (const auto& [reason, number] : errors) {
    count += number;
  }
  return count;
}

Measured RunOpenLoop(const std::string& what, const Pace& pace, const Question& question) {
  const auto tally = std::make_shared<Tally>();
  tally->measured.what = what;
  tally->measured.rate_per_s = pace.rate_per_s;
  tally->measured.duration_s = pace.duration_s;
  const auto start = Steady::now() + std::chrono::milliseconds(50);
  const auto questions = static_cast<std::uint64_t>(pace.rate_per_s * pace.duration_s);
  for (std::uint64_t n = 0; n < questions; ++n) {
    const auto due = start + std::chrono::nanoseconds(
                                 static_cast<std::int64_t>(1e9 * static_cast<double>(n) / pace.rate_per_s));
    const bool early = Steady::now() < due;
    std::this_thread::sleep_until(due);
    std::unique_lock lock(tally->mutex);
    if (early) {
      tally->measured.timer.Record(Nanoseconds(Steady::now() - due));
    }
    if (tally->outstanding >= pace.most_outstanding) {
      ++tally->measured.errors["TOO_MANY_OUTSTANDING"];
      continue;
    }
    ++tally->outstanding;
    lock.unlock();
    Send(tally, question, n, due);
  }
  std::unique_lock lock(tally->mutex);
  tally->changed.wait_for(lock, kLastAnswers, [&] { return tally->outstanding == 0; });
  if (tally->outstanding > 0) {
    tally->measured.errors["NEVER_ANSWERED"] += static_cast<std::uint64_t>(tally->outstanding);
  }
  return tally->measured;
}

}  // namespace lambdajet::load
