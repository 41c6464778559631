#include "trajectory/core/feed/moving_time.hpp"

#include <algorithm>
#include <cstdio>

namespace lambdajet::trajectory {

void MovingTime::Move(double time_s, std::uint32_t line) {
  line_ = time_s > longest_s_ ? line : line_;
  longest_s_ = std::max(longest_s_, time_s);
  run_s_ += time_s;
  longest_run_s_ = std::max(longest_run_s_, run_s_);
  whole_s_ += time_s;
}

std::optional<ProgramFault> MovingTime::TooLong() const {
  if (whole_s_ <= kLongestProgram_s && longest_run_s_ <= kLongestRun_s) {
    return std::nullopt;
  }
  char text[200];
  std::snprintf(text, sizeof text,
                "at its feeds the program moves for %.3g s, this line alone for %.3g s; right is at most "
                "%.0f s, %.0f s without a standstill",
                whole_s_, longest_s_, kLongestProgram_s, kLongestRun_s);
  return ProgramFault{line_, 0, "PLAN_TOO_LONG", "", text};
}

ProgramFault RunTooLong(std::uint32_t line, double run_s) {
  char text[160];
  std::snprintf(text, sizeof text,
                "what stands behind the last standstill moves for %.3g s; right is at most %.0f s", run_s,
                kLongestRun_s);
  return {line, 0, "PLAN_TOO_LONG", "", text};
}

}  // namespace lambdajet::trajectory
