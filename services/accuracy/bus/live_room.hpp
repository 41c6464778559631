// Publishes accuracy/live at 50 Hz: what is expected of the cut at this moment.
//
// Model: the newest drive/state through core/live_error.hpp with the active machine; whether the plan is compensated is
// what the cell's LOAD of that plan said; the event deviation is the last main_motion/process_record's. Nothing is written
// while there is no machine, no fresh drive state (100 ms), or the mechanism cannot be solved.
// Threads: a loop of its own until destroyed. Errors: those of platform/bus.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>

#include "absl/status/statusor.h"
#include "accuracy/bus/machine_reader.hpp"

namespace lambdajet {
class Clock;
class Participant;
}  // namespace lambdajet

namespace lambdajet::accuracy {

class LiveRoom {
 public:
  // All outlive the room.
  static absl::StatusOr<std::unique_ptr<LiveRoom>> Open(Participant& bus, const MachineReader& machines,
                                                        const Clock& clock);
  ~LiveRoom();  // joins the loop

  std::uint64_t written() const { return written_.load(std::memory_order_relaxed); }

 private:
  struct Link;
  LiveRoom();
  void Run();
  void WriteOne();

  std::atomic<bool> stop_ = false;
  std::atomic<std::uint64_t> written_ = 0;
  std::unique_ptr<Link> link_;
};

}  // namespace lambdajet::accuracy
