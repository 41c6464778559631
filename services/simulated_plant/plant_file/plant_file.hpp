// Reads and writes the YAML file that says what a simulated machine truly is (deploy/plants).
//
// Model: every key is required but `marks` and `faults`, which are lists; unknown and repeated keys are refused. What has
// been read is checked by Validate(). Written text is canonical: a fixed order of keys, the shortest digits that read
// back to the same number. Only the simulated plants and their tools open such a file.
// Units: in the keys. Threads: any.
// Errors: INVALID_ARGUMENT BAD_PLANT_FILE with up to 20 violations, each with key, value, unit and line; those of
// ReadWholeFile and WriteFileAtomically.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "platform/config/schema.hpp"
#include "simulated_plant/core/plant_truth.hpp"

namespace lambdajet::simulated_plant {

// The settings of a module whose iron is simulated.
struct PlantOptions {
  std::string plant = "deploy/plants/shipped.yaml";
  int seed = 1;

  void Declare(ConfigSchema& schema);
};

absl::StatusOr<PlantTruth> ReadPlantFile(const std::string& path);

// `name` stands for the file in messages.
absl::StatusOr<PlantTruth> ParsePlant(const std::string& yaml, const std::string& name);

std::string PlantText(const PlantTruth& truth);
absl::Status WritePlantFile(const std::string& path, const PlantTruth& truth);

}  // namespace lambdajet::simulated_plant
