// Says when a peer has fallen silent, and does not mistake a pause of the whole host for it.
//
// Model: the peer is lost when its newest sample is older than the deadline *and* the watcher's own loop has turned for
// half a deadline's worth of cycles since that sample was half a deadline old. In plain silence the two come true
// together, at the deadline. If both ends stand still together (a paused virtual machine), the loop has turned once when
// it wakes, and the peer gets the time it needs to speak. Age counts from when a sample was made, so news that always
// comes later than the deadline is no news.
// Units: ns of common time. Threads: one.
#pragma once

#include <cstdint>

namespace lambdajet {

class SilenceWatch {
 public:
  explicit SilenceWatch(std::int64_t period_ns) : period_ns_(period_ns) {}

  void Heard(std::int64_t made_ns) {
    if (!heard_ || made_ns > newest_ns_) {
      newest_ns_ = made_ns;
      heard_ = true;
    }
  }

  // Once a cycle of the watcher's loop; true while the peer is lost.
  bool Turn(std::int64_t now_ns, std::int64_t deadline_ns) {
    if (!heard_) {
      return true;
    }
    if (2 * age_ns(now_ns) <= deadline_ns) {
      stale_cycles_ = 0;
      return false;
    }
    ++stale_cycles_;
    return age_ns(now_ns) > deadline_ns && 2 * stale_cycles_ * period_ns_ >= deadline_ns;
  }

  bool heard() const { return heard_; }
  std::int64_t age_ns(std::int64_t now_ns) const { return now_ns - newest_ns_; }

 private:
  std::int64_t period_ns_;
  std::int64_t newest_ns_ = 0;
  std::int64_t stale_cycles_ = 0;
  bool heard_ = false;
};

}  // namespace lambdajet
