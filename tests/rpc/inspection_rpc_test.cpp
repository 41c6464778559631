// InspectionService over real gRPC on truth handed to the recorder: recording, gaps, comparison, path, refusals.
#include "inspection/rpc/inspection_rpc.hpp"

#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "foundation/contract/trouble.hpp"
#include "platform/rpc/channel.hpp"
#include "platform/rpc/rpc_server.hpp"
#include "platform/rpc/status_mapping.hpp"

namespace lambdajet::inspection {
namespace {

constexpr char kDrawing[] = R"(
name: hole
kerf_width_mm: 1.0
features:
  - {name: bore, kind: hole, side: inside, tolerance_mm: 0.1, outline: [{circle: {center: [100, 80], radius: 30}}]}
)";

class InspectionService : public testing::Test {
 protected:
  InspectionService() : rpc_(recorder_), server_({}, nullptr, nullptr) {
    server_.Add(rpc_, v1::InspectionService::service_full_name());
    EXPECT_TRUE(server_.Start().ok());
    channel_ = *OpenChannel({.address = "127.0.0.1:" + std::to_string(server_.port())});
    stub_ = v1::InspectionService::NewStub(channel_);
  }
  ~InspectionService() override { server_.Shutdown(); }

  absl::Status Begin(std::uint64_t plan, std::vector<std::uint64_t> further = {}) {
    v1::BeginRecordingRequest request;
    request.set_plan_id(plan);
    request.mutable_further_plan_ids()->Add(further.begin(), further.end());
    v1::BeginRecordingResponse response;
    grpc::ClientContext context;
    return FromWire(stub_->BeginRecording(&context, request, &response));
  }
  absl::Status Inspect(std::uint64_t plan, const std::string& drawing = kDrawing) {
    v1::InspectRequest request;
    request.set_plan_id(plan);
    request.set_drawing_yaml(drawing);
    grpc::ClientContext context;
    return FromWire(stub_->Inspect(&context, request, &found_));
  }

  // Cuts the hole once round in batches of ten, 1 ms each, from batch `first` to batch `last`.
  void Cut(std::uint64_t plan, int first, int last, int left_out = -1) {
    const double radius = 29.5;
    for (int b = first; b < last; ++b) {
      if (b == left_out) {
        continue;
      }
      std::array<SheetTruth, 10> sheet;
      std::array<JetTruth, 10> jet;
      for (int i = 0; i < 10; ++i) {
        const int ms = 10 * b + i;
        const double angle = 2.0 * std::numbers::pi * ms / 3500.0;
        const std::int64_t stamp = 1'000'000'000 + std::int64_t{1'000'000} * ms;
        sheet[static_cast<std::size_t>(i)] = {stamp, 400.0 - radius * std::cos(angle),
                                              500.0 - radius * std::sin(angle), 0.0};
        jet[static_cast<std::size_t>(i)] = {stamp, 500.0, 580.0};
      }
      const std::array<WaterSwitch, 1> on = {{{1'000'000'000, true}}};
      const BatchOrigin origin{7, static_cast<std::uint64_t>(b + 1), plan};
      recorder_.TakeSheet(origin, sheet);
      recorder_.TakeJet(
          origin, jet, b == 0 ? std::span<const WaterSwitch>(on) : std::span<const WaterSwitch>(), true, 0.0);
    }
  }

  Recorder recorder_;
  InspectionRpc rpc_;
  RpcServer server_;
  std::shared_ptr<grpc::Channel> channel_;
  std::unique_ptr<v1::InspectionService::Stub> stub_;
  v1::InspectResponse found_;
};

TEST_F(InspectionService, JudgesARecordedCut) {
  ASSERT_TRUE(Begin(42).ok());
  Cut(42, 0, 380);
  v1::EndRecordingRequest end;
  end.set_plan_id(42);
  v1::EndRecordingResponse ended;
  grpc::ClientContext context;
  ASSERT_TRUE(stub_->EndRecording(&context, end, &ended).ok());
  EXPECT_EQ(ended.samples(), 3800u);
  EXPECT_EQ(ended.missing(), 0u);
  ASSERT_TRUE(Inspect(42).ok());
  EXPECT_LT(found_.all().max_mm(), 1e-3);
  EXPECT_EQ(found_.all().not_cut(), 0u);
  EXPECT_TRUE(found_.all().passed());
  ASSERT_EQ(found_.features_size(), 1);
  EXPECT_NEAR(found_.features(0).circle().diameter_error_mm(), 0.0, 1e-3);
  EXPECT_EQ(found_.deviations_size(), static_cast<int>(4 * found_.all().points()));
  EXPECT_NEAR(found_.cutting_time_s(), 3.799, 1e-6);
}

TEST_F(InspectionService, SaysThatTruthIsMissing) {
  ASSERT_TRUE(Begin(42).ok());
  Cut(42, 0, 380, 100);
  v1::EndRecordingRequest end;
  end.set_plan_id(42);
  v1::EndRecordingResponse ended;
  grpc::ClientContext context;
  ASSERT_TRUE(stub_->EndRecording(&context, end, &ended).ok());
  EXPECT_EQ(ended.missing(), 20u);  // ten samples of each stream
  ASSERT_TRUE(Inspect(42).ok());
  EXPECT_EQ(found_.missing(), 20u);
}

TEST_F(InspectionService, KeepsAResumedPlanInTheSameRecording) {
  ASSERT_TRUE(Begin(42).ok());
  Cut(42, 0, 200);
  ASSERT_TRUE(Begin(42, {43}).ok());
  Cut(43, 200, 380);
  Cut(44, 380, 390);  // somebody else's
  ASSERT_TRUE(Inspect(42).ok());
  EXPECT_EQ(found_.all().not_cut(), 0u);
  EXPECT_NEAR(found_.cutting_time_s(), 3.799, 1e-6);
  ASSERT_TRUE(Begin(42).ok());  // anew
  EXPECT_EQ(TroubleReason(Inspect(42)), "NOTHING_RECORDED");
}

TEST_F(InspectionService, HandsOutThePath) {
  ASSERT_TRUE(Begin(42).ok());
  Cut(42, 0, 380);
  v1::StreamCutPathRequest request;
  request.set_plan_id(42);
  grpc::ClientContext context;
  const auto stream = stub_->StreamCutPath(&context, request);
  std::vector<double> values;
  for (v1::CutPathBatch batch; stream->Read(&batch);) {
    values.insert(values.end(), batch.values().begin(), batch.values().end());
  }
  ASSERT_TRUE(stream->Finish().ok());
  ASSERT_GE(values.size(), 4u * 3799u);
  EXPECT_NEAR(std::hypot(values[1] - 100.0, values[2] - 80.0), 29.5, 1e-9);
  EXPECT_EQ(values[3], 1.0);
  EXPECT_EQ(values.back(), 0.0);
}

TEST_F(InspectionService, RefusesWithReasons) {
  EXPECT_EQ(TroubleReason(Begin(0)), "MUST_BE_POSITIVE");
  EXPECT_EQ(TroubleReason(Inspect(5)), "NO_RECORDING");
  EXPECT_EQ(TroubleReason(Inspect(5, "features: 3")), "BAD_DRAWING");
  EXPECT_EQ(Begin(1, std::vector<std::uint64_t>(101, 2)).code(), absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace lambdajet::inspection
