// KinematicsService over real gRPC: answers as the core gives them, and bad input met with statuses and answers only.
#include "kinematics/rpc/kinematics_service.hpp"

#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <thread>
#include <vector>

#include "foundation/contract/trouble.hpp"
#include "foundation/geometry/pose.hpp"
#include "platform/machine_file/machine_file.hpp"
#include "platform/rpc/channel.hpp"
#include "platform/rpc/rpc_server.hpp"
#include "tests/support/child_process.hpp"

namespace lambdajet::kinematics {
namespace {

using Stub = v1::KinematicsService::Stub;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

MachineDescription DemoMachine() {
  auto machine = ReadMachineFile(test::SourceDir() + "/deploy/config/machine.yaml");
  EXPECT_TRUE(machine.ok()) << machine.status();
  return *machine;
}

class KinematicsService : public testing::Test {
 protected:
  KinematicsService() : rpc_(slot_), server_({}, nullptr, nullptr) {
    slot_.Publish(DemoMachine());
    server_.Add(rpc_, v1::KinematicsService::service_full_name());
    EXPECT_TRUE(server_.Start().ok());
    ChannelOptions options;
    options.address = "127.0.0.1:" + std::to_string(server_.port());
    channel_ = *OpenChannel(options);
    stub_ = v1::KinematicsService::NewStub(channel_);
  }

  absl::Status Inverse(const v1::SolveInverseRequest& request) {
    return Call(&Stub::SolveInverse, *stub_, request, inverse_);
  }
  absl::Status InverseBatch(const v1::SolveInverseBatchRequest& request) {
    return Call(&Stub::SolveInverseBatch, *stub_, request, inverse_batch_);
  }

  v1::SolveInverseRequest At(double x, double y) {
    v1::SolveInverseRequest request;
    request.mutable_p_de()->set_x(x);
    request.mutable_p_de()->set_y(y);
    return request;
  }

