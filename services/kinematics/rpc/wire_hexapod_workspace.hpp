// Answers where a hexapod may stand, message in, message out.
//
// Errors: as kinematics_answers.hpp; INVALID_ARGUMENT WRONG_MECHANISM for a lambda or biglide, BAD_WORKSPACE; CANCELLED
// where the client has gone. Threads: pure.
#pragma once

#include <functional>

#include "absl/status/status.h"
#include "kinematics/core/active_machine.hpp"
#include "lambdajet/kinematics/v1/kinematics.pb.h"

namespace lambdajet::kinematics {

absl::Status ComputeHexapodWorkspace(const MachineSlot& slot,
                                     const v1::ComputeHexapodWorkspaceRequest& request,
                                     const std::function<bool()>& cancelled,
                                     v1::ComputeHexapodWorkspaceResponse& response);

}  // namespace lambdajet::kinematics
