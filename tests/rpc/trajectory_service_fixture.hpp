// TrajectoryService on a server of its own, with the demonstration machine as if identified, for the tests of its calls.
//
// Threads: the test's own. Errors: start-up trouble fails the test.
#pragma once

#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "foundation/contract/trouble.hpp"
#include "platform/machine_file/machine_file.hpp"
#include "platform/rpc/channel.hpp"
#include "platform/rpc/rpc_server.hpp"
#include "platform/rpc/status_mapping.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/eventually.hpp"
#include "trajectory/rpc/trajectory_rpc.hpp"

namespace lambdajet::trajectory {

inline constexpr const char* kPlate =
    "G21 G90\nG0 X200 Y200\nM3 P0.3\nG1 X260 F3600\nG3 X260 Y230 I0 J15\nG1 X200\nM5\nM2\n";

class TrajectoryServiceTest : public testing::Test {
 public:
  using Stub = v1::TrajectoryService::Stub;
  using Step = v1::AdmissionStep;

 protected:
  TrajectoryServiceTest()
      : desk_(metrics_),
        rpc_([this](std::optional<std::uint32_t> version) { return Machine(version); },
             {[this](std::shared_ptr<const lambdajet::Plan> plan) { streamed_ = plan->id; },
              [this](std::uint64_t) { return std::exchange(streamed_, 0); }},
             desk_),
        server_({}, nullptr, nullptr) {
    auto machine = ReadMachineFile(test::SourceDir() + "/deploy/config/machine.yaml");
    EXPECT_TRUE(machine.ok()) << machine.status();
    machine->version = 4;  // as identified: what is left of every sigma is small
    machine->covariance *= 1e-4;
    machine_ = std::make_shared<const MachineDescription>(*machine);
    server_.Add(rpc_, v1::TrajectoryService::service_full_name());
    EXPECT_TRUE(server_.Start().ok());
    channel_ =
        *OpenChannel({.address = "127.0.0.1:" + std::to_string(server_.port()), .most_message_mib = 256});
    stub_ = v1::TrajectoryService::NewStub(channel_);
  }
  ~TrajectoryServiceTest() override {
    desk_.CancelAll();
    server_.Shutdown();
  }

  std::shared_ptr<const MachineDescription> Machine(std::optional<std::uint32_t> version) const {
    return !version || (machine_ != nullptr && machine_->version == *version) ? machine_ : nullptr;
  }

  std::vector<Step> Steps(const v1::AdmitProgramRequest& request, absl::Status& status,
                          double deadline_s = 60.0) {
    grpc::ClientContext context;
    SetDeadline(context, deadline_s);
    const auto stream = stub_->AdmitProgramInSteps(&context, request);
    std::vector<Step> steps;
    for (Step step; stream->Read(&step);) {
      steps.push_back(step);
    }
    status = lambdajet::FromWire(stream->Finish());
    return steps;
  }

  v1::GetPlanResponse PlanAndWait(const std::string& program, const v1::PlanOptions& options = {}) {
    v1::PlanProgramRequest request;
    request.set_program(program);
    *request.mutable_options() = options;
    return PlanAndWait(request);
  }

  v1::GetPlanResponse PlanAndWait(const v1::PlanProgramRequest& request) {
    v1::PlanProgramResponse asked;
    const absl::Status status = Call(&Stub::PlanProgram, *stub_, request, asked);
    EXPECT_TRUE(status.ok()) << status;
    v1::GetPlanRequest get;
    get.set_plan_id(asked.plan_id());
    v1::GetPlanResponse plan;
    EXPECT_TRUE(test::Eventually([&] {
      plan.Clear();
      EXPECT_TRUE(Call(&Stub::GetPlan, *stub_, get, plan).ok());
      return plan.operation().state() != type::v1::OPERATION_STATE_RUNNING;
    }));
    return plan;
  }

  absl::Status ExportAll(const v1::ExportRequest& request, std::string& text) {
    grpc::ClientContext context;
    SetDeadline(context, 60.0);
    const auto stream = stub_->Export(&context, request);
    text.clear();
    for (v1::ExportPiece piece; stream->Read(&piece);) {
      text += piece.content();
    }
    return lambdajet::FromWire(stream->Finish());
  }

  Metrics metrics_;
  std::shared_ptr<const MachineDescription> machine_;
  std::uint64_t streamed_ = 0;
  PlanDesk desk_;
  TrajectoryRpc rpc_;
  RpcServer server_;
  std::shared_ptr<grpc::Channel> channel_;
  std::unique_ptr<Stub> stub_;
};

}  // namespace lambdajet::trajectory
