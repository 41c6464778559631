// Says how a run of `lambdajet` ended, for scripts; the same numbers stand in --help.
// Threads: constants.
#pragma once

#include "absl/status/status.h"

namespace lambdajet::cli {

enum class ExitCode : int {
  kOk = 0,
  kFailure = 1,      // the work was done and the answer is no, or it broke
  kUsage = 2,        // the command line or a file given to it is wrong
  kUnreachable = 3,  // a service does not answer
  kRefused = 4,      // the service or the calculation refuses these values
  kTimeout = 5,      // --timeout passed
  kPrecondition = 6  // right in itself, but not in the present state
};

inline constexpr char kExitCodesHelp[] =
    "Exit codes: 0 done, 1 failed, 2 wrong command line or file, 3 service unreachable, 4 refused, 5 timed "
    "out, "
    "6 not in this state.";

ExitCode ExitCodeOf(const absl::Status& status);

}  // namespace lambdajet::cli
