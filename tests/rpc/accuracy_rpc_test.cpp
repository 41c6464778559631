// AccuracyService over real gRPC: answers as the core gives them, and bad input met with statuses and answers only.
#include "accuracy/rpc/accuracy_rpc.hpp"

#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <limits>

#include "accuracy/core/prediction.hpp"
#include "foundation/contract/trouble.hpp"
#include "platform/machine_file/machine_file.hpp"
#include "platform/rpc/channel.hpp"
#include "platform/rpc/rpc_server.hpp"
#include "platform/rpc/status_mapping.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/sample_machine.hpp"

namespace lambdajet::accuracy {
namespace {

using Stub = v1::AccuracyService::Stub;

class AccuracyService : public testing::Test {
 protected:
  AccuracyService() : rpc_([this] { return machine_; }), server_({}, nullptr, nullptr) {
    const auto machine = ReadMachineFile(test::SourceDir() + "/deploy/config/machine.yaml");
    EXPECT_TRUE(machine.ok()) << machine.status();
    machine_ = std::make_shared<const MachineDescription>(*machine);
    server_.Add(rpc_, v1::AccuracyService::service_full_name());
    EXPECT_TRUE(server_.Start().ok());
    channel_ = *OpenChannel({.address = "127.0.0.1:" + std::to_string(server_.port())});
    stub_ = v1::AccuracyService::NewStub(channel_);
  }
  ~AccuracyService() override { server_.Shutdown(); }

  v1::PredictContourRequest Circle() {
    v1::PredictContourRequest request;
    for (const PlanSample& s : support::CirclePlan(400, 300, 60, 80, 0.004)) {
      for (const double v : {s.tau_s, s.s_mm, s.x_W_mm, s.y_W_mm, s.vx_W_mm_per_s, s.vy_W_mm_per_s,
                             s.ax_W_mm_per_s2, s.ay_W_mm_per_s2}) {
        request.add_values(v);
      }
      request.add_cutting(1);
      request.add_source_line(s.source_line);
    }
    return request;
  }
  absl::Status Predict(const v1::PredictContourRequest& request) {
    grpc::ClientContext context;
    response_.Clear();
    return FromWire(stub_->PredictContour(&context, request, &response_));
  }

