// Puts a module's simulated iron together: the truth of a plant file, the plant, and the doors to its own topics.
//
// Model: what main hands to the node as hardware, and what it calls round a cycle. Threads: Open() in main, the rest from
// the module's loop. Errors: BAD_PLANT_FILE, those of platform/bus.
#pragma once

#include <memory>

#include "absl/status/statusor.h"
#include "simulated_plant/bus/truth_doors.hpp"
#include "simulated_plant/plant_file/plant_file.hpp"

namespace lambdajet::simulated_plant {

class SimulatedDrive {
 public:
  static absl::StatusOr<std::unique_ptr<SimulatedDrive>> Open(Participant& bus, const PlantOptions& options);
  drive::DriveHardware& hardware() { return *plant_; }
  void Publish(const DriveState& state) { door_->Publish(state); }

 private:
  std::unique_ptr<DrivePlant> plant_;
  std::unique_ptr<DriveTruthDoor> door_;
};

class SimulatedMainMotion {
 public:
  static absl::StatusOr<std::unique_ptr<SimulatedMainMotion>> Open(Participant& bus,
                                                                   const PlantOptions& options);
  main_motion::MainMotionHardware& hardware() { return *plant_; }
  void Refresh() { sheet_->Refresh(); }
  void Publish(const MainMotionState& state) { door_->Publish(state); }

 private:
  std::unique_ptr<SheetTruthDoor> sheet_;
  std::unique_ptr<MainMotionPlant> plant_;
  std::unique_ptr<JetTruthDoor> door_;
};

}  // namespace lambdajet::simulated_plant
