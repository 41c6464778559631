// Runs one cycle at every tick of an absolute time grid, until told to stop.
//
// Model: clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME) on start + n * period. A cycle that ends after the
// next tick is an overrun: it is counted, and the grid's missed ticks are skipped, so the loop never runs
// cycles in a burst. SCHED_FIFO and mlockall are taken where the host permits; RealTimeGrant says which were
// refused and why. Units: ns. Threads: Run() blocks the thread it is called on; the counters may be read from
// any. Cost: no allocation per cycle.
#pragma once

#include <atomic>
#include <cstdint>
#include <string>

namespace lambdajet {

struct PeriodicLoopOptions {
  std::int64_t period_ns = 1'000'000;
  int fifo_priority = 0;     // 1 to 99; 0 leaves the scheduler alone
  int cpu = -1;              // pin to this CPU; -1 leaves the affinity alone
  bool lock_memory = false;  // mlockall(MCL_CURRENT | MCL_FUTURE)
};

// What the host gave of what was asked; `refused` is empty if it gave all of it.
struct RealTimeGrant {
  bool fifo = false;
  bool pinned = false;
  bool memory_locked = false;
  std::string refused;  // in words, for the log
};

// What a cycle is told about its time.
struct CycleTime {
  std::uint64_t number = 0;  // ticks of the grid since start, skipped ones included
  std::int64_t tick_ns = 0;  // CLOCK_MONOTONIC, where the grid says the cycle begins
  std::int64_t woke_ns = 0;  // CLOCK_MONOTONIC, when it began
};

class PeriodicLoop {
 public:
  explicit PeriodicLoop(const PeriodicLoopOptions& options) : options_(options) {}

  // Asks the host for scheduling and memory on the calling thread. Call it once, on the thread of Run(),
  // before it.
  RealTimeGrant EnterRealTime() const;

  // Calls cycle(const CycleTime&) until `stop` is true.
  template <typename Cycle>
  void Run(const std::atomic<bool>& stop, Cycle&& cycle) {
    CycleTime time = Begin();
    while (!stop.load(std::memory_order_acquire)) {
      SleepUntilTick(time);
      cycle(static_cast<const CycleTime&>(time));
      Advance(time);
    }
  }

  std::uint64_t cycles() const { return cycles_.load(std::memory_order_relaxed); }
  std::uint64_t overruns() const {
    return overruns_.load(std::memory_order_relaxed);
  }  // cycles that ended late
  std::uint64_t skipped_ticks() const { return skipped_.load(std::memory_order_relaxed); }
  std::int64_t worst_wake_latency_ns() const { return worst_wake_ns_.load(std::memory_order_relaxed); }

 private:
  CycleTime Begin() const;
  void SleepUntilTick(CycleTime& time);
  void Advance(CycleTime& time);

  PeriodicLoopOptions options_;
  std::atomic<std::uint64_t> cycles_ = 0;
  std::atomic<std::uint64_t> overruns_ = 0;
  std::atomic<std::uint64_t> skipped_ = 0;
  std::atomic<std::int64_t> worst_wake_ns_ = 0;
};

}  // namespace lambdajet