  std::shared_ptr<const MachineDescription> machine_;
  AccuracyRpc rpc_;
  RpcServer server_;
  std::shared_ptr<grpc::Channel> channel_;
  std::unique_ptr<Stub> stub_;
  v1::PredictContourResponse response_;
};

TEST_F(AccuracyService, PredictsAsTheCoreDoesAndNamesItsVersion) {
  v1::PredictContourRequest request = Circle();
  request.set_draws(200);
  request.set_seed(3);
  request.set_tolerance_mm(1.0);
  ASSERT_TRUE(Predict(request).ok());
  PredictionOptions options;
  options.draws = 200;
  options.seed = 3;
  options.tolerance_mm = 1.0;
  const auto expected =
      accuracy::Predict(*machine_, support::CirclePlan(400, 300, 60, 80, 0.004), false, options);
  EXPECT_EQ(response_.reason(), "PREDICTED");
  EXPECT_DOUBLE_EQ(response_.predicted_95_mm(), expected.predicted_95_mm);
  EXPECT_DOUBLE_EQ(response_.predicted_95_linear_mm(), expected.predicted_95_linear_mm);
  EXPECT_DOUBLE_EQ(response_.conformity(), expected.conformity);
  EXPECT_EQ(response_.budget_size(), static_cast<int>(kSourceCount));
  EXPECT_EQ(response_.features_size(), 1);
  EXPECT_EQ(response_.points_size() % 6, 0);
  EXPECT_EQ(response_.model_version().machine_id(), "demo-1");
  EXPECT_EQ(response_.model_version().hash(), machine_->hash);
}

TEST_F(AccuracyService, RefusesWhatIsNoPlan) {
  EXPECT_EQ(Predict({}).code(), absl::StatusCode::kInvalidArgument);
  v1::PredictContourRequest request = Circle();
  request.set_values(13, std::numeric_limits<double>::quiet_NaN());
  absl::Status status = Predict(request);
  EXPECT_EQ(TroubleReason(status), "NOT_FINITE");
  ASSERT_FALSE(TroubleViolations(status).empty());
  EXPECT_EQ(TroubleViolations(status)[0].field, "values[13]");
  request = Circle();
  request.add_values(1.0);
  EXPECT_EQ(TroubleReason(Predict(request)), "WRONG_COUNT");
  request = Circle();
  request.set_draws(100001);
  EXPECT_EQ(Predict(request).code(), absl::StatusCode::kInvalidArgument);
  request = Circle();
  request.set_tolerance_mm(-1.0);
  EXPECT_EQ(TroubleReason(Predict(request)), "MUST_BE_POSITIVE");
}

TEST_F(AccuracyService, AnswersAPlanThatCannotBePredictedWithItsLine) {
  v1::PredictContourRequest request = Circle();
  for (int i = 0; i < request.cutting_size(); ++i) {
    request.set_values(8 * i + 3, request.values(8 * i + 3) + 9000.0);
  }
  ASSERT_TRUE(Predict(request).ok());
  EXPECT_EQ(response_.reason(), "UNREACHABLE");
  EXPECT_EQ(response_.blame_line(), 10u);
  EXPECT_EQ(response_.predicted_95_mm(), 0.0);
}

TEST_F(AccuracyService, SaysThatItHasNoMachineYet) {
  machine_ = nullptr;
  EXPECT_EQ(TroubleReason(Predict(Circle())), "NO_MACHINE_DESCRIPTION");
}

TEST_F(AccuracyService, AddsUpThePapersBudget) {
  v1::BudgetRequest request;
  for (int i = 0; i < 4; ++i) {
    request.add_shift_mm(0.2);
  }
  request.set_alpha_rad(0.29e-3);
  request.set_beta_rad(0.29e-3);
  request.set_radius_a_mm(1200);
  request.set_radius_b_mm(1200);
  request.set_drive_mm(0.38);
  request.set_jet_mm(0.18);
  v1::BudgetResponse response;
  grpc::ClientContext context;
  ASSERT_TRUE(stub_->Budget(&context, request, &response).ok());
  EXPECT_NEAR(response.base_mm(), 0.6341987017, 1e-10);
  EXPECT_NEAR(response.total_mm(), 0.76092575, 1e-8);
  request.add_shift_mm(0.2);
  grpc::ClientContext again;
  EXPECT_EQ(stub_->Budget(&again, request, &response).error_code(), grpc::StatusCode::INVALID_ARGUMENT);
}

TEST_F(AccuracyService, MapsTheSheet) {
  v1::ErrorMapRequest request;
  request.set_columns(5);
  request.set_rows(3);
  request.set_acceleration_mm_per_s2(1000.0);
  v1::ErrorMapResponse response;
  grpc::ClientContext context;
  ASSERT_TRUE(stub_->ErrorMap(&context, request, &response).ok());
  ASSERT_EQ(response.values_size(), 60);
  EXPECT_DOUBLE_EQ(response.values(56), 800.0);
  EXPECT_DOUBLE_EQ(response.values(57), 600.0);
  EXPECT_GT(response.values(58), 0.3);
  EXPECT_NEAR(response.mean_mm(), 0.4, 1e-9);
  EXPECT_EQ(response.parameters_size(), static_cast<int>(kParameterCount));
  request.set_columns(1);
  grpc::ClientContext again;
  EXPECT_EQ(stub_->ErrorMap(&again, request, &response).error_code(), grpc::StatusCode::INVALID_ARGUMENT);
}

TEST_F(AccuracyService, RefusesAnExpiredDeadline) {
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() - std::chrono::seconds(1));
  EXPECT_EQ(stub_->PredictContour(&context, Circle(), &response_).error_code(),
            grpc::StatusCode::DEADLINE_EXCEEDED);
}

}  // namespace
}  // namespace lambdajet::accuracy
