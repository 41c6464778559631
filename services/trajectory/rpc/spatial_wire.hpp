// Translates between lambdajet.trajectory.v1 and the hexapod's planner.
//
// Threads: pure. Errors: INVALID_ARGUMENT UNKNOWN_MECHANISM, NOT_FOR_HEXAPOD, and those of the numbers; FAILED_PRECONDITION
// NO_HEXAPOD where the service was started without one.
#pragma once

#include <functional>
#include <memory>

#include "absl/status/statusor.h"
#include "lambdajet/trajectory/v1/trajectory.pb.h"
#include "trajectory/core/spatial_feed/spatial_program.hpp"

namespace lambdajet::trajectory {

// The hexapod that a request names; null: it names the open-base machine.
absl::StatusOr<std::shared_ptr<const HexapodModel>> HexapodFor(
    v1::Mechanism mechanism, const std::shared_ptr<const HexapodModel>& own);

// What a drawing sent for it is told.
absl::Status DrawingForHexapod();

absl::StatusOr<SpatialOptions> SpatialFromWire(const v1::PlanOptions& wire, ProgramNotation notation);

void ToWire(const HexapodModel& hexapod, machine::v1::ModelVersion& wire);
void ToWire(const SpatialAdmission& admission, const HexapodModel& hexapod, v1::AdmitProgramResponse& wire);
// All but the plan's id.
void ToWire(const PlannedSpatialProgram& planned, const HexapodModel& hexapod, v1::PlanSummary& wire);

// One point into a batch of stride 22.
void AddSpatialPoint(const PlannedSpatialProgram& planned, double tau_s, v1::SampleBatch& wire);

// The plan's points as CSV with a header line.
std::function<absl::StatusOr<bool>(v1::ExportPiece&)> SpatialSamplePieces(
    std::shared_ptr<const PlannedSpatialProgram> planned, double step_s);

}  // namespace lambdajet::trajectory
