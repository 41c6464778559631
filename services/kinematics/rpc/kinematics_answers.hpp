// Answers the questions of kinematics.proto, message in, message out, without a server: FromWire, refuse, compute, ToWire.
//
// Errors: absl::Status for what cannot be understood (mechanism_selection.hpp; NOT_FINITE, TOO_MANY, BAD_STRIDE in fields);
// physics that says no stands in the response.
// Threads: any number at once. Cost: microseconds, but for workspace and optimisation, which take up to seconds and ask
// `cancelled` between steps.
#pragma once

#include <cstddef>

#include "absl/status/status.h"
#include "kinematics/core/active_machine.hpp"
#include "lambdajet/kinematics/v1/kinematics.pb.h"

namespace lambdajet::kinematics {

// Largest batch in one message, and most numbers that it may bring or ask for: 4 MiB.
inline constexpr std::size_t kMostPosesPerMessage = 65'536;
inline constexpr std::size_t kMostNumbersPerMessage = 524'288;
inline constexpr std::size_t kMostSweepPoints = 1'000;

class KinematicsAnswers {
 public:
  explicit KinematicsAnswers(const MachineSlot& slot) : slot_(slot) {}

  absl::Status GetMachine(const v1::GetMachineRequest& request, v1::GetMachineResponse& response) const;
  absl::Status SolveInverse(const v1::SolveInverseRequest& request, v1::SolveInverseResponse& response) const;
  absl::Status SolveForward(const v1::SolveForwardRequest& request, v1::SolveForwardResponse& response) const;
  absl::Status ComputeJacobian(const v1::ComputeJacobianRequest& request,
                               v1::ComputeJacobianResponse& response) const;
  absl::Status ReportSingularity(const v1::ReportSingularityRequest& request,
                                 v1::ReportSingularityResponse& response) const;
  absl::Status ComputeServiceArea(const v1::ComputeServiceAreaRequest& request,
                                  v1::ComputeServiceAreaResponse& response) const;
  absl::Status CarryPoint(const v1::CarryPointRequest& request, v1::CarryPointResponse& response) const;

  // What may also come as a stream (batch_stream.hpp): batches, whose entries have an answer each, in batch_answers.cpp;
  // chains and sweeps in chain_answers.cpp and sweep_answers.cpp.
  absl::Status AnswerBatch(const v1::SolveInverseBatchRequest& request,
                           v1::SolveInverseBatchResponse& response) const;
  absl::Status AnswerBatch(const v1::SolveForwardBatchRequest& request,
                           v1::SolveForwardBatchResponse& response) const;
  absl::Status AnswerBatch(const v1::ComputeJacobianBatchRequest& request,
                           v1::ComputeJacobianBatchResponse& response) const;
  absl::Status AnswerBatch(const v1::ReportSingularityBatchRequest& request,
                           v1::ReportSingularityBatchResponse& response) const;
  absl::Status AnswerBatch(const v1::CarryPointBatchRequest& request,
                           v1::CarryPointBatchResponse& response) const;
  absl::Status AnswerBatch(const v1::SumErrorsRequest& request, v1::SumErrorsResponse& response) const;
  absl::Status AnswerBatch(const v1::SweepSheetRequest& request, v1::SweepSheetResponse& response) const;

 private:
  const MachineSlot& slot_;
};

}  // namespace lambdajet::kinematics
