#include "platform/process/periodic_loop.hpp"

#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>

#include <cerrno>
#include <cstring>
#include <ctime>

#include "platform/process/common_clock.hpp"

namespace lambdajet {
namespace {

void Refuse(RealTimeGrant& grant, const char* what, int error) {
  if (!grant.refused.empty()) {
    grant.refused += "; ";
  }
  grant.refused += std::string(what) + ": " + std::strerror(error);
}

}  // namespace

RealTimeGrant PeriodicLoop::EnterRealTime() const {
  RealTimeGrant grant;
  if (options_.lock_memory) {
    grant.memory_locked = mlockall(MCL_CURRENT | MCL_FUTURE) == 0;
    if (!grant.memory_locked) {
      Refuse(grant, "memory is not locked (mlockall)", errno);
    }
  }
  if (options_.fifo_priority > 0) {
    sched_param parameter{};
    parameter.sched_priority = options_.fifo_priority;
    const int error = pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameter);
    grant.fifo = error == 0;
    if (error != 0) {
      Refuse(grant, "no real-time priority (SCHED_FIFO)", error);
    }
  }
  if (options_.cpu >= 0) {
    cpu_set_t cpus;
    CPU_ZERO(&cpus);
    CPU_SET(static_cast<std::size_t>(options_.cpu), &cpus);
    const int error = pthread_setaffinity_np(pthread_self(), sizeof cpus, &cpus);
    grant.pinned = error == 0;
    if (error != 0) {
      Refuse(grant, "not pinned to its CPU", error);
    }
  }
  return grant;
}

CycleTime PeriodicLoop::Begin() const {
  const std::int64_t now = MonotonicNow();
  // On whole multiples of the period, so that two nodes of one host share a grid.
  return {0, (now / options_.period_ns + 1) * options_.period_ns, 0};
}

void PeriodicLoop::SleepUntilTick(CycleTime& time) {
  const timespec until{.tv_sec = time.tick_ns / 1'000'000'000, .tv_nsec = time.tick_ns % 1'000'000'000};
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr) == EINTR) {
  }
  time.woke_ns = MonotonicNow();
  const std::int64_t late = time.woke_ns - time.tick_ns;
  if (late > worst_wake_ns_.load(std::memory_order_relaxed)) {
    worst_wake_ns_.store(late, std::memory_order_relaxed);
  }
}

void PeriodicLoop::Advance(CycleTime& time) {
  cycles_.fetch_add(1, std::memory_order_relaxed);
  time.number += 1;
  time.tick_ns += options_.period_ns;
  const std::int64_t late = MonotonicNow() - time.tick_ns;
  if (late <= 0) {
    return;
  }
  overruns_.fetch_add(1, std::memory_order_relaxed);
  const std::int64_t missed = late / options_.period_ns;
  skipped_.fetch_add(static_cast<std::uint64_t>(missed), std::memory_order_relaxed);
  time.number += static_cast<std::uint64_t>(missed);
  time.tick_ns += missed * options_.period_ns;
}

}  // namespace lambdajet
