// Sends a plan to the two modules as their states ask for it.
//
// Model: trajectory/segment to the drive, trajectory/process_event to main motion, paced by core/streaming from drive/state
// and main_motion/state; a full history of the bus is tried again at the next turn. A module that has the plan but no part of
// it, as after this process was restarted, gets it from its wish on. The drive reads the gates too but does not say which it
// has: it gets all of them whenever it has newly taken the plan, and events wait until it has.
// Threads: a loop of its own at 200 Hz until destroyed; Start(), Stop() and the questions from any. Errors: those of platform/bus.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>

#include "absl/status/statusor.h"
#include "foundation/motion/plan.hpp"

namespace lambdajet {
class Clock;
class Metrics;
class Participant;
}  // namespace lambdajet

namespace lambdajet::trajectory {

class PlanStreamer {
 public:
  // All outlive the streamer.
  static absl::StatusOr<std::unique_ptr<PlanStreamer>> Open(Participant& bus, const Clock& clock,
                                                            Metrics& metrics);
  ~PlanStreamer();  // joins the loop

  void Start(std::shared_ptr<const Plan> plan);  // the same plan again goes on as it was
  std::uint64_t Stop(std::uint64_t plan_id);     // 0 whatever is streamed; answers what was
  std::uint64_t streaming() const;               // 0 none

 private:
  struct Link;
  PlanStreamer();
  void Run();
  void Turn();
  void SendSegments(std::int64_t now_ns);
  void SendProcess(std::int64_t now_ns);
  void SendGatesToDrive(std::uint64_t drive_session);

  std::atomic<bool> stop_ = false;
  mutable std::mutex mutex_;
  std::shared_ptr<const Plan> wanted_;
  std::unique_ptr<Link> link_;
};

}  // namespace lambdajet::trajectory
