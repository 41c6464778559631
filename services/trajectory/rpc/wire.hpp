// Translates between lambdajet.trajectory.v1 and the core; programs: submitted_program.hpp.
//
// Threads: pure. Errors: FromWire says INVALID_ARGUMENT with every field that is wrong.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "lambdajet/trajectory/v1/trajectory.pb.h"
#include "trajectory/rpc/plan_desk.hpp"

namespace lambdajet::trajectory {

absl::StatusOr<PlanOptions> FromWire(const v1::PlanOptions& wire);

// A program with faults is not admitted for these.
Admission AdmitMade(const MadeProgram& program, const MachineDescription& machine, PlanOptions options);

void ToWire(const MachineDescription& machine, machine::v1::ModelVersion& wire);
void ToWire(const ProgramFault& fault, v1::ProgramFault& wire);
void ToWire(const Admission& admission, const MachineDescription& machine, v1::AdmitProgramResponse& wire);
// At most kMostSlowStretches of them, and how many there are.
void ToWire(const std::vector<SlowStretch>& slow, v1::PlanSummary& wire);
void ToWire(const PlanRecord& record, type::v1::Operation& wire);
void ToWire(const PlanRecord& record, v1::PlanSummary& wire);
void ToWire(const PlanRecord& record, v1::GetPlanResponse& wire);
void ToWire(const ToleranceBlame& blame, v1::ToleranceBlame& wire);

// One point into a batch of stride 12.
void AddPoint(const PlannedProgram& planned, double tau_s, v1::SampleBatch& wire);

}  // namespace lambdajet::trajectory
