// Answers the long questions, workspace and geometry optimisation, message in, message out.
//
// Errors: as kinematics_answers.hpp; CANCELLED where the client has gone. Threads: pure.
#pragma once

#include <functional>

#include "absl/status/status.h"
#include "kinematics/core/active_machine.hpp"
#include "lambdajet/kinematics/v1/kinematics.pb.h"

namespace lambdajet::kinematics {

absl::Status ComputeWorkspace(const MachineSlot& slot, const v1::ComputeWorkspaceRequest& request,
                              const std::function<bool()>& cancelled, v1::ComputeWorkspaceResponse& response);

absl::Status OptimiseGeometry(const MachineSlot& slot, const v1::OptimiseGeometryRequest& request,
                              const std::function<bool()>& cancelled, v1::OptimiseGeometryResponse& response);

}  // namespace lambdajet::kinematics
