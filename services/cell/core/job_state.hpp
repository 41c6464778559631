// Says which state a job goes to when something happens to it.
//
// Model: one table (state, happening) -> state, drawn in services/cell/README.md. What the table does not
// name cannot happen: a client's wish is refused, news from the machine is ignored. Threads: pure. Cost: one
// look-up.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "cell/core/job.hpp"

namespace lambdajet::cell {

enum class Happening : std::uint32_t {
  kAdmitted,     // program planned
  kRefused,      // program cannot be cut
  kStartAsked,   // by a client, also as a resume after an interruption
  kStartFailed,  // before anything moved
  kMoves,        // the drive plays the plan
  kStands,       // feed hold, starvation, a stop gate
  kInterrupted,  // a module or service lost, a stop latched
  kCompleted,
  kCancelled,
  kFailed,
  kNoted  // nothing but the reason, message or place changed
};
inline constexpr std::uint32_t kHappeningCount = 11;

std::string_view Name(Happening happening);

std::optional<JobState> Next(JobState state, Happening happening);

}  // namespace lambdajet::cell
