// Waits in a test for a condition, with a deadline and without a fixed sleep.
#pragma once

#include <chrono>
#include <thread>

namespace lambdajet::test {

inline constexpr std::chrono::seconds kPatience{
    20};  // far above what anything takes; reached only on failure

template <typename Condition>
bool Eventually(Condition&& condition, std::chrono::milliseconds patience = kPatience) {
  const auto deadline = std::chrono::steady_clock::now() + patience;
  while (!condition()) {
    if (std::chrono::steady_clock::now() > deadline) {
      return false;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return true;
}

// True if the condition stays true for all of that time.
template <typename Condition>
bool Throughout(std::chrono::milliseconds time, Condition&& condition) {
  return !Eventually([&] { return !condition(); }, time);
}

}  // namespace lambdajet::test
