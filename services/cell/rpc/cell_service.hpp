// Is the clients' door of the cell: lambdajet.cell.v1.CellService over the desk.
//
// Model: every handler is FromWire, refuse, ask the desk, ToWire. Calls that wait for the machine run on a small pool and
// wait no longer than their deadline allows; stopping, reading and listing never wait.
// Threads: gRPC's. Errors: those of the desk and the wire; DEADLINE_EXCEEDED EXPIRED_ON_ARRIVAL.
#pragma once

#include <functional>
#include <memory>

#include "cell/desk/job_desk.hpp"
#include "lambdajet/cell/v1/cell.grpc.pb.h"
#include "platform/rpc/handlers.hpp"

namespace lambdajet::cell {

class WatchHub;

class CellDoor final : public v1::CellService::CallbackService {
 public:
  CellDoor(JobDesk& desk, const Clock& clock);
  ~CellDoor() override;

  // Ends every watch; call it before the server shuts down.
  void Close();

  grpc::ServerUnaryReactor* SubmitJob(grpc::CallbackServerContext* context,
                                      const v1::SubmitJobRequest* request,
                                      v1::SubmitJobResponse* response) override;
  grpc::ServerUnaryReactor* StartJob(grpc::CallbackServerContext* context, const v1::StartJobRequest* request,
                                     v1::StartJobResponse* response) override;
  grpc::ServerUnaryReactor* HoldJob(grpc::CallbackServerContext* context, const v1::HoldJobRequest* request,
                                    v1::HoldJobResponse* response) override;
  grpc::ServerUnaryReactor* ResumeJob(grpc::CallbackServerContext* context,
                                      const v1::ResumeJobRequest* request,
                                      v1::ResumeJobResponse* response) override;
  grpc::ServerUnaryReactor* StopJob(grpc::CallbackServerContext* context, const v1::StopJobRequest* request,
                                    v1::StopJobResponse* response) override;
  grpc::ServerUnaryReactor* CancelJob(grpc::CallbackServerContext* context,
                                      const v1::CancelJobRequest* request,
                                      v1::CancelJobResponse* response) override;
  grpc::ServerUnaryReactor* SetFeedOverride(grpc::CallbackServerContext* context,
                                            const v1::SetFeedOverrideRequest* request,
                                            v1::SetFeedOverrideResponse* response) override;
  grpc::ServerUnaryReactor* ResetMachine(grpc::CallbackServerContext* context,
                                         const v1::ResetMachineRequest* request,
                                         v1::ResetMachineResponse* response) override;
  grpc::ServerUnaryReactor* GetJob(grpc::CallbackServerContext* context, const v1::GetJobRequest* request,
                                   v1::GetJobResponse* response) override;
  grpc::ServerUnaryReactor* ListJobs(grpc::CallbackServerContext* context, const v1::ListJobsRequest* request,
                                     v1::ListJobsResponse* response) override;
  grpc::ServerWriteReactor<v1::JobEvent>* WatchJobs(grpc::CallbackServerContext* context,
                                                    const v1::WatchJobsRequest* request) override;
  grpc::ServerUnaryReactor* GetReport(grpc::CallbackServerContext* context,
                                      const v1::GetReportRequest* request,
                                      v1::GetReportResponse* response) override;
  grpc::ServerUnaryReactor* GetMachineState(grpc::CallbackServerContext* context,
                                            const v1::GetMachineStateRequest* request,
                                            v1::GetMachineStateResponse* response) override;

 private:
  // Checks the id, asks the desk on the pool, answers the job.
  template <typename Response>
  grpc::ServerUnaryReactor* AnswerJob(grpc::CallbackServerContext* context, const std::string& job_id,
                                      Response* response,
                                      std::function<absl::StatusOr<LiveJob>(double patience_s)> ask);

  JobDesk& desk_;
  const Clock& clock_;
  WorkPool pool_;
  std::unique_ptr<WatchHub> watches_;
};

}  // namespace lambdajet::cell
