// Translates between lambdajet.trajectory.v1 and the core.
//
// Threads: pure. Errors: FromWire says INVALID_ARGUMENT with every field that is wrong.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "lambdajet/trajectory/v1/trajectory.pb.h"
#include "trajectory/rpc/plan_desk.hpp"

namespace lambdajet::trajectory {

inline constexpr std::size_t kMostProgramBytes = 15u << 20;

absl::Status CheckProgram(const std::string& program);
absl::StatusOr<PlanOptions> FromWire(const v1::PlanOptions& wire);

void ToWire(const MachineDescription& machine, machine::v1::ModelVersion& wire);
void ToWire(const ProgramFault& fault, v1::ProgramFault& wire);
void ToWire(const PlanRecord& record, type::v1::Operation& wire);
void ToWire(const PlanRecord& record, v1::PlanSummary& wire);

// One point into a batch of stride 12.
void AddPoint(const PlannedProgram& planned, double tau_s, v1::SampleBatch& wire);

}  // namespace lambdajet::trajectory
