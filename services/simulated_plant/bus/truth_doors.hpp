// Publishes what the simulated plants truly did, and carries the sheet's truth from the drive's plant to main motion's.
//
// Model: plant/drive_truth and plant/jet_truth in batches of ten 1 ms samples, reliable. In one process the plants touch
// each other directly; between processes this is the physics between the modules. No core and no service reads it.
// Threads: Publish() and Refresh() from the module's loop; samples arrive on the bus' threads. Errors: platform/bus.
#pragma once

#include <cstdint>
#include <memory>

#include "absl/status/statusor.h"
#include "foundation/motion/link_samples.hpp"
#include "simulated_plant/core/drive_plant.hpp"
#include "simulated_plant/core/main_motion_plant.hpp"
#include "simulated_plant/core/sheet_truth.hpp"

namespace lambdajet {
class Participant;
}

namespace lambdajet::simulated_plant {

class DriveTruthDoor {
 public:
  static absl::StatusOr<std::unique_ptr<DriveTruthDoor>> Open(Participant& bus, DrivePlant& plant);
  ~DriveTruthDoor();
  void Publish(const DriveState& state);  // once a cycle

 private:
  class Inside;
  DriveTruthDoor();
  std::unique_ptr<Inside> inside_;
};

class JetTruthDoor {
 public:
  static absl::StatusOr<std::unique_ptr<JetTruthDoor>> Open(Participant& bus, MainMotionPlant& plant);
  ~JetTruthDoor();
  void Publish(const MainMotionState& state);

 private:
  class Inside;
  JetTruthDoor();
  std::unique_ptr<Inside> inside_;
};

// The sheet as main motion's plant sees it.
class SheetTruthDoor final : public SheetTruthSource {
 public:
  static absl::StatusOr<std::unique_ptr<SheetTruthDoor>> Open(Participant& bus);
  ~SheetTruthDoor() override;
  void Refresh();  // once a cycle, before the plant is read
  std::optional<PlanarPose> PoseAt(std::int64_t time_ns) const override { return history_.PoseAt(time_ns); }
  std::int64_t newest_ns() const override { return history_.newest_ns(); }

 private:
  class Inside;
  SheetTruthDoor();
  SheetTruthHistory history_;
  std::unique_ptr<Inside> inside_;
};

}  // namespace lambdajet::simulated_plant
