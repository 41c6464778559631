// Adds up how long a program moves at its own feeds, and refuses what would take too long to be laid out.
//
// Model: plans are laid out in time, some hundreds of bytes a millisecond while a run is planned, so that a feed in the wrong
// unit would fill any memory. Units: s. Threads: none of its own. Errors: PLAN_TOO_LONG with the line that takes longest.
#pragma once

#include <cstdint>
#include <optional>

#include "trajectory/core/part_program/operation.hpp"

namespace lambdajet::trajectory {

inline constexpr double kLongestRun_s = 7200.0;  // without a standstill
inline constexpr double kLongestProgram_s = 21600.0;

class MovingTime {
 public:
  void Move(double time_s, std::uint32_t line);
  void StandStill() { run_s_ = 0.0; }

  std::optional<ProgramFault> TooLong() const;

 private:
  double run_s_ = 0.0, longest_run_s_ = 0.0, whole_s_ = 0.0;
  double longest_s_ = 0.0;
  std::uint32_t line_ = 0;
};

// Of a run whose limits, not its feeds, make it too long.
ProgramFault RunTooLong(std::uint32_t line, double run_s);

}  // namespace lambdajet::trajectory
