// Any bytes as a request of kinematics.proto: a status with a reason, or an answer without NaN or infinity.
//
// The first byte chooses the question. Workspace and optimisation are cancelled at once: their converters are what is tried.
#include <string>

#include "foundation/contract/trouble.hpp"
#include "kinematics/rpc/kinematics_answers.hpp"
#include "kinematics/rpc/wire_workspace.hpp"
#include "tests/fuzz/all_finite.hpp"
#include "tests/fuzz/fuzz_target.hpp"
#include "tests/papers/kinematics_hexapod_cases.hpp"

namespace lambdajet::kinematics {
namespace {

using fuzz::AllFinite;
using fuzz::Promise;

template <class Request, class Response, class Ask>
void Try(const std::string& bytes, Ask ask) {
  Request request;
  if (!request.ParseFromString(bytes)) {
    return;  // gRPC refuses it before it gets to us
  }
  Response response;
  const absl::Status status = ask(request, response);
  if (status.ok()) {
    Promise(AllFinite(response), "an answer holds only finite numbers");
  } else {
    Promise(!TroubleReason(status).empty(), "trouble has a reason");
  }
}

template <class Request, class Response>
void TryBatch(const KinematicsAnswers& answers, const std::string& bytes) {
  Try<Request, Response>(
      bytes, [&](const auto& request, auto& response) { return answers.AnswerBatch(request, response); });
}

const MachineSlot& Slot() {
  static const MachineSlot& slot = *[] {
    auto* made = new MachineSlot(std::make_shared<const OwnHexapod>(
        OwnHexapod{"fuzz-hexapod", "", Hexapod(worked::NonIdealGeometry())}));
    MachineDescription machine;
    machine.machine_id = "fuzz";
    machine.parameters.head<kMechanismParameterCount>() = IdealLambda(1200, 600, 700);
    machine.actuators[0] = machine.actuators[1] = {-1600.0, 2600.0, 1500.0, 15000.0, 400000.0};
    machine.singular_margin_mm = 20.0;
    made->Publish(machine);
    return made;
  }();
  return slot;
}

void Ask(int question, const std::string& bytes) {
  const KinematicsAnswers answers(Slot());
  const auto give_up = [] { return true; };
  switch (question % 14) {
    case 0:
      return Try<v1::SolveInverseRequest, v1::SolveInverseResponse>(
          bytes,
          [&](const auto& request, auto& response) { return answers.SolveInverse(request, response); });
    case 1:
      return Try<v1::SolveForwardRequest, v1::SolveForwardResponse>(
          bytes,
          [&](const auto& request, auto& response) { return answers.SolveForward(request, response); });
    case 2:
      return TryBatch<v1::SolveInverseBatchRequest, v1::SolveInverseBatchResponse>(answers, bytes);
    case 3:
      return TryBatch<v1::SolveForwardBatchRequest, v1::SolveForwardBatchResponse>(answers, bytes);
    case 4:
      return Try<v1::ComputeJacobianRequest, v1::ComputeJacobianResponse>(
          bytes,
          [&](const auto& request, auto& response) { return answers.ComputeJacobian(request, response); });
    case 5:
      return Try<v1::ReportSingularityRequest, v1::ReportSingularityResponse>(
          bytes,
          [&](const auto& request, auto& response) { return answers.ReportSingularity(request, response); });
    case 6:
      return Try<v1::ComputeServiceAreaRequest, v1::ComputeServiceAreaResponse>(
          bytes,
          [&](const auto& request, auto& response) { return answers.ComputeServiceArea(request, response); });
    case 7:
      return Try<v1::ComputeWorkspaceRequest, v1::ComputeWorkspaceResponse>(
          bytes, [&](const auto& request, auto& response) {
            return ComputeWorkspace(Slot(), request, give_up, response);
          });
    case 8:
      return Try<v1::OptimiseGeometryRequest, v1::OptimiseGeometryResponse>(
          bytes, [&](const auto& request, auto& response) {
            return OptimiseGeometry(Slot(), request, give_up, response);
          });
    case 9:
      return TryBatch<v1::ComputeJacobianBatchRequest, v1::ComputeJacobianBatchResponse>(answers, bytes);
    case 10:
      return TryBatch<v1::ReportSingularityBatchRequest, v1::ReportSingularityBatchResponse>(answers, bytes);
    case 11:
      return TryBatch<v1::CarryPointBatchRequest, v1::CarryPointBatchResponse>(answers, bytes);
    case 12:
      return TryBatch<v1::SumErrorsRequest, v1::SumErrorsResponse>(answers, bytes);
    default:
      return TryBatch<v1::SweepSheetRequest, v1::SweepSheetResponse>(answers, bytes);
  }
}

}  // namespace
}  // namespace lambdajet::kinematics

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  if (size > 0) {
    lambdajet::kinematics::Ask(bytes[0], std::string(reinterpret_cast<const char*>(bytes + 1), size - 1));
  }
  return 0;
}
