// Does for a module node what its cyclic loop has no time for: clock exchange, events and log, the machine description.
//
// Model: one thread beside the loop. The loop hands over changes of mode and asks for the newest description; both ways
// are queues that the loop never waits for. Threads: the members named below from the loop, the rest from main.
// Errors: those of platform/bus.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "foundation/machine/machine_description.hpp"
#include "foundation/motion/link_samples.hpp"

namespace lambdajet {
class Clock;
class Log;
class Participant;
}  // namespace lambdajet

namespace lambdajet::link {

class ModuleDesk {
 public:
  // `sender` as in ClockExchange. Events go out on drive/event or main_motion/event accordingly.
  static absl::StatusOr<std::unique_ptr<ModuleDesk>> Open(Participant& bus, const Clock& clock, Log& log,
                                                          std::uint32_t sender, std::uint64_t session);
  ~ModuleDesk();

  // From the loop.
  void Tell(const ModeChange& change);
  const MachineDescription* TakeDescription();  // a new one since the last call, valid until the next call
  LinkFigures figures() const;

 private:
  class Inside;
  ModuleDesk();
  std::unique_ptr<Inside> inside_;
};

// A session number that no other start of a process has.
std::uint64_t NewSession(const Clock& clock);

// Puts the calling thread, and all that it starts from now on, ahead of every process that is no module: news of the peer
// must not wait for a compiler or a report. Where the host refuses, nothing changes. Call it first in main.
void EnterModulePriority();

}  // namespace lambdajet::link
