// Counts the cycles of a control loop that began late, and says when there were too many of late.
//
// Model: a cycle is late when it begins more than half a period after its time; the late ones of the newest `window` cycles are
// compared with what is allowed. Units: ns of common time. Threads: one, the loop. Cost: no allocation after construction.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace lambdajet {

class LoopWatch {
 public:
  LoopWatch(std::int64_t period_ns, std::uint32_t window, int allowed)
      : period_ns_(period_ns), allowed_(allowed), late_cycles_(window, 0) {}

  // Once a cycle, with its beginning; true while more cycles were late than allowed.
  bool Turn(std::int64_t now_ns) {
    const bool late = last_ns_ != 0 && now_ns - last_ns_ > period_ns_ + period_ns_ / 2;
    last_ns_ = now_ns;
    overruns_ += late ? 1 : 0;
    late_count_ += late ? 1 : 0;
    late_count_ -= late_cycles_[at_];
    late_cycles_[at_] = late ? 1 : 0;
    at_ = (at_ + 1) % late_cycles_.size();
    return late_count_ > allowed_;
  }

  std::uint32_t overruns() const { return overruns_; }  // since the start

 private:
  std::int64_t period_ns_;
  int allowed_;
  std::int64_t last_ns_ = 0;
  std::uint32_t overruns_ = 0;
  std::vector<std::uint8_t> late_cycles_;
  std::size_t at_ = 0;
  int late_count_ = 0;
};

}  // namespace lambdajet
