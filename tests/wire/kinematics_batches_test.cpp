// The questions of kinematics.proto that come in batches, message in, message out: every entry has its own answer, and it is
// the one that the same question alone has.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "foundation/contract/trouble.hpp"
#include "kinematics/core/swept_collision.hpp"
#include "kinematics/rpc/kinematics_answers.hpp"
#include "tests/papers/kinematics_hexapod_cases.hpp"

namespace lambdajet::kinematics {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

MachineDescription Machine() {
  MachineDescription machine;
  machine.machine_id = "test-1";
  machine.parameters.head<kMechanismParameterCount>() = IdealLambda(1200, 600, 700);
  machine.actuators[0] = machine.actuators[1] = {-1600.0, 2600.0, 1500.0, 15000.0, 400000.0};
  machine.singular_margin_mm = 20.0;
  machine.sheet_width_mm = 400.0;
  machine.sheet_height_mm = 300.0;
  return machine;
}

class KinematicsBatches : public testing::Test {
 protected:
  KinematicsBatches() { slot_.Publish(Machine()); }

  MachineSlot slot_{std::make_shared<const OwnHexapod>(
      OwnHexapod{"hexapod-1", "0123456789ab", Hexapod(worked::NonIdealGeometry())})};
  KinematicsAnswers answers_{slot_};
};

template <class Numbers>
void Append(std::initializer_list<double> numbers, Numbers& wire) {
  wire.Add(numbers.begin(), numbers.end());
}

template <class Response>
void ExpectFinite(const Response& numbers) {
  for (const double number : numbers) {
    ASSERT_TRUE(std::isfinite(number));
  }
}

TEST_F(KinematicsBatches, CarryVelocityAndAccelerationOfALambdaBothWays) {
  v1::SolveInverseBatchRequest request;
  request.set_derivatives(2);
  request.set_stride(6);
  Append({500, 700, 0, 300, 1000, -500}, *request.mutable_pose());
  Append({500, kNan, 0, 300, 1000, -500}, *request.mutable_pose());
  Append({500, 1300, 0, 300, 1000, -500}, *request.mutable_pose());
  Append({-200, 400, 10, 20, 30, 40}, *request.mutable_pose());
  v1::SolveInverseBatchResponse there;
  ASSERT_TRUE(answers_.AnswerBatch(request, there).ok());
  EXPECT_EQ(there.stride(), 6u);
  EXPECT_EQ(there.reason(1), v1::REASON_NOT_FINITE);
  EXPECT_EQ(there.reason(2), v1::REASON_OUT_OF_REACH);
  EXPECT_EQ(there.refused_count(), 2u);
  EXPECT_NEAR(there.actuator_position_mm(4), 780.872623539, 1e-8);  // mathematics of the first paper, q''
  EXPECT_NEAR(there.actuator_position_mm(5), 985.286713136, 1e-8);
  ExpectFinite(there.actuator_position_mm());
  v1::SolveForwardBatchRequest request_back;
  request_back.set_derivatives(2);
  request_back.set_stride(6);
  *request_back.mutable_actuator_position_mm() = there.actuator_position_mm();
  v1::SolveForwardBatchResponse back;
  ASSERT_TRUE(answers_.AnswerBatch(request_back, back).ok());
  for (const int entry : {0, 3}) {
    for (int i = 6 * entry; i < 6 * entry + 6; ++i) {
      EXPECT_NEAR(back.pose(i), request.pose(i), 1e-8) << i;
    }
  }
}

TEST_F(KinematicsBatches, CarryTheTwistOfAHexapodBothWaysFromAStart) {
  std::mt19937_64 random(4);
  std::uniform_real_distribution<double> shift(-80.0, 80.0), turn(-0.2, 0.2), speed(-1.0, 1.0);
  v1::SolveInverseBatchRequest request;
  request.mutable_mechanism()->set_own_hexapod(true);
  request.set_derivatives(2);
  request.set_stride(18);
  for (int i = 0; i < 50; ++i) {
    Append({shift(random), shift(random), 830 + shift(random), turn(random), turn(random), turn(random)},
           *request.mutable_pose());
    for (int k = 0; k < 12; ++k) {
      request.add_pose(speed(random));
    }
  }
  v1::SolveInverseBatchResponse there;
  ASSERT_TRUE(answers_.AnswerBatch(request, there).ok());
  ASSERT_EQ(there.refused_count(), 0u);
  EXPECT_EQ(there.model_version().machine_id(), "hexapod-1");
  EXPECT_EQ(there.model_version().hash(), "0123456789ab");
  for (const bool follow : {false, true}) {
    v1::SolveForwardBatchRequest request_back;
    *request_back.mutable_mechanism() = request.mechanism();
    request_back.set_derivatives(2);
    request_back.set_stride(18);
    request_back.set_start_from_previous(follow);
    request_back.mutable_x_mt_start()->mutable_position()->set_z_mm(820);
    *request_back.mutable_actuator_position_mm() = there.actuator_position_mm();
    v1::SolveForwardBatchResponse back;
    ASSERT_TRUE(answers_.AnswerBatch(request_back, back).ok());
    ASSERT_EQ(back.refused_count(), 0u);
    for (int i = 0; i < back.pose_size(); ++i) {
      ASSERT_NEAR(back.pose(i), request.pose(i), 1e-8) << i;
    }
  }
}

// Beyond yaw 90 degrees the struts can be assembled otherwise: home's branch is another than the one a start there finds.
TEST_F(KinematicsBatches, ForwardFromAStartFindsTheStartsBranch) {
  const Hexapod hexapod(worked::Geometry());
  const PlatformPose turned{0, 0, 800, 2.0, 0, 0};
  const HexapodInverse lengths = SolveInverse(hexapod, turned.X_MP());
  v1::SolveForwardBatchRequest request;
  request.mutable_mechanism()->set_own_hexapod(true);
  request.set_stride(6);
  for (int i = 0; i < 2; ++i) {
    request.mutable_actuator_position_mm()->Add(lengths.actuators_mm.data(), lengths.actuators_mm.data() + 6);
  }
  v1::SolveForwardBatchResponse from_home;
  ASSERT_TRUE(answers_.AnswerBatch(request, from_home).ok());
  request.mutable_x_mt_start()->mutable_position()->set_z_mm(790);
  request.mutable_x_mt_start()->mutable_krylov()->set_psi_rad(1.9);
  v1::SolveForwardBatchResponse from_there;
  ASSERT_TRUE(answers_.AnswerBatch(request, from_there).ok());
  EXPECT_EQ(from_there.reason(0), v1::REASON_SOLVED);
  EXPECT_NEAR(from_there.pose(3), 2.0, 1e-3);  // the joints of its own hexapod are imperfect
  EXPECT_TRUE(from_home.reason(0) != v1::REASON_SOLVED || std::abs(from_home.pose(3) - 2.0) > 0.5);
}

TEST_F(KinematicsBatches, OfJacobiansAndSingularitiesAreTheSingleAnswers) {
  const std::array<double, 8> poses = {500, 700, 0, 30, kNan, 1, 0, 1300};
  v1::ComputeJacobianBatchRequest jacobians;
  jacobians.set_stride(2);
  jacobians.set_parameters(true);
  jacobians.mutable_pose()->Add(poses.begin(), poses.end());
  v1::ComputeJacobianBatchResponse J;
  ASSERT_TRUE(answers_.AnswerBatch(jacobians, J).ok());
  v1::ReportSingularityBatchRequest reports;
  reports.set_stride(2);
  reports.mutable_pose()->Add(poses.begin(), poses.end());
  v1::ReportSingularityBatchResponse R;
  ASSERT_TRUE(answers_.AnswerBatch(reports, R).ok());
  EXPECT_EQ(J.reason(2), v1::REASON_NOT_FINITE);
  EXPECT_EQ(J.reason(3), v1::REASON_OUT_OF_REACH);
  EXPECT_EQ(R.refused_count(), 2u);
  EXPECT_EQ(J.parameter_name_size(), 9);
  for (int i = 0; i < 2; ++i) {
    v1::ComputeJacobianRequest one;
    one.mutable_p_de()->set_x(poses[static_cast<std::size_t>(2 * i)]);
    one.mutable_p_de()->set_y(poses[static_cast<std::size_t>(2 * i + 1)]);
    v1::ComputeJacobianResponse alone;
    ASSERT_TRUE(answers_.ComputeJacobian(one, alone).ok());
    for (int k = 0; k < 4; ++k) {
      EXPECT_EQ(J.j_q_x(4 * i + k), alone.solution().j_q_x().element(k));
    }
    for (int k = 0; k < 18; ++k) {
      EXPECT_EQ(J.j_q_parameters(18 * i + k), alone.solution().j_q_parameters().element(k));
    }
    EXPECT_EQ(R.number(6 * i + 3), alone.solution().determinant());
  }
  EXPECT_NEAR(R.number(6 + 2), 30.0, 1e-9);
}

TEST_F(KinematicsBatches, OfHexapodJacobiansAreTheSingleAnswers) {
  v1::ComputeJacobianBatchRequest request;
  request.mutable_mechanism()->set_own_hexapod(true);
  request.set_stride(6);
  request.set_parameters(true);
  Append({10, 20, 820, 0.1, 0.2, -0.1, kNan, 0, 800, 0, 0, 0}, *request.mutable_pose());
  v1::ComputeJacobianBatchResponse J;
  ASSERT_TRUE(answers_.AnswerBatch(request, J).ok());
  EXPECT_EQ(J.reason(1), v1::REASON_NOT_FINITE);
  v1::ComputeJacobianRequest one;
  *one.mutable_mechanism() = request.mechanism();
  one.mutable_x_mt()->mutable_position()->set_x_mm(10);
  one.mutable_x_mt()->mutable_position()->set_y_mm(20);
  one.mutable_x_mt()->mutable_position()->set_z_mm(820);
  one.mutable_x_mt()->mutable_krylov()->set_psi_rad(0.1);
  one.mutable_x_mt()->mutable_krylov()->set_theta_rad(0.2);
  one.mutable_x_mt()->mutable_krylov()->set_gamma_rad(-0.1);
  v1::ComputeJacobianResponse alone;
  ASSERT_TRUE(answers_.ComputeJacobian(one, alone).ok());
  for (int k = 0; k < 36; ++k) {
    EXPECT_NEAR(J.j_q_x(k), alone.solution().j_q_x().element(k), 1e-9);
  }
  for (int k = 0; k < 102; ++k) {
    EXPECT_NEAR(J.j_q_parameters(k), alone.solution().j_q_parameters().element(k), 1e-9);
    EXPECT_EQ(J.j_q_parameters(102 + k), 0.0);
  }
}

// The first paper's test chain at t = 0.3 with its arguments' derivatives.
struct Argument {
  v1::ElementaryMotion motion;
  double value, rate, acceleration;
};
std::vector<Argument> PaperChain() {
  const double t = 0.3;
  return {{v1::ELEMENTARY_MOTION_X, 100 * std::sin(2 * t), 200 * std::cos(2 * t), -400 * std::sin(2 * t)},
          {v1::ELEMENTARY_MOTION_Y, 40 * t * t, 80 * t, 80},
          {v1::ELEMENTARY_MOTION_GAMMA, 0.2 + 0.3 * t, 0.3, 0},
          {v1::ELEMENTARY_MOTION_Z, -250, 0, 0},
          {v1::ELEMENTARY_MOTION_ALPHA, 0.1 * std::sin(3 * t), 0.3 * std::cos(3 * t), -0.9 * std::sin(3 * t)},
          {v1::ELEMENTARY_MOTION_BETA, 0.05, 0, 0},
          {v1::ELEMENTARY_MOTION_X, 30 + 5 * t * t * t, 15 * t * t, 30 * t}};
}

TEST_F(KinematicsBatches, CarryAPointAlongThePapersChain) {
  v1::CarryPointRequest request;
  v1::CarryPointBatchRequest batch;
  for (const Argument& a : PaperChain()) {
    v1::ChainFactor& factor = *request.mutable_tool()->add_factor();
    factor.set_motion(a.motion);
    factor.set_value(a.value);
    factor.set_rate(a.rate);
    factor.set_rate_of_rate(a.acceleration);
    batch.add_tool(a.motion);
    Append({a.value, a.rate, a.acceleration}, *batch.mutable_sample());
  }
  request.mutable_point()->mutable_position()->set_x_mm(3);
  request.mutable_point()->mutable_position()->set_y_mm(5);
  request.mutable_point()->mutable_position()->set_z_mm(0.18);
  Append({10, 0, 1.2}, *request.mutable_point()->mutable_velocity_mm_per_s());
  Append({0, 0, 4}, *request.mutable_point()->mutable_acceleration_mm_per_s2());
  Append({3, 5, 0.18, 10, 0, 1.2, 0, 0, 4}, *batch.mutable_sample());
  const int stride = batch.sample_size();
  for (int i = 0; i < stride; ++i) {
    batch.add_sample(i == 4 ? kNan : batch.sample(i));
  }
  const std::array<double, 9> printed = {86.7261868118,   17.9529848971, -251.0804947573,
                                         171.6376811726,  36.4829804311, 1.5803999531,
                                         -221.4032335278, 86.4709873733, -0.0421355228};
  v1::CarryPointResponse one;
  ASSERT_TRUE(answers_.CarryPoint(request, one).ok());
  v1::CarryPointBatchResponse many;
  ASSERT_TRUE(answers_.AnswerBatch(batch, many).ok());
  EXPECT_NEAR(one.point().position().z_mm(), printed[2], 1e-9);
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(one.point().velocity_mm_per_s(i), printed[static_cast<std::size_t>(3 + i)], 1e-9);
    EXPECT_NEAR(one.point().acceleration_mm_per_s2(i), printed[static_cast<std::size_t>(6 + i)], 1e-9);
  }
  for (int i = 0; i < 9; ++i) {
    EXPECT_NEAR(many.point(i), printed[static_cast<std::size_t>(i)], 1e-9);
    EXPECT_EQ(many.point(9 + i), 0.0);
  }
  EXPECT_THAT(std::vector<int>(many.reason().begin(), many.reason().end()),
              testing::ElementsAre(v1::REASON_SOLVED, v1::REASON_NOT_FINITE));
}

