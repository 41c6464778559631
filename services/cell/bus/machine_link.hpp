// Is the modules' door of the cell: reads their states and records, writes commands and job events.
//
// Model: listeners only hand samples over; one loop, 50 times a second, gives them to the desk, lets it step, and writes what
// comes out. Commands are reliable and acknowledged by state.
// Units: as the IDL. Threads: Open() at start; a loop of its own until it is destroyed.
// Errors: those of platform/bus.
#pragma once

#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "cell/desk/job_desk.hpp"

namespace lambdajet {
class Participant;
class CommonClock;
}  // namespace lambdajet

namespace lambdajet::cell {

class MachineLink {
 public:
  static absl::StatusOr<std::unique_ptr<MachineLink>> Open(Participant& bus, JobDesk& desk,
                                                           const CommonClock& clock, std::uint64_t session,
                                                           const std::string& machine_id);
  ~MachineLink();

 private:
  class Inside;
  explicit MachineLink(std::unique_ptr<Inside> inside);
  std::unique_ptr<Inside> inside_;
};

}  // namespace lambdajet::cell
