// Answers CalibrationService from the desk.
//
// Threads: gRPC's; identification runs on the desk's own.
// Errors: those of wire.hpp and desk/calibration_desk.hpp.
#pragma once

#include "calibration/desk/calibration_desk.hpp"
#include "lambdajet/calibration/v1/calibration.grpc.pb.h"

namespace lambdajet::calibration {

class CalibrationRpc final : public v1::CalibrationService::CallbackService {
 public:
  explicit CalibrationRpc(CalibrationDesk& desk);
  ~CalibrationRpc() override;

  grpc::ServerUnaryReactor* PlanMeasuringRun(grpc::CallbackServerContext* context,
                                             const v1::PlanMeasuringRunRequest* request,
                                             v1::PlanMeasuringRunResponse* response) override;
  grpc::ServerUnaryReactor* PlanVerification(grpc::CallbackServerContext* context,
                                             const v1::PlanVerificationRequest* request,
                                             v1::PlanVerificationResponse* response) override;
  grpc::ServerUnaryReactor* ListRuns(grpc::CallbackServerContext* context, const v1::ListRunsRequest* request,
                                     v1::ListRunsResponse* response) override;
  grpc::ServerUnaryReactor* GetRun(grpc::CallbackServerContext* context, const v1::GetRunRequest* request,
                                   v1::GetRunResponse* response) override;
  grpc::ServerUnaryReactor* VerifyBase(grpc::CallbackServerContext* context,
                                       const v1::VerifyBaseRequest* request,
                                       v1::VerifyBaseResponse* response) override;
  grpc::ServerUnaryReactor* StartIdentification(grpc::CallbackServerContext* context,
                                                const v1::StartIdentificationRequest* request,
                                                v1::StartIdentificationResponse* response) override;
  grpc::ServerUnaryReactor* GetIdentification(grpc::CallbackServerContext* context,
                                              const v1::GetIdentificationRequest* request,
                                              v1::GetIdentificationResponse* response) override;
  grpc::ServerUnaryReactor* CancelIdentification(grpc::CallbackServerContext* context,
                                                 const v1::CancelIdentificationRequest* request,
                                                 v1::CancelIdentificationResponse* response) override;
  grpc::ServerUnaryReactor* ActivateVersion(grpc::CallbackServerContext* context,
                                            const v1::ActivateVersionRequest* request,
                                            v1::ActivateVersionResponse* response) override;
  grpc::ServerUnaryReactor* ListVersions(grpc::CallbackServerContext* context,
                                         const v1::ListVersionsRequest* request,
                                         v1::ListVersionsResponse* response) override;
  grpc::ServerUnaryReactor* GetVersion(grpc::CallbackServerContext* context,
                                       const v1::GetVersionRequest* request,
                                       v1::GetVersionResponse* response) override;
  grpc::ServerUnaryReactor* DiffVersions(grpc::CallbackServerContext* context,
                                         const v1::DiffVersionsRequest* request,
                                         v1::DiffVersionsResponse* response) override;

 private:
  absl::Status AnswerIdentification(const std::string& id, v1::GetIdentificationResponse& response);

  CalibrationDesk& desk_;
};

}  // namespace lambdajet::calibration