TEST_F(KinematicsBatches, CarryAToolPointIntoThePart) {
  v1::CarryPointRequest request;
  const auto add = [](v1::Chain& chain, v1::ElementaryMotion motion, double value) {
    chain.add_factor()->set_motion(motion);
    chain.mutable_factor(chain.factor_size() - 1)->set_value(value);
  };
  add(*request.mutable_tool(), v1::ELEMENTARY_MOTION_X, 800);
  add(*request.mutable_tool(), v1::ELEMENTARY_MOTION_Y, 300);
  add(*request.mutable_tool(), v1::ELEMENTARY_MOTION_GAMMA, 0.01);
  add(*request.mutable_part(), v1::ELEMENTARY_MOTION_X, 1500);
  add(*request.mutable_part(), v1::ELEMENTARY_MOTION_Y, -20);
  add(*request.mutable_part(), v1::ELEMENTARY_MOTION_GAMMA, -0.004);
  add(*request.mutable_part(), v1::ELEMENTARY_MOTION_Z, -4);
  request.mutable_point()->mutable_position()->set_x_mm(100);
  request.mutable_point()->mutable_position()->set_y_mm(200);
  v1::CarryPointResponse response;
  ASSERT_TRUE(answers_.CarryPoint(request, response).ok());
  EXPECT_NEAR(response.point().position().x_mm(), -604.0841049683, 1e-9);
  EXPECT_NEAR(response.point().position().y_mm(), 518.5778020573, 1e-9);
  request.mutable_tool()->mutable_factor(0)->set_motion(v1::ELEMENTARY_MOTION_UNSPECIFIED);
  EXPECT_EQ(TroubleReason(answers_.CarryPoint(request, response)), "OUT_OF_RANGE");
  request.mutable_tool()->mutable_factor(0)->set_motion(v1::ELEMENTARY_MOTION_X);
  request.mutable_tool()->mutable_factor(0)->set_rate(kNan);
  EXPECT_EQ(TroubleReason(answers_.CarryPoint(request, response)), "NOT_FINITE");
  request = {};
  for (int i = 0; i < 65; ++i) {
    add(*request.mutable_tool(), v1::ELEMENTARY_MOTION_X, 1);
  }
  EXPECT_EQ(TroubleReason(answers_.CarryPoint(request, response)), "TOO_MANY");
}

