#include "kinematics/rpc/kinematics_service.hpp"

#include "kinematics/rpc/batch_stream.hpp"
#include "kinematics/rpc/wire_hexapod_workspace.hpp"
#include "kinematics/rpc/wire_workspace.hpp"
#include "platform/rpc/handlers.hpp"

namespace lambdajet::kinematics {

using Rpc = KinematicsRpc;

KinematicsRpc::KinematicsRpc(const MachineSlot& slot) : slot_(slot), answers_(slot) {}

KinematicsRpc::~KinematicsRpc() = default;

Rpc::Unary* Rpc::GetMachine(Context* context, const v1::GetMachineRequest* request,
                            v1::GetMachineResponse* response) {
  return Answer(context, [&] { return answers_.GetMachine(*request, *response); });
}

Rpc::Unary* Rpc::SolveInverse(Context* context, const v1::SolveInverseRequest* request,
                              v1::SolveInverseResponse* response) {
  return Answer(context, [&] { return answers_.SolveInverse(*request, *response); });
}

Rpc::Unary* Rpc::SolveForward(Context* context, const v1::SolveForwardRequest* request,
                              v1::SolveForwardResponse* response) {
  return Answer(context, [&] { return answers_.SolveForward(*request, *response); });
}

Rpc::Unary* Rpc::SolveInverseBatch(Context* context, const v1::SolveInverseBatchRequest* request,
                                   v1::SolveInverseBatchResponse* response) {
  return Answer(context, [&] { return answers_.AnswerBatch(*request, *response); });
}

Rpc::Unary* Rpc::SolveForwardBatch(Context* context, const v1::SolveForwardBatchRequest* request,
                                   v1::SolveForwardBatchResponse* response) {
  return Answer(context, [&] { return answers_.AnswerBatch(*request, *response); });
}

Rpc::Unary* Rpc::ComputeJacobianBatch(Context* context, const v1::ComputeJacobianBatchRequest* request,
                                      v1::ComputeJacobianBatchResponse* response) {
  return Answer(context, [&] { return answers_.AnswerBatch(*request, *response); });
}

Rpc::Unary* Rpc::ReportSingularityBatch(Context* context, const v1::ReportSingularityBatchRequest* request,
                                        v1::ReportSingularityBatchResponse* response) {
  return Answer(context, [&] { return answers_.AnswerBatch(*request, *response); });
}

Rpc::Unary* Rpc::CarryPointBatch(Context* context, const v1::CarryPointBatchRequest* request,
                                 v1::CarryPointBatchResponse* response) {
  return Answer(context, [&] { return answers_.AnswerBatch(*request, *response); });
}

Rpc::Unary* Rpc::SumErrors(Context* context, const v1::SumErrorsRequest* request,
                           v1::SumErrorsResponse* response) {
  return Answer(context, [&] { return answers_.AnswerBatch(*request, *response); });
}

Rpc::Unary* Rpc::SweepSheet(Context* context, const v1::SweepSheetRequest* request,
                            v1::SweepSheetResponse* response) {
  return Answer(context, [&] { return answers_.AnswerBatch(*request, *response); });
}

Rpc::Unary* Rpc::CarryPoint(Context* context, const v1::CarryPointRequest* request,
                            v1::CarryPointResponse* response) {
  return Answer(context, [&] { return answers_.CarryPoint(*request, *response); });
}

Rpc::Stream<v1::SolveInverseBatchRequest, v1::SolveInverseBatchResponse>* Rpc::StreamInverse(Context*) {
  return new BatchStream<v1::SolveInverseBatchRequest, v1::SolveInverseBatchResponse>(answers_);
}

Rpc::Stream<v1::SolveForwardBatchRequest, v1::SolveForwardBatchResponse>* Rpc::StreamForward(Context*) {
  return new BatchStream<v1::SolveForwardBatchRequest, v1::SolveForwardBatchResponse>(answers_);
}

Rpc::Stream<v1::ComputeJacobianBatchRequest, v1::ComputeJacobianBatchResponse>* Rpc::StreamJacobian(
    Context*) {
  return new BatchStream<v1::ComputeJacobianBatchRequest, v1::ComputeJacobianBatchResponse>(answers_);
}

Rpc::Stream<v1::ReportSingularityBatchRequest, v1::ReportSingularityBatchResponse>* Rpc::StreamSingularity(
    Context*) {
  return new BatchStream<v1::ReportSingularityBatchRequest, v1::ReportSingularityBatchResponse>(answers_);
}

Rpc::Stream<v1::CarryPointBatchRequest, v1::CarryPointBatchResponse>* Rpc::StreamPoints(Context*) {
  return new BatchStream<v1::CarryPointBatchRequest, v1::CarryPointBatchResponse>(answers_);
}

Rpc::Stream<v1::SumErrorsRequest, v1::SumErrorsResponse>* Rpc::StreamErrors(Context*) {
  return new BatchStream<v1::SumErrorsRequest, v1::SumErrorsResponse>(answers_);
}

Rpc::Stream<v1::SweepSheetRequest, v1::SweepSheetResponse>* Rpc::StreamSweeps(Context*) {
  return new BatchStream<v1::SweepSheetRequest, v1::SweepSheetResponse>(answers_);
}

Rpc::Unary* Rpc::ComputeJacobian(Context* context, const v1::ComputeJacobianRequest* request,
                                 v1::ComputeJacobianResponse* response) {
  return Answer(context, [&] { return answers_.ComputeJacobian(*request, *response); });
}

Rpc::Unary* Rpc::ReportSingularity(Context* context, const v1::ReportSingularityRequest* request,
                                   v1::ReportSingularityResponse* response) {
  return Answer(context, [&] { return answers_.ReportSingularity(*request, *response); });
}

Rpc::Unary* Rpc::ComputeServiceArea(Context* context, const v1::ComputeServiceAreaRequest* request,
                                    v1::ComputeServiceAreaResponse* response) {
  return AnswerOn(long_work_, context, [this, request, response](const Cancelled&) {
    return answers_.ComputeServiceArea(*request, *response);
  });
}

Rpc::Unary* Rpc::ComputeWorkspace(Context* context, const v1::ComputeWorkspaceRequest* request,
                                  v1::ComputeWorkspaceResponse* response) {
  return AnswerOn(long_work_, context, [this, request, response](const Cancelled& cancelled) {
    return kinematics::ComputeWorkspace(slot_, *request, cancelled, *response);
  });
}

Rpc::Unary* Rpc::ComputeHexapodWorkspace(Context* context, const v1::ComputeHexapodWorkspaceRequest* request,
                                         v1::ComputeHexapodWorkspaceResponse* response) {
  return AnswerOn(long_work_, context, [this, request, response](const Cancelled& cancelled) {
    return kinematics::ComputeHexapodWorkspace(slot_, *request, cancelled, *response);
  });
}

Rpc::Unary* Rpc::OptimiseGeometry(Context* context, const v1::OptimiseGeometryRequest* request,
                                  v1::OptimiseGeometryResponse* response) {
  return AnswerOn(long_work_, context, [this, request, response](const Cancelled& cancelled) {
    return kinematics::OptimiseGeometry(slot_, *request, cancelled, *response);
  });
}

}  // namespace lambdajet::kinematics
