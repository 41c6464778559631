// Answers the questions of kinematics.proto, message in, message out, without a server: FromWire, refuse, compute, ToWire.
//
// Errors: absl::Status for what cannot be understood (mechanism_selection.hpp; NOT_FINITE, TOO_MANY, BAD_STRIDE in fields);
// physics that says no stands in the response.
// Threads: any number at once. Cost: microseconds, but for workspace and optimisation, which take up to seconds and ask
// `cancelled` between steps.
#pragma once

#include <cstddef>
#include <functional>

#include "absl/status/status.h"
#include "kinematics/core/active_machine.hpp"
#include "lambdajet/kinematics/v1/kinematics.pb.h"

namespace lambdajet::kinematics {

// Largest batch in one message; 65,536 hexapod poses are 3 MiB.
inline constexpr std::size_t kMostPosesPerMessage = 65'536;
inline constexpr std::size_t kMostSweepPoints = 1'000;

class KinematicsAnswers {
 public:
  explicit KinematicsAnswers(const MachineSlot& slot) : slot_(slot) {}

  absl::Status GetMachine(const v1::GetMachineRequest& request, v1::GetMachineResponse& response) const;
  absl::Status SolveInverse(const v1::SolveInverseRequest& request, v1::SolveInverseResponse& response) const;
  absl::Status SolveForward(const v1::SolveForwardRequest& request, v1::SolveForwardResponse& response) const;
  absl::Status SolveBatch(const v1::SolveInverseBatchRequest& request,
                          v1::SolveInverseBatchResponse& response) const;
  absl::Status SolveBatch(const v1::SolveForwardBatchRequest& request,
                          v1::SolveForwardBatchResponse& response) const;
  absl::Status ComputeJacobian(const v1::ComputeJacobianRequest& request,
                               v1::ComputeJacobianResponse& response) const;
  absl::Status ReportSingularity(const v1::ReportSingularityRequest& request,
                                 v1::ReportSingularityResponse& response) const;
  absl::Status ComputeServiceArea(const v1::ComputeServiceAreaRequest& request,
                                  v1::ComputeServiceAreaResponse& response) const;

 private:
  const MachineSlot& slot_;
};

}  // namespace lambdajet::kinematics
