// Publishes where the tool and the jet are: reads the drive's sliders from the bus, solves, writes kinematics/pose; and where
// the house has a hexapod, the same from kinematics/strut_readings to kinematics/spatial_pose.
//
// Model: one answer a drive sample, in the bus' own thread; samples that are old, repeated or of a session that has ended are
// counted and dropped. The machine description is taken over as it arrives; until the first one nothing is published.
// p_WJ = X_EW^-1 (p_DJ - p_DE), foundation/geometry/frames.md.
// Threads: Open() and destruction in main; the rest on the bus' threads. Cost: a few microseconds a sample.
#pragma once

#include <functional>
#include <memory>

#include "absl/status/statusor.h"
#include "kinematics/core/active_machine.hpp"

namespace lambdajet {
class Log;
class Metrics;
class Participant;
}  // namespace lambdajet

namespace lambdajet::kinematics {

class PoseDoor {
 public:
  // `on_description` is called on a thread of the bus after each description taken over. All references outlive the door.
  static absl::StatusOr<std::unique_ptr<PoseDoor>> Open(Participant& bus, MachineSlot& slot, Log& log,
                                                        Metrics& metrics,
                                                        std::function<void()> on_description);
  ~PoseDoor();
  PoseDoor(const PoseDoor&) = delete;
  PoseDoor& operator=(const PoseDoor&) = delete;

 private:
  class Inside;
  PoseDoor();
  std::unique_ptr<Inside> inside_;
};

}  // namespace lambdajet::kinematics
