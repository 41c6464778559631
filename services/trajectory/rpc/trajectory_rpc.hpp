// Answers TrajectoryService: admits and plans programs, shows plans, starts and stops their streaming.
//
// Threads: gRPC's; admission and lists run on a pool, planning on the desk's. Errors: FAILED_PRECONDITION
// NO_MACHINE_DESCRIPTION until one has come, MACHINE_VERSION_NOT_HELD, PLAN_NOT_DONE; NOT_FOUND UNKNOWN_PLAN; those of wire.hpp.
// A program that cannot be planned is an answer with its faults.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <optional>

#include "lambdajet/trajectory/v1/trajectory.grpc.pb.h"
#include "platform/rpc/work_pool.hpp"
#include "trajectory/rpc/plan_desk.hpp"
#include "trajectory/rpc/plan_watch.hpp"
#include "trajectory/rpc/program_streams.hpp"

namespace lambdajet::trajectory {

// The machine to plan for: the active one, or a version still held; null: none.
using FindMachine =
    std::function<std::shared_ptr<const MachineDescription>(std::optional<std::uint32_t> version)>;

// What the bus door offers.
struct Streaming {
  std::function<void(std::shared_ptr<const Plan>)> start;
  std::function<std::uint64_t(std::uint64_t plan_id)> stop;
};

class TrajectoryRpc final : public v1::TrajectoryService::CallbackService {
 public:
  ~TrajectoryRpc() override;
  // `hexapod`: planned for where a request names it; null: none.
  TrajectoryRpc(FindMachine find_machine, Streaming streaming, PlanDesk& desk,
                std::shared_ptr<const HexapodModel> hexapod = nullptr);

  grpc::ServerUnaryReactor* AdmitProgram(grpc::CallbackServerContext* context,
                                         const v1::AdmitProgramRequest* request,
                                         v1::AdmitProgramResponse* response) override;
  grpc::ServerUnaryReactor* PlanProgram(grpc::CallbackServerContext* context,
                                        const v1::PlanProgramRequest* request,
                                        v1::PlanProgramResponse* response) override;
  grpc::ServerUnaryReactor* GetPlan(grpc::CallbackServerContext* context, const v1::GetPlanRequest* request,
                                    v1::GetPlanResponse* response) override;
  grpc::ServerWriteReactor<v1::GetPlanResponse>* WatchPlan(grpc::CallbackServerContext* context,
                                                           const v1::WatchPlanRequest* request) override;
  grpc::ServerUnaryReactor* CancelPlan(grpc::CallbackServerContext* context,
                                       const v1::CancelPlanRequest* request,
                                       v1::CancelPlanResponse* response) override;
  grpc::ServerUnaryReactor* ListPlans(grpc::CallbackServerContext* context,
                                      const v1::ListPlansRequest* request,
                                      v1::ListPlansResponse* response) override;
  grpc::ServerWriteReactor<v1::SampleBatch>* StreamSamples(grpc::CallbackServerContext* context,
                                                           const v1::StreamSamplesRequest* request) override;
  grpc::ServerWriteReactor<v1::AdmissionStep>* AdmitProgramInSteps(
      grpc::CallbackServerContext* context, const v1::AdmitProgramRequest* request) override;
  grpc::ServerWriteReactor<v1::OperationBatch>* StreamOperations(
      grpc::CallbackServerContext* context, const v1::ListOperationsRequest* request) override;
  grpc::ServerWriteReactor<v1::ExportPiece>* Export(grpc::CallbackServerContext* context,
                                                    const v1::ExportRequest* request) override;
  grpc::ServerUnaryReactor* ListOperations(grpc::CallbackServerContext* context,
                                           const v1::ListOperationsRequest* request,
                                           v1::ListOperationsResponse* response) override;
  grpc::ServerUnaryReactor* StartStreaming(grpc::CallbackServerContext* context,
                                           const v1::StartStreamingRequest* request,
                                           v1::StartStreamingResponse* response) override;
  grpc::ServerUnaryReactor* StopStreaming(grpc::CallbackServerContext* context,
                                          const v1::StopStreamingRequest* request,
                                          v1::StopStreamingResponse* response) override;

 private:
  struct Asked {
    SubmittedProgram program;
    PlanOptions options;
    std::shared_ptr<const MachineDescription> machine;
    std::shared_ptr<const HexapodModel> hexapod;  // set: it is meant, with `spatial`
    SpatialOptions spatial;
  };

  template <typename Request>
  absl::StatusOr<Asked> FromRequest(const Request& request) const;
  template <typename Wire>
  absl::StatusOr<ListedProgram> ListedOf(const Wire& wire) const;
  static absl::StatusOr<Asked> ForHexapod(SubmittedProgram program, const v1::PlanOptions& options,
                                          std::shared_ptr<const HexapodModel> hexapod);
  template <typename Admission>
  grpc::ServerWriteReactor<v1::AdmissionStep>* RunInSteps(std::shared_ptr<Admission> admission);
  absl::StatusOr<ListedProgram> ExportedProgram(const v1::ExportRequest& request) const;
  absl::StatusOr<std::shared_ptr<const MachineDescription>> MachineFor(const v1::PlanOptions& options) const;
  absl::Status Admit(const v1::AdmitProgramRequest& request, v1::AdmitProgramResponse& response) const;
  absl::Status BeginPlan(const v1::PlanProgramRequest& request, v1::PlanProgramResponse& response);
  absl::StatusOr<std::shared_ptr<const PlanRecord>> DonePlan(std::uint64_t id) const;

  FindMachine find_machine_;
  Streaming streaming_;
  PlanDesk& desk_;
  std::shared_ptr<const HexapodModel> hexapod_;
  PlanWatch watch_;
  WorkPool pool_;
  std::atomic<bool> closing_ = false;
  WorkPool admissions_;  // last: its threads wait for plans
};

}  // namespace lambdajet::trajectory
