#include "simulated_plant/bus/simulated_modules.hpp"

#include <utility>

namespace lambdajet::simulated_plant {
namespace {

// The plant's own seed makes the machine; the run's seed makes the noise of the day.
std::uint64_t NoiseSeed(const PlantTruth& truth, const PlantOptions& options, std::uint64_t module) {
  return truth.seed * 1000003 + static_cast<std::uint64_t>(options.seed) + module;
}

}  // namespace

absl::StatusOr<std::unique_ptr<SimulatedDrive>> SimulatedDrive::Open(Participant& bus,
                                                                     const PlantOptions& options) {
  const absl::StatusOr<PlantTruth> truth = ReadPlantFile(options.plant);
  if (!truth.ok()) {
    return truth.status();
  }
  auto drive = std::make_unique<SimulatedDrive>();
  drive->plant_ = std::make_unique<DrivePlant>(*truth, NoiseSeed(*truth, options, 0));
  auto door = DriveTruthDoor::Open(bus, *drive->plant_);
  if (!door.ok()) {
    return door.status();
  }
  drive->door_ = std::move(*door);
  return drive;
}

absl::StatusOr<std::unique_ptr<SimulatedMainMotion>> SimulatedMainMotion::Open(Participant& bus,
                                                                               const PlantOptions& options) {
  const absl::StatusOr<PlantTruth> truth = ReadPlantFile(options.plant);
  if (!truth.ok()) {
    return truth.status();
  }
  auto module = std::make_unique<SimulatedMainMotion>();
  auto sheet = SheetTruthDoor::Open(bus);
  if (!sheet.ok()) {
    return sheet.status();
  }
  module->sheet_ = std::move(*sheet);
  module->plant_ =
      std::make_unique<MainMotionPlant>(*truth, NoiseSeed(*truth, options, 500009), *module->sheet_);
  auto door = JetTruthDoor::Open(bus, *module->plant_);
  if (!door.ok()) {
    return door.status();
  }
  module->door_ = std::move(*door);
  return module;
}

}  // namespace lambdajet::simulated_plant
