#include "platform/process/common_clock.hpp"

#include <sys/timex.h>

#include <algorithm>
#include <cstdlib>
#include <ctime>

namespace lambdajet {
namespace {

std::int64_t Read(clockid_t id) {
  timespec t{};
  clock_gettime(id, &t);
  return static_cast<std::int64_t>(t.tv_sec) * 1'000'000'000 + t.tv_nsec;
}

// The offset between two clocks that cannot be read at once: the tightest of a few bracketed readings.
std::int64_t OffsetToRealtime() {
  std::int64_t best_width = INT64_MAX;
  std::int64_t offset = 0;
  for (int i = 0; i < 8; ++i) {
    const std::int64_t before = Read(CLOCK_MONOTONIC);
    const std::int64_t realtime = Read(CLOCK_REALTIME);
    const std::int64_t after = Read(CLOCK_MONOTONIC);
    if (after - before < best_width) {
      best_width = after - before;
      offset = realtime - (before + (after - before) / 2);
    }
  }
  return offset;
}

}  // namespace

std::int64_t MonotonicNow() { return Read(CLOCK_MONOTONIC); }

CommonClock::CommonClock(const ClockOptions& options)
    : options_(options), offset_ns_(OffsetToRealtime()), last_follow_ns_(MonotonicNow()) {}

std::int64_t CommonClock::now_ns() const { return FromMonotonic(MonotonicNow()); }

std::int64_t CommonClock::FromMonotonic(std::int64_t monotonic_ns) const {
  return monotonic_ns + offset_ns_.load(std::memory_order_relaxed);
}

std::int64_t CommonClock::ToMonotonic(std::int64_t common_ns) const {
  return common_ns - offset_ns_.load(std::memory_order_relaxed);
}

ClockCorrection CommonClock::Follow() {
  const std::int64_t now = MonotonicNow();
  return Follow(now, now + OffsetToRealtime());
}

ClockCorrection CommonClock::Follow(std::int64_t monotonic_ns, std::int64_t realtime_ns) {
  ClockCorrection correction;
  correction.difference_ns = realtime_ns - FromMonotonic(monotonic_ns);
  const std::int64_t elapsed = std::max<std::int64_t>(0, monotonic_ns - last_follow_ns_);
  last_follow_ns_ = monotonic_ns;
  if (std::abs(correction.difference_ns) > options_.step_threshold_ns) {
    correction.step = true;
    return correction;
  }
  const auto most = static_cast<std::int64_t>(static_cast<double>(elapsed) * options_.slew_ppm * 1e-6);
  correction.followed_ns = std::clamp(correction.difference_ns, -most, most);
  offset_ns_.fetch_add(correction.followed_ns, std::memory_order_relaxed);
  return correction;
}

KernelClockError ReadKernelClockError() {
  timex t{};
  const int state = ntp_adjtime(&t);
  return {static_cast<std::int64_t>(t.maxerror) * 1000, static_cast<std::int64_t>(t.esterror) * 1000,
          state >= 0 && state != TIME_ERROR && (t.status & STA_UNSYNC) == 0};
}

}  // namespace lambdajet