TEST_F(KinematicsBatches, SumTheErrorsOfAStack) {
  v1::SumErrorsRequest request;
  v1::ErrorElement& element = *request.add_element();
  element.mutable_chain()->add_factor()->set_motion(v1::ELEMENTARY_MOTION_ALPHA);
  element.mutable_chain()->mutable_factor(0)->set_value(0.02);
  element.mutable_chain()->add_factor()->set_motion(v1::ELEMENTARY_MOTION_GAMMA);
  element.mutable_chain()->mutable_factor(1)->set_value(30 * worked::kDeg);
  request.mutable_point()->set_x_mm(2);
  request.mutable_point()->set_y_mm(-1);
  request.mutable_point()->set_z_mm(-106.2);
  Append({0.03, -0.02, 0.01, 1e-3, -5e-4, 2e-4, kNan, 0, 0, 0, 0, 0}, *request.mutable_error());
  for (int i = 0; i < 36; ++i) {
    request.add_covariance(i % 7 == 0 ? (i < 21 ? 1e-4 : 1e-6) : 0.0);
  }
  v1::SumErrorsResponse response;
  ASSERT_TRUE(answers_.AnswerBatch(request, response).ok());
  constexpr std::array<double, 6> kPrinted = {0.0294942052, 0.1164044665, 0.0087096193,
                                              0.0011160254, 0.0000629742, 0.0002012997};
  for (int i = 0; i < 6; ++i) {
    EXPECT_NEAR(response.error(i), kPrinted[static_cast<std::size_t>(i)], 6e-11);
    EXPECT_EQ(response.error(6 + i), 0.0);
  }
  EXPECT_EQ(response.reason(1), v1::REASON_NOT_FINITE);
  // Turns of 1 mrad at a lever of 106.2 mm and shifts of 0.01 mm: the variance of x.
  ASSERT_EQ(response.covariance().element_size(), 36);
  EXPECT_NEAR(response.covariance().element(0), 1e-4 + 1e-6 * (106.2 * 106.2 + 1.0), 1e-9);
  request.mutable_covariance()->RemoveLast();
  EXPECT_EQ(TroubleReason(answers_.AnswerBatch(request, response)), "TOO_FEW");
  request.clear_element();
  EXPECT_EQ(TroubleReason(answers_.AnswerBatch(request, response)), "TOO_FEW");
}

