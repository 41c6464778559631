// Serves kinematics.proto over gRPC.
//
// Model: each handler is one line over KinematicsAnswers; unary and batch answers are computed on gRPC's own threads,
// workspace and optimisation on a pool. A bidirectional stream answers a batch while the next one is being read.
// Threads: as gRPC calls.
#pragma once

#include "kinematics/rpc/kinematics_answers.hpp"
#include "lambdajet/kinematics/v1/kinematics.grpc.pb.h"
#include "platform/rpc/work_pool.hpp"

namespace lambdajet::kinematics {

class KinematicsRpc final : public v1::KinematicsService::CallbackService {
 public:
  explicit KinematicsRpc(const MachineSlot& slot);
  ~KinematicsRpc() override;

  using Context = grpc::CallbackServerContext;
  using Unary = grpc::ServerUnaryReactor;

  Unary* GetMachine(Context* context, const v1::GetMachineRequest* request,
                    v1::GetMachineResponse* response) override;
  Unary* SolveInverse(Context* context, const v1::SolveInverseRequest* request,
                      v1::SolveInverseResponse* response) override;
  Unary* SolveForward(Context* context, const v1::SolveForwardRequest* request,
                      v1::SolveForwardResponse* response) override;
  Unary* SolveInverseBatch(Context* context, const v1::SolveInverseBatchRequest* request,
                           v1::SolveInverseBatchResponse* response) override;
  Unary* SolveForwardBatch(Context* context, const v1::SolveForwardBatchRequest* request,
                           v1::SolveForwardBatchResponse* response) override;
  Unary* ComputeJacobianBatch(Context* context, const v1::ComputeJacobianBatchRequest* request,
                              v1::ComputeJacobianBatchResponse* response) override;
  Unary* ReportSingularityBatch(Context* context, const v1::ReportSingularityBatchRequest* request,
                                v1::ReportSingularityBatchResponse* response) override;
  Unary* CarryPoint(Context* context, const v1::CarryPointRequest* request,
                    v1::CarryPointResponse* response) override;
  Unary* CarryPointBatch(Context* context, const v1::CarryPointBatchRequest* request,
                         v1::CarryPointBatchResponse* response) override;
  Unary* SumErrors(Context* context, const v1::SumErrorsRequest* request,
                   v1::SumErrorsResponse* response) override;
  Unary* SweepSheet(Context* context, const v1::SweepSheetRequest* request,
                    v1::SweepSheetResponse* response) override;

  template <class Request, class Response>
  using Stream = grpc::ServerBidiReactor<Request, Response>;
  Stream<v1::SolveInverseBatchRequest, v1::SolveInverseBatchResponse>* StreamInverse(Context*) override;
  Stream<v1::SolveForwardBatchRequest, v1::SolveForwardBatchResponse>* StreamForward(Context*) override;
  Stream<v1::ComputeJacobianBatchRequest, v1::ComputeJacobianBatchResponse>* StreamJacobian(
      Context*) override;
  Stream<v1::ReportSingularityBatchRequest, v1::ReportSingularityBatchResponse>* StreamSingularity(
      Context*) override;
  Stream<v1::CarryPointBatchRequest, v1::CarryPointBatchResponse>* StreamPoints(Context*) override;
  Stream<v1::SumErrorsRequest, v1::SumErrorsResponse>* StreamErrors(Context*) override;
  Stream<v1::SweepSheetRequest, v1::SweepSheetResponse>* StreamSweeps(Context*) override;

  Unary* ComputeJacobian(Context* context, const v1::ComputeJacobianRequest* request,
                         v1::ComputeJacobianResponse* response) override;
  Unary* ReportSingularity(Context* context, const v1::ReportSingularityRequest* request,
                           v1::ReportSingularityResponse* response) override;
  Unary* ComputeWorkspace(Context* context, const v1::ComputeWorkspaceRequest* request,
                          v1::ComputeWorkspaceResponse* response) override;
  Unary* ComputeHexapodWorkspace(Context* context, const v1::ComputeHexapodWorkspaceRequest* request,
                                 v1::ComputeHexapodWorkspaceResponse* response) override;
  Unary* ComputeServiceArea(Context* context, const v1::ComputeServiceAreaRequest* request,
                            v1::ComputeServiceAreaResponse* response) override;
  Unary* OptimiseGeometry(Context* context, const v1::OptimiseGeometryRequest* request,
                          v1::OptimiseGeometryResponse* response) override;

 private:
  const MachineSlot& slot_;
  KinematicsAnswers answers_;
  WorkPool long_work_{1, 8};
};

}  // namespace lambdajet::kinematics