  MachineSlot slot_;
  KinematicsRpc rpc_;
  RpcServer server_;
  std::shared_ptr<grpc::Channel> channel_;
  std::unique_ptr<Stub> stub_;
  v1::SolveInverseResponse inverse_;
  v1::SolveInverseBatchResponse inverse_batch_;
};

TEST_F(KinematicsService, SolvesInverseWithTheMachineOfTheDescription) {
  auto request = At(500.0, 700.0);
  request.mutable_velocity()->set_y(300.0);
  request.mutable_acceleration()->set_x(1000.0);
  request.mutable_acceleration()->set_y(-500.0);
  ASSERT_TRUE(Inverse(request).ok());
  const v1::InverseSolution& solution = inverse_.solution();
  ASSERT_EQ(solution.actuator_position_mm_size(), 2);
  EXPECT_NEAR(solution.actuator_position_mm(0), -474.6794344809, 1e-9);
  EXPECT_NEAR(solution.actuator_position_mm(1), 618.8780654087, 1e-9);
  EXPECT_NEAR(solution.actuator_acceleration_mm_per_s2(0), 780.872623539, 1e-9);
  EXPECT_NEAR(solution.margins().parallel_mm(), 700.0, 1e-9);
  EXPECT_EQ(inverse_.model_version().machine_id(), "demo-1");
  EXPECT_EQ(inverse_.model_version().hash().size(), 12u);
}

TEST_F(KinematicsService, SolvesForwardAndNamesTheModes) {
  v1::SolveForwardRequest request;
  request.add_actuator_position_mm(-474.6794344809);
  request.add_actuator_position_mm(618.8780654087);
  request.add_actuator_velocity_mm_per_s(10.0);
  request.add_actuator_velocity_mm_per_s(10.0);
  v1::SolveForwardResponse response;
  ASSERT_TRUE(Call(&Stub::SolveForward, *stub_, request, response).ok());
  EXPECT_NEAR(response.solution().p_de().x(), 500.0, 1e-9);
  EXPECT_NEAR(response.solution().p_de().y(), 700.0, 1e-9);
  EXPECT_EQ(response.solution().working_mode().s1(), 1);
  EXPECT_NEAR(response.solution().velocity().x(), 10.0, 1e-9);
  EXPECT_NEAR(response.solution().velocity().y(), 0.0, 1e-9);
}

TEST_F(KinematicsService, RefusesAPoseOutOfReachAsAnAnswerWithNumbers) {
  ASSERT_TRUE(Inverse(At(0.0, 1234.5)).ok());
  EXPECT_EQ(inverse_.refusal().reason(), v1::REASON_OUT_OF_REACH);
  EXPECT_NEAR(inverse_.refusal().excess(), 34.5, 1e-9);
  EXPECT_THAT(inverse_.refusal().message(), testing::HasSubstr("34.5"));
}

TEST_F(KinematicsService, SolvesAGeometryOfTheClient) {
  auto request = At(500.0, 700.0);
  v1::BiglideGeometry& biglide = *request.mutable_mechanism()->mutable_biglide();
  biglide.set_first_link_length_mm(1200.0);
  biglide.set_second_link_length_mm(1000.0);
  ASSERT_TRUE(Inverse(request).ok());
  EXPECT_NEAR(inverse_.solution().actuator_position_mm(1), 1214.1428428543, 1e-9);
  const std::string hash = inverse_.model_version().hash();
  EXPECT_EQ(hash.size(), 12u);
  biglide.set_second_link_length_mm(1001.0);
  ASSERT_TRUE(Inverse(request).ok());
  EXPECT_NE(inverse_.model_version().hash(), hash);
}

v1::HexapodGeometry WorkedHexapod() {
  v1::HexapodGeometry g;
  const double base[6] = {-10, 10, 110, 130, 230, 250};
  const double platform[6] = {-50, 50, 70, 170, 190, 290};
  const double deg = std::acos(-1.0) / 180.0;
  for (int j = 0; j < 6; ++j) {
    v1::StrutGeometry& strut = *g.add_strut();
    strut.mutable_p_ma()->set_x_mm(600.0 * std::cos(base[j] * deg));
    strut.mutable_p_ma()->set_y_mm(600.0 * std::sin(base[j] * deg));
    strut.mutable_p_pb()->set_x_mm(250.0 * std::cos(platform[j] * deg));
    strut.mutable_p_pb()->set_y_mm(250.0 * std::sin(platform[j] * deg));
    strut.mutable_p_pb()->set_z_mm(-25.0);
  }
  g.mutable_x_mp_home()->mutable_position()->set_z_mm(800.0);
  return g;
}

TEST_F(KinematicsService, SolvesAHexapodBothWaysInEveryRotationConvention) {
  const double deg = std::acos(-1.0) / 180.0;
  v1::SolveInverseRequest request;
  *request.mutable_mechanism()->mutable_hexapod() = WorkedHexapod();
  v1::SpatialPose& pose = *request.mutable_x_mt();
  pose.mutable_position()->set_x_mm(100.0);
  pose.mutable_position()->set_y_mm(-50.0);
  pose.mutable_position()->set_z_mm(850.0);
  pose.mutable_krylov()->set_psi_rad(10.0 * deg);
  pose.mutable_krylov()->set_theta_rad(-5.0 * deg);
  pose.mutable_krylov()->set_gamma_rad(8.0 * deg);
  ASSERT_TRUE(Inverse(request).ok());
  ASSERT_EQ(inverse_.solution().actuator_position_mm_size(), 6);
  EXPECT_NEAR(inverse_.solution().actuator_position_mm(0), 921.395482749, 1e-9);
  EXPECT_NEAR(inverse_.solution().actuator_position_mm(5), 929.016417425, 1e-9);
  const v1::InverseSolution by_krylov = inverse_.solution();
  const KrylovAngles angles{10.0 * deg, -5.0 * deg, 8.0 * deg};
  const Eigen::Quaterniond q = UnitQuaternionOf(angles.Rotation());
  pose.mutable_quaternion()->set_w(q.w());
  pose.mutable_quaternion()->set_x(q.x());
  pose.mutable_quaternion()->set_y(q.y());
  pose.mutable_quaternion()->set_z(q.z());
  ASSERT_TRUE(Inverse(request).ok());
  EXPECT_NEAR(inverse_.solution().actuator_position_mm(3), by_krylov.actuator_position_mm(3), 1e-9);
  v1::SolveForwardRequest back;
  *back.mutable_mechanism() = request.mechanism();
  *back.mutable_actuator_position_mm() = by_krylov.actuator_position_mm();
  v1::SolveForwardResponse forward;
  ASSERT_TRUE(Call(&Stub::SolveForward, *stub_, back, forward).ok());
  EXPECT_NEAR(forward.solution().x_mt().position().x_mm(), 100.0, 1e-8);
  EXPECT_NEAR(forward.solution().x_mt().krylov().theta_rad(), -5.0 * deg, 1e-11);
}

TEST_F(KinematicsService, AnswersEveryPoseOfAMixedBatch) {
  v1::SolveInverseBatchRequest request;
  request.set_stride(2);
  const double inf = std::numeric_limits<double>::infinity();
  for (const double number :
       {500.0, 700.0, 0.0, 1234.5, kNan, 700.0, 0.0, -inf, 500.0, -700.0, 9000.0, 700.0, 0.0, 3.0}) {
    request.add_pose(number);
  }
  ASSERT_TRUE(InverseBatch(request).ok());
  const std::vector<int> reasons(inverse_batch_.reason().begin(), inverse_batch_.reason().end());
  EXPECT_THAT(reasons, testing::ElementsAre(v1::REASON_SOLVED, v1::REASON_OUT_OF_REACH, v1::REASON_NOT_FINITE,
                                            v1::REASON_NOT_FINITE, v1::REASON_MODE_MISMATCH,
                                            v1::REASON_ACTUATOR_LIMIT, v1::REASON_SINGULAR));
  EXPECT_EQ(inverse_batch_.refused_count(), 6u);
  for (const double number : inverse_batch_.actuator_position_mm()) {
    EXPECT_TRUE(std::isfinite(number));
  }
}

TEST_F(KinematicsService, RefusesBatchesThatAreNone) {
  v1::SolveInverseBatchRequest request;
  request.set_stride(2);
  EXPECT_EQ(TroubleReason(InverseBatch(request)), "TOO_FEW");
  request.add_pose(1.0);
  EXPECT_EQ(TroubleReason(InverseBatch(request)), "BAD_STRIDE");
  request.set_stride(6);
  EXPECT_EQ(TroubleReason(InverseBatch(request)), "BAD_STRIDE");
  request.set_stride(2);
  request.mutable_pose()->Resize(2 * 65'537, 700.0);
  EXPECT_EQ(TroubleReason(InverseBatch(request)), "TOO_MANY");
  request.mutable_pose()->Resize(2 * 65'536, 700.0);
  EXPECT_TRUE(InverseBatch(request).ok());
  EXPECT_EQ(inverse_batch_.reason_size(), 65'536);
}

TEST_F(KinematicsService, RefusesWhatCannotBeUnderstoodWithAReason) {
  EXPECT_EQ(TroubleReason(Inverse(At(kNan, 700.0))), "NOT_FINITE");
  EXPECT_EQ(TroubleReason(Inverse(v1::SolveInverseRequest())), "EMPTY");
  auto request = At(500.0, 700.0);
  request.mutable_mechanism()->set_machine_id("another");
  EXPECT_EQ(TroubleReason(Inverse(request)), "UNKNOWN_MACHINE");
  request.mutable_mechanism()->set_machine_id("demo-1");
  request.mutable_mechanism()->set_version(99);
  EXPECT_EQ(TroubleReason(Inverse(request)), "VERSION_MISMATCH");
  request = At(500.0, 700.0);
  request.mutable_working_mode()->set_s1(3);
  EXPECT_EQ(TroubleReason(Inverse(request)), "OUT_OF_RANGE");
  v1::LambdaGeometry& lambda = *request.mutable_mechanism()->mutable_lambda();
  lambda.set_main_link_length_mm(1200.0);
  lambda.set_second_link_length_mm(700.0);
  EXPECT_EQ(TroubleReason(Inverse(request)), "MUST_BE_POSITIVE");  // no attachment length
  lambda.set_attach_length_mm(-600.0);
  EXPECT_EQ(TroubleReason(Inverse(request)), "MUST_BE_POSITIVE");
  lambda.set_attach_length_mm(kNan);
  EXPECT_THAT(TroubleReason(Inverse(request)), testing::AnyOf("MUST_BE_POSITIVE", "NOT_FINITE"));
  const absl::Status status = Inverse(request);
  ASSERT_FALSE(TroubleViolations(status).empty());
  EXPECT_EQ(TroubleViolations(status)[0].field, "mechanism.lambda.attach_length_mm");
}

TEST_F(KinematicsService, RefusesABrokenHexapodWithAReason) {
  v1::SolveInverseRequest request;
  request.mutable_x_mt()->mutable_position()->set_z_mm(800.0);
  v1::HexapodGeometry& hexapod = *request.mutable_mechanism()->mutable_hexapod();
  hexapod = WorkedHexapod();
  hexapod.mutable_strut()->RemoveLast();
  EXPECT_EQ(TroubleReason(Inverse(request)), "TOO_FEW");
  hexapod = WorkedHexapod();
  hexapod.mutable_strut(2)->mutable_p_ma()->set_x_mm(kNan);
  EXPECT_FALSE(Inverse(request).ok());
  hexapod = WorkedHexapod();
  *hexapod.mutable_strut(2)->mutable_p_ma() = v1::SpatialVector();
  hexapod.mutable_strut(2)->mutable_p_ma()->set_z_mm(0.0);
  for (auto& strut : *hexapod.mutable_strut()) {
    strut.mutable_p_pb()->Clear();
    strut.mutable_p_ma()->Clear();
    strut.mutable_p_ma()->set_z_mm(800.0);
  }
  EXPECT_EQ(TroubleReason(Inverse(request)), "BAD_GEOMETRY");  // struts without a length
  hexapod = WorkedHexapod();
  request.mutable_x_mt()->mutable_quaternion()->set_w(0.0);
  EXPECT_EQ(TroubleReason(Inverse(request)), "OUT_OF_RANGE");
  request.mutable_x_mt()->mutable_matrix()->add_element(1.0);
  EXPECT_EQ(TroubleReason(Inverse(request)), "TOO_FEW");
}

TEST_F(KinematicsService, RefusesAnExpiredDeadline) {
  v1::SolveInverseResponse response;
  EXPECT_EQ(Call(&Stub::SolveInverse, *stub_, At(500.0, 700.0), response, -1.0).code(),
            absl::StatusCode::kDeadlineExceeded);
}

TEST_F(KinematicsService, SaysThatNoMachineHasArrived) {
  const MachineSlot empty;
  const KinematicsAnswers answers(empty);
  v1::SolveInverseResponse response;
  EXPECT_EQ(TroubleReason(answers.SolveInverse(At(500.0, 700.0), response)), "NO_MACHINE_DESCRIPTION");
  auto own = At(500.0, 700.0);
  own.mutable_mechanism()->mutable_biglide()->set_first_link_length_mm(1200.0);
  own.mutable_mechanism()->mutable_biglide()->set_second_link_length_mm(1200.0);
  EXPECT_TRUE(answers.SolveInverse(own, response).ok());
}

TEST_F(KinematicsService, StreamsBatchesInOrder) {
  grpc::ClientContext context;
  SetDeadline(context, 20.0);
  auto stream = stub_->StreamInverse(&context);
  constexpr int kMessages = 50;
  std::thread writer([&] {
    for (int i = 0; i < kMessages; ++i) {
      v1::SolveInverseBatchRequest request;
      request.set_stride(2);
      for (int k = 0; k < 100; ++k) {
        request.add_pose(i);
        request.add_pose(700.0);
      }
      stream->Write(request);
    }
    stream->WritesDone();
  });
  v1::SolveInverseBatchResponse response;
  int received = 0;
  while (stream->Read(&response)) {
    ASSERT_EQ(response.reason_size(), 100);
    EXPECT_NEAR(response.actuator_position_mm(0), received - 974.6794344809, 1e-9);
    ++received;
  }
  writer.join();
  EXPECT_EQ(received, kMessages);
  EXPECT_TRUE(stream->Finish().ok());
}

// Three messages of which the second cannot be understood: an answer, then the status of the second.
template <class Request, class Response, class Open>
void ExpectAnswersInOrder(Open open, const Request& good, const std::string& reason) {
  for (const bool broken : {false, true}) {
    grpc::ClientContext context;
    SetDeadline(context, 20.0);
    auto stream = open(&context);
    stream->Write(good);
    stream->Write(broken ? Request() : good);
    stream->WritesDone();
    Response response;
    int received = 0;
    while (stream->Read(&response)) {
      EXPECT_GT(response.ByteSizeLong(), 8u);
      ++received;
    }
    EXPECT_EQ(received, broken ? 1 : 2);
    EXPECT_EQ(TroubleReason(FromWire(stream->Finish())), broken ? reason : "");
  }
}

TEST_F(KinematicsService, StreamsEveryShortQuestion) {
  v1::ComputeJacobianBatchRequest jacobians;
  v1::ReportSingularityBatchRequest reports;
  jacobians.set_stride(2);
  reports.set_stride(2);
  for (const double number : {500.0, 700.0, 100.0, 300.0}) {
    jacobians.add_pose(number);
    reports.add_pose(number);
  }
  v1::CarryPointBatchRequest points;
  points.add_tool(v1::ELEMENTARY_MOTION_GAMMA);
  points.mutable_sample()->Resize(2 * 12, 1.0);
  v1::SumErrorsRequest errors;
  errors.add_element()->mutable_chain();
  errors.mutable_error()->Resize(6, 0.1);
  v1::SweepSheetRequest sweep;
  for (const double number : {2000.0, 0.0, 2100.0, 0.0, 2100.0, 100.0}) {
    (sweep.body_size() > 0 ? sweep.mutable_body(0) : sweep.add_body())->add_vertex_mm(number);
  }
  sweep.add_path()->mutable_p_de_mm()->Resize(4, 300.0);
  ExpectAnswersInOrder<v1::ComputeJacobianBatchRequest, v1::ComputeJacobianBatchResponse>(
      [&](auto* context) { return stub_->StreamJacobian(context); }, jacobians, "BAD_STRIDE");
  ExpectAnswersInOrder<v1::ReportSingularityBatchRequest, v1::ReportSingularityBatchResponse>(
      [&](auto* context) { return stub_->StreamSingularity(context); }, reports, "BAD_STRIDE");
  ExpectAnswersInOrder<v1::CarryPointBatchRequest, v1::CarryPointBatchResponse>(
      [&](auto* context) { return stub_->StreamPoints(context); }, points, "TOO_FEW");
  ExpectAnswersInOrder<v1::SumErrorsRequest, v1::SumErrorsResponse>(
      [&](auto* context) { return stub_->StreamErrors(context); }, errors, "TOO_FEW");
  ExpectAnswersInOrder<v1::SweepSheetRequest, v1::SweepSheetResponse>(
      [&](auto* context) { return stub_->StreamSweeps(context); }, sweep, "TOO_FEW");
  v1::ComputeJacobianBatchResponse many;
  EXPECT_TRUE(Call(&Stub::ComputeJacobianBatch, *stub_, jacobians, many).ok());
  v1::SweepSheetResponse swept;
  EXPECT_TRUE(Call(&Stub::SweepSheet, *stub_, sweep, swept).ok());
}

TEST_F(KinematicsService, EndsAStreamAtABatchThatIsNone) {
  grpc::ClientContext context;
  SetDeadline(context, 20.0);
  auto stream = stub_->StreamForward(&context);
  v1::SolveForwardBatchRequest request;
  request.set_stride(5);
  stream->Write(request);
  stream->WritesDone();
  v1::SolveForwardBatchResponse response;
  EXPECT_FALSE(stream->Read(&response));
  EXPECT_EQ(TroubleReason(FromWire(stream->Finish())), "BAD_STRIDE");
}

TEST_F(KinematicsService, SurvivesAClientThatLeavesItsStream) {
  for (int i = 0; i < 20; ++i) {
    grpc::ClientContext context;
    auto stream = stub_->StreamInverse(&context);
    v1::SolveInverseBatchRequest request;
    request.set_stride(2);
    request.mutable_pose()->Resize(20'000, 700.0);
    stream->Write(request);
    context.TryCancel();
    stream->Finish();
  }
  EXPECT_TRUE(Inverse(At(500.0, 700.0)).ok());
}

TEST_F(KinematicsService, ExchangesParametersWholeUnderLoad) {
  // Two versions whose answers differ in both sliders: every answer must be one or the other.
  const MachineDescription first = DemoMachine();
  MachineDescription second = first;
  second.version = 7;
  second.value(Parameter::kSlider1ZeroMm) = 10.0;
  second.value(Parameter::kSlider2ZeroMm) = 10.0;
  std::jthread exchanger([&](std::stop_token stop) {
    for (bool even = false; !stop.stop_requested(); even = !even) {
      slot_.Publish(even ? first : second);
    }
  });
  for (int i = 0; i < 2000; ++i) {
    ASSERT_TRUE(Inverse(At(500.0, 700.0)).ok());
    const double zero = inverse_.model_version().version() == 7 ? 10.0 : 0.0;
    ASSERT_NEAR(inverse_.solution().actuator_position_mm(0), -474.6794344809 - zero, 1e-9);
    ASSERT_NEAR(inverse_.solution().actuator_position_mm(1), 618.8780654087 - zero, 1e-9);
  }
}

TEST_F(KinematicsService, GivesJacobiansToToolAndParameters) {
  v1::ComputeJacobianRequest request;
  request.mutable_p_de()->set_x(500.0);
  request.mutable_p_de()->set_y(700.0);
  v1::ComputeJacobianResponse response;
  ASSERT_TRUE(Call(&Stub::ComputeJacobian, *stub_, request, response).ok());
  EXPECT_NEAR(response.solution().determinant(), -0.647767557825, 1e-12);
  EXPECT_NEAR(response.solution().j_q_x().element(1), 0.7181848465, 1e-10);
  EXPECT_EQ(response.solution().j_q_parameters().columns(), 9u);
  EXPECT_EQ(response.solution().parameter_name(8), "slider_2_zero_mm");
}

TEST_F(KinematicsService, ReportsSingularities) {
  v1::ReportSingularityRequest request;
  request.mutable_p_de()->set_y(10.0);
  v1::ReportSingularityResponse response;
  ASSERT_TRUE(Call(&Stub::ReportSingularity, *stub_, request, response).ok());
  EXPECT_EQ(response.solution().type(), v1::SINGULARITY_TYPE_PARALLEL);
  EXPECT_NEAR(response.solution().parallel_distance_mm(), 10.0, 1e-9);
}

TEST_F(KinematicsService, ComputesTheWorkspace) {
  v1::ComputeWorkspaceResponse response;
  ASSERT_TRUE(Call(&Stub::ComputeWorkspace, *stub_, v1::ComputeWorkspaceRequest(), response).ok());
  ASSERT_EQ(response.solution().region_size(), 1);
  EXPECT_EQ(response.solution().rectangle_mm_size(), 4);
  EXPECT_EQ(response.solution().binding_size(), 4);
  EXPECT_GT(response.solution().area_mm2(), 1e6);
  v1::ComputeWorkspaceRequest hexapod;
  *hexapod.mutable_mechanism()->mutable_hexapod() = WorkedHexapod();
  EXPECT_EQ(TroubleReason(Call(&Stub::ComputeWorkspace, *stub_, hexapod, response)), "WRONG_MECHANISM");
}

TEST_F(KinematicsService, ComputesServiceAreas) {
  v1::ComputeServiceAreaRequest request;
  request.set_sweep_parameter("tilt_rad");
  request.set_sweep_from(0.05);
  request.set_sweep_to(0.4);
  request.set_sweep_points(8);
  v1::ComputeServiceAreaResponse response;
  ASSERT_TRUE(Call(&Stub::ComputeServiceArea, *stub_, request, response).ok());
  ASSERT_EQ(response.area_size(), 8);
  for (const v1::ServiceArea& area : response.area()) {
    EXPECT_LE(area.intersection_mm2(), area.single_tilt_mm2());
    EXPECT_LE(area.single_tilt_mm2(), area.union_mm2());
  }
  (*request.mutable_parameter())["no_such_mm"] = 1.0;
  EXPECT_EQ(TroubleReason(Call(&Stub::ComputeServiceArea, *stub_, request, response)), "UNKNOWN_PARAMETER");
}

TEST_F(KinematicsService, OptimisesAGeometry) {
  v1::OptimiseGeometryRequest request;
  for (const double number : {-100.0, 400.0, 500.0, 900.0}) {
    request.add_zone_mm(number);
  }
  request.set_objective(v1::OptimiseGeometryRequest::OBJECTIVE_ERROR_GAIN);
  request.set_evaluations(300);
  v1::OptimiseGeometryResponse response;
  ASSERT_TRUE(Call(&Stub::OptimiseGeometry, *stub_, request, response, 20.0).ok());
  EXPECT_EQ(response.reason(), "");
  EXPECT_LT(response.objective_after(), response.objective_before());
  request.clear_zone_mm();
  EXPECT_EQ(TroubleReason(Call(&Stub::OptimiseGeometry, *stub_, request, response)), "TOO_FEW");
}

}  // namespace
}  // namespace lambdajet::kinematics
