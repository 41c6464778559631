// Translates between lambdajet.trajectory.v1 and the core.
//
// Threads: pure. Errors: FromWire says INVALID_ARGUMENT with every field that is wrong; a program beyond kMostProgramBytes is
// PROGRAM_TOO_LARGE (the door takes messages of 128 MiB, so that it can say so).
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "lambdajet/trajectory/v1/trajectory.pb.h"
#include "trajectory/rpc/plan_desk.hpp"

namespace lambdajet::trajectory {

inline constexpr std::size_t kMostProgramBytes = 64u << 20;

absl::Status CheckProgram(const std::string& program);
absl::StatusOr<PlanOptions> FromWire(const v1::PlanOptions& wire);

void ToWire(const MachineDescription& machine, machine::v1::ModelVersion& wire);
void ToWire(const ProgramFault& fault, v1::ProgramFault& wire);
void ToWire(const Admission& admission, const MachineDescription& machine, v1::AdmitProgramResponse& wire);
void ToWire(const PlanRecord& record, type::v1::Operation& wire);
void ToWire(const PlanRecord& record, v1::PlanSummary& wire);
void ToWire(const ToleranceBlame& blame, v1::ToleranceBlame& wire);

// One point into a batch of stride 12.
void AddPoint(const PlannedProgram& planned, double tau_s, v1::SampleBatch& wire);

}  // namespace lambdajet::trajectory
