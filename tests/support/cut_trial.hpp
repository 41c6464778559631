// Sends one random machine through the whole main job on a virtual clock: cut as set up, measure, identify, cut identified, cut
// compensated; each cut predicted before and judged after.
//
// Model: the shipped cores of trajectory, drive, main motion, calibration, accuracy and inspection; the truth is drawn by the
// simulated plant's own generator around the machine as designed and nobody but plant and judge reads it.
// Units: mm, s. Threads: one; the same machine, part and seed give the same trial, bit by bit. Cost: some two seconds a plant.
// Errors: `trouble` says in words what could not be done.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "absl/status/statusor.h"
#include "foundation/machine/machine_description.hpp"
#include "inspection/core/comparison.hpp"
#include "simulated_plant/core/plant_truth.hpp"

namespace lambdajet::tests {

struct TrialPart {
  std::string program;
  inspection::Drawing drawing;
};

// A shipped part: STEM.ngc and STEM.drawing.yaml.
absl::StatusOr<TrialPart> ReadTrialPart(const std::string& stem);

// A plate of 300 x 200 mm with two sharp and two rounded corners and three holes.
TrialPart PlateWithHoles(double kerf_width_mm, double feed_mm_per_s);

struct CutResult {
  bool cut = false;
  double p50_mm = 0.0;
  double p95_mm = 0.0;
  double max_mm = 0.0;
  double predicted_95_mm = 0.0;
  double predicted_95_linear_mm = 0.0;
  double expected_95_mm = 0.0;
  double promised_95_mm = 0.0;  // with feed from tolerance: largest of its contours'
  double planned_s = 0.0;       // program time
  double fastest_s = 0.0;       // with feed from tolerance: as the limits alone allow
  double cutting_time_s = 0.0;
  double event_p99_mm = 0.0;
  std::uint32_t not_cut = 0;
  std::uint64_t missing = 0;
  std::string largest_source;
  std::string worst_feature;  // where the largest deviation is
  double worst_x_W_mm = 0.0;
  double worst_y_W_mm = 0.0;
  int holds = 0;  // times the drive stopped on the path unasked

  bool bound_holds() const { return cut && p95_mm <= predicted_95_mm; }
};

enum class TrialStage { kSetUp, kIdentified, kCompensated };

struct PlantTrial {
  std::uint64_t seed = 0;
  std::string trouble;
  std::array<CutResult, 3> cuts;
  double identified_place_mm = 0.0;  // 95 %, worst over the sheet, as identification says
  double measuring_time_s = 0.0;

  const CutResult& cut(TrialStage stage) const { return cuts[static_cast<std::size_t>(stage)]; }
};

// The same with feed from tolerance: cut identified to one tolerance and compensated to another; nothing is cut as set up.
PlantTrial RunToleranceTrial(const MachineDescription& as_designed, const TrialPart& part, std::uint64_t seed,
                             double identified_mm, double compensated_mm);

// On this machine; `seed` is that of its noise.
PlantTrial RunTrial(const MachineDescription& as_designed, const simulated_plant::PlantTruth& truth,
                    const TrialPart& part, std::uint64_t seed);
// On one drawn at random.
PlantTrial RunTrial(const MachineDescription& as_designed, const TrialPart& part, std::uint64_t seed);

}  // namespace lambdajet::tests