v1::Polygon Box(double x_min, double y_min, double x_max, double y_max) {
  v1::Polygon polygon;
  Append({x_min, y_min, x_max, y_min, x_max, y_max, x_min, y_max}, *polygon.mutable_vertex_mm());
  return polygon;
}

TEST_F(KinematicsBatches, SweepTheSheetAlongEachPath) {
  v1::SweepSheetRequest request;
  *request.mutable_sheet() = Box(-50, 0, 50, 60);
  *request.add_body() = Box(300, 0, 340, 40);
  *request.add_body() = Box(300, 200, 340, 240);
  Append({0, 0, 200, 0, 400, 0}, *request.add_path()->mutable_p_de_mm());
  Append({0, 0, kNan, 0}, *request.add_path()->mutable_p_de_mm());
  Append({0, 100, 600, 100}, *request.add_path()->mutable_p_de_mm());
  v1::SweepSheetResponse response;
  ASSERT_TRUE(answers_.AnswerBatch(request, response).ok());
  ASSERT_EQ(response.path_size(), 3);
  EXPECT_TRUE(response.path(0).collides());
  EXPECT_EQ(response.path(0).stretch(), 1u);
  EXPECT_NEAR(response.path(0).p_de().x(), 250.0, 1e-5);
  EXPECT_EQ(response.path(1).reason(), v1::REASON_NOT_FINITE);
  EXPECT_FALSE(response.path(2).collides());
  EXPECT_NEAR(response.path(2).clearance_mm(), 40.0, 1e-9);
  EXPECT_EQ(response.path(2).body(), 1u);
  request.set_margin_mm(45.0);
  ASSERT_TRUE(answers_.AnswerBatch(request, response).ok());
  EXPECT_TRUE(response.path(5).collides());
  *request.mutable_body(0) = Box(340, 0, 300, 40);  // clockwise
  EXPECT_EQ(TroubleReason(answers_.AnswerBatch(request, response)), "NOT_CONVEX");
  request.clear_body();
  EXPECT_EQ(TroubleReason(answers_.AnswerBatch(request, response)), "TOO_FEW");
  request = {};
  *request.add_body() = Box(300, 0, 340, 40);
  request.add_path();
  EXPECT_EQ(TroubleReason(answers_.AnswerBatch(request, response)), "TOO_FEW");
}

