// Turns SIGINT and SIGTERM into a value that main waits for.
//
// Model: the signals are blocked before the first thread starts, so every thread inherits the mask and only
// main, in sigtimedwait, sees them; no code runs in a signal handler. SIGPIPE is ignored: a gone reader is a
// Status. Validity: make it first in main; a thread that is already running keeps its own mask. Threads:
// construct and wait in main; Request() from any.
#pragma once

#include <chrono>
#include <optional>

namespace lambdajet {

class StopSignal {
 public:
  StopSignal();
  StopSignal(const StopSignal&) = delete;
  StopSignal& operator=(const StopSignal&) = delete;

  // The signal's number, or nothing when the time has passed without one.
  std::optional<int> WaitFor(std::chrono::milliseconds time) const;

  // Stops this process as SIGTERM would.
  static void Request();
};

}  // namespace lambdajet
