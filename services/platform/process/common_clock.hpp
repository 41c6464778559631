// Tells the time that all nodes of one machine share, in nanoseconds since 1970, without ever stepping.
//
// Model: common time = CLOCK_MONOTONIC + offset, the offset to CLOCK_REALTIME being taken at start. NTP or
// PTP discipline both clocks' rate in the kernel; what remains is a jump of CLOCK_REALTIME. A jump up to
// `step_threshold_ns` is followed at `slew_ppm` of elapsed time; a larger one is a step: it is reported,
// never followed. Units: ns. Threads: now_ns() from any, lock-free; Follow() from one thread, about once a
// second. Cost: now_ns() is one vDSO clock read.
#pragma once

#include <atomic>
#include <cstdint>

namespace lambdajet {

// What the doors of a house ask for the time; tests give them their own.
class Clock {
 public:
  virtual ~Clock() = default;
  virtual std::int64_t now_ns() const = 0;
};

struct ClockOptions {
  std::int64_t step_threshold_ns = 1'000'000;
  double slew_ppm = 50.0;
};

// What Follow() found.
struct ClockCorrection {
  std::int64_t difference_ns = 0;  // CLOCK_REALTIME - common time, before anything was followed
  std::int64_t followed_ns = 0;    // added to the offset now
  bool step = false;               // the difference is beyond the threshold and was not followed
};

// The kernel's own belief about its clock (ntp_adjtime).
struct KernelClockError {
  std::int64_t bound_ns = 0;     // maxerror
  std::int64_t estimate_ns = 0;  // esterror
  bool synchronised = false;
};

class CommonClock final : public Clock {
 public:
  explicit CommonClock(const ClockOptions& options = {});
  std::int64_t now_ns() const override;
  ClockCorrection Follow();

  // The arithmetic of Follow(), for tests: clock readings come from the caller.
  ClockCorrection Follow(std::int64_t monotonic_ns, std::int64_t realtime_ns);

  // Common time of a CLOCK_MONOTONIC reading, and back: a loop's absolute grid is monotonic.
  std::int64_t FromMonotonic(std::int64_t monotonic_ns) const;
  std::int64_t ToMonotonic(std::int64_t common_ns) const;

 private:
  ClockOptions options_;
  std::atomic<std::int64_t> offset_ns_;
  std::int64_t last_follow_ns_;
};

std::int64_t MonotonicNow();  // ns
KernelClockError ReadKernelClockError();

}  // namespace lambdajet