TEST_F(KinematicsBatches, SweepTheMachinesOwnSheetUnlessOneIsBrought) {
  v1::SweepSheetRequest request;
  *request.add_body() = Box(1000, 0, 1100, 100);
  Append({0, 0}, *request.add_path()->mutable_p_de_mm());
  v1::SweepSheetResponse response;
  ASSERT_TRUE(answers_.AnswerBatch(request, response).ok());
  EXPECT_EQ(response.model_version().machine_id(), "test-1");
  EXPECT_NEAR(response.path(0).clearance_mm(), 600.0, 1e-9);
  request.set_machine_id("another");
  EXPECT_EQ(TroubleReason(answers_.AnswerBatch(request, response)), "UNKNOWN_MACHINE");
  const MachineSlot empty;
  request.clear_machine_id();
  EXPECT_EQ(TroubleReason(KinematicsAnswers(empty).AnswerBatch(request, response)), "NO_MACHINE_DESCRIPTION");
  *request.mutable_sheet() = Box(0, 0, 400, 300);
  EXPECT_TRUE(KinematicsAnswers(empty).AnswerBatch(request, response).ok());
}

TEST_F(KinematicsBatches, RefuseWhatIsNoBatch) {
  v1::SolveInverseBatchRequest request;
  v1::SolveInverseBatchResponse response;
  request.set_stride(4);
  Append({500, 700, 0, 0}, *request.mutable_pose());
  EXPECT_EQ(TroubleReason(answers_.AnswerBatch(request, response)), "BAD_STRIDE");
  request.set_derivatives(3);
  EXPECT_EQ(TroubleReason(answers_.AnswerBatch(request, response)), "OUT_OF_RANGE");
  request.set_derivatives(1);
  EXPECT_TRUE(answers_.AnswerBatch(request, response).ok());
  v1::ComputeJacobianBatchRequest jacobians;
  v1::ComputeJacobianBatchResponse J;
  jacobians.mutable_mechanism()->set_own_hexapod(true);
  jacobians.set_stride(6);
  EXPECT_EQ(TroubleReason(answers_.AnswerBatch(jacobians, J)), "TOO_FEW");
  jacobians.set_parameters(true);
  jacobians.mutable_pose()->Resize(6 * 10'000, 0.0);  // would be 11 MB
  EXPECT_EQ(TroubleReason(answers_.AnswerBatch(jacobians, J)), "TOO_MANY");
  v1::CarryPointBatchRequest points;
  v1::CarryPointBatchResponse carried;
  EXPECT_EQ(TroubleReason(answers_.AnswerBatch(points, carried)), "TOO_FEW");
  points.mutable_sample()->Resize(10, 0.0);
  EXPECT_EQ(TroubleReason(answers_.AnswerBatch(points, carried)), "BAD_STRIDE");
  const MachineSlot without;
  v1::SolveInverseBatchRequest hexapod;
  hexapod.mutable_mechanism()->set_own_hexapod(true);
  EXPECT_EQ(TroubleReason(KinematicsAnswers(without).AnswerBatch(hexapod, response)), "NO_HEXAPOD");
  hexapod.mutable_mechanism()->set_machine_id("another");
  EXPECT_EQ(TroubleReason(answers_.AnswerBatch(hexapod, response)), "UNKNOWN_MACHINE");
}

// Each case of bad input that a planar mechanism knows, beside good poses in one message.
TEST_F(KinematicsBatches, NameEveryPlanarRefusal) {
  const auto reasons = [&](double main, double attach, double second, v1::WorkingMode mode,
                           std::initializer_list<double> poses) {
    v1::SolveInverseBatchRequest request;
    v1::LambdaGeometry& g = *request.mutable_mechanism()->mutable_lambda();
    g.set_main_link_length_mm(main);
    g.set_attach_length_mm(attach);
    g.set_second_link_length_mm(second);
    g.set_singular_margin_mm(5.0);
    for (int i = 0; i < 2; ++i) {
      g.add_travel()->set_min_mm(-2000);
      g.mutable_travel(i)->set_max_mm(2000);
    }
    *request.mutable_working_mode() = mode;
    request.set_stride(2);
    Append(poses, *request.mutable_pose());
    v1::SolveInverseBatchResponse response;
    const absl::Status status = answers_.AnswerBatch(request, response);
    ExpectFinite(response.actuator_position_mm());
    std::vector<std::string> names;
    for (const int reason : response.reason()) {
      names.push_back(v1::Reason_Name(static_cast<v1::Reason>(reason)).substr(7));
    }
    return status.ok() ? names : std::vector<std::string>{std::string(TroubleReason(status))};
  };
  v1::WorkingMode lambda, crossed;
  lambda.set_s1(1);
  lambda.set_s2(1);
  crossed.set_s1(1);
  crossed.set_s2(-1);
  using testing::ElementsAre;
  EXPECT_THAT(reasons(1200, 600, 700, lambda,
                      {500, 700, 0, 1200.01, 0, 1200, 0, 1196, 0, 0, 0, 4.9, 0, -300, 2900, 700, kNan, 0}),
              ElementsAre("SOLVED", "OUT_OF_REACH", "SINGULAR", "SINGULAR", "SINGULAR", "SINGULAR",
                          "MODE_MISMATCH", "ACTUATOR_LIMIT", "NOT_FINITE"));
  // L2 = L3: in the crossed modes the sliders stand in one place and the link turns freely.
  EXPECT_THAT(reasons(1200, 600, 600, crossed, {500, 700, 100, 300}),
              ElementsAre("INDETERMINATE", "INDETERMINATE"));
  EXPECT_THAT(reasons(1200, 600, 600, lambda, {500, 700}), ElementsAre("SOLVED"));
  for (const double bad : {0.0, -600.0, kNan}) {
    EXPECT_THAT(reasons(1200, bad, 700, lambda, {500, 700}),
                ElementsAre(testing::AnyOf("MUST_BE_POSITIVE", "NOT_FINITE")));
    EXPECT_THAT(reasons(bad, 600, 700, lambda, {500, 700}),
                ElementsAre(testing::AnyOf("MUST_BE_POSITIVE", "NOT_FINITE")));
  }
}

}  // namespace
}  // namespace lambdajet::kinematics
