// The hexapod's half of kinematics.proto, message in, message out: motion, workspace, service area, refusals in words.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "foundation/contract/trouble.hpp"
#include "kinematics/rpc/kinematics_answers.hpp"
#include "kinematics/rpc/wire_hexapod_workspace.hpp"
#include "tests/papers/kinematics_hexapod_cases.hpp"

namespace lambdajet::kinematics {
namespace {

using testing::HasSubstr;
using worked::kDeg;
constexpr double kNoNumber = std::numeric_limits<double>::quiet_NaN();

void Place(const Eigen::Vector3d& p, v1::SpatialVector& wire) {
  wire.set_x_mm(p.x());
  wire.set_y_mm(p.y());
  wire.set_z_mm(p.z());
}

class HexapodWire : public testing::Test {
 protected:
  HexapodWire() {
    v1::HexapodGeometry& wire = *selection_.mutable_hexapod();
    const HexapodGeometry geometry = worked::NonIdealGeometry();
    for (int j = 0; j < kStruts; ++j) {
      v1::StrutGeometry& strut = *wire.add_strut();
      Place(geometry.p_MA_mm.col(j), *strut.mutable_p_ma());
      Place(geometry.p_PB_mm.col(j), *strut.mutable_p_pb());
      const UniversalJoint& joint = geometry.joints[static_cast<std::size_t>(j)];
      strut.mutable_joint()->set_a1x_mm(joint.a1x_mm);
      strut.mutable_joint()->set_a1z_mm(joint.a1z_mm);
      strut.mutable_joint()->set_dx_rad(joint.dx_rad);
      strut.mutable_joint()->set_dz_rad(joint.dz_rad);
      strut.mutable_joint()->set_ex_mm(joint.ex_mm);
      strut.mutable_joint()->set_ez_mm(joint.ez_mm);
      strut.mutable_joint()->set_eps_rad(joint.eps_rad);
      strut.mutable_joint()->set_h_mm(joint.h_mm);
      strut.mutable_joint()->set_nu_rad(joint.nu_rad);
    }
    wire.set_strut_min_mm(700);
    wire.set_strut_max_mm(1150);
    wire.set_base_cone_rad(0.6);
    Place({0, 0, 800}, *wire.mutable_x_mp_home()->mutable_position());
  }

  void SetTool() {
    Place({10, -20, 150}, *selection_.mutable_hexapod()->mutable_x_pt()->mutable_position());
    selection_.mutable_hexapod()->set_screw_lead_mm(5.0);
  }

  v1::SolveInverseRequest At(const PlatformPose& pose) const {
    v1::SolveInverseRequest request;
    *request.mutable_mechanism() = selection_;
    Place({pose.x_mm, pose.y_mm, pose.z_mm}, *request.mutable_x_mt()->mutable_position());
    v1::KrylovAngles& angles = *request.mutable_x_mt()->mutable_krylov();
    angles.set_psi_rad(pose.psi_rad);
    angles.set_theta_rad(pose.theta_rad);
    angles.set_gamma_rad(pose.gamma_rad);
    return request;
  }

  v1::SolveInverseResponse Inverse(const v1::SolveInverseRequest& request) {
    v1::SolveInverseResponse response;
    status_ = answers_.SolveInverse(request, response);
    return response;
  }

  MachineSlot slot_;
  KinematicsAnswers answers_{slot_};
  v1::MechanismSelection selection_;
  absl::Status status_;
};

TEST_F(HexapodWire, GivesTheNonIdealLengthsOfThePaper) {
  const v1::SolveInverseResponse response = Inverse(At(worked::kPoses[1]));
  ASSERT_TRUE(status_.ok()) << status_.ToString();
  ASSERT_EQ(response.solution().actuator_position_mm_size(), 6);
  EXPECT_NEAR(response.solution().actuator_position_mm(0), 921.399207991, 1e-9);
  EXPECT_EQ(response.solution().actuator_velocity_mm_per_s_size(), 0);
}

TEST_F(HexapodWire, MotionOfATiltedToolMatchesDifferencesAndComesBack) {
  SetTool();
  const Pose X_MT = PlatformPose{60, -40, 990, 0.1, 0.2, -0.15}.X_MP();
  const Twist twist{{30, -50, 20}, {0.3, -0.2, 0.5}};
  const TwistRate rate{{100, 200, -50}, {1, -2, 0.5}};
  const auto readings = [&](double t) {
    const Pose X = Displaced(X_MT, twist.v_mm_per_s * t + rate.a_mm_per_s2 * (t * t / 2),
                             twist.w_rad_per_s * t + rate.alpha_rad_per_s2 * (t * t / 2));
    const v1::SolveInverseResponse response = Inverse(At(PlatformPose::Of(X)));
    return Eigen::Map<const StrutVector>(response.solution().actuator_position_mm().data()).eval();
  };
  v1::SolveInverseRequest request = At(PlatformPose::Of(X_MT));
  for (const Eigen::Vector3d& part : {twist.v_mm_per_s, twist.w_rad_per_s}) {
    request.mutable_motion()->mutable_twist()->Add(part.data(), part.data() + 3);
  }
  for (const Eigen::Vector3d& part : {rate.a_mm_per_s2, rate.alpha_rad_per_s2}) {
    request.mutable_motion()->mutable_twist_rate()->Add(part.data(), part.data() + 3);
  }
  const v1::SolveInverseResponse response = Inverse(request);
  ASSERT_TRUE(response.has_solution()) << status_.ToString() << response.ShortDebugString();
  const v1::InverseSolution& solution = response.solution();
  ASSERT_EQ(solution.actuator_velocity_mm_per_s_size(), 6);
  const double h = 1e-3;
  const StrutVector v = (8 * (readings(h) - readings(-h)) - (readings(2 * h) - readings(-2 * h))) / (12 * h);
  const StrutVector a =
      (16 * (readings(h) + readings(-h)) - (readings(2 * h) + readings(-2 * h)) - 30 * readings(0)) /
      (12 * h * h);
  for (int j = 0; j < kStruts; ++j) {
    EXPECT_NEAR(solution.actuator_velocity_mm_per_s(j), v[j], 1e-7);
    EXPECT_NEAR(solution.actuator_acceleration_mm_per_s2(j), a[j], 1e-4);
  }
  v1::SolveForwardRequest back;
  *back.mutable_mechanism() = selection_;
  *back.mutable_actuator_position_mm() = solution.actuator_position_mm();
  *back.mutable_actuator_velocity_mm_per_s() = solution.actuator_velocity_mm_per_s();
  *back.mutable_actuator_acceleration_mm_per_s2() = solution.actuator_acceleration_mm_per_s2();
  v1::SolveForwardResponse forward;
  ASSERT_TRUE(answers_.SolveForward(back, forward).ok());
  ASSERT_EQ(forward.solution().motion().twist_size(), 6) << forward.ShortDebugString();
  EXPECT_NEAR(forward.solution().x_mt().position().z_mm(), 990, 1e-9);
  for (int i = 0; i < 6; ++i) {
    EXPECT_NEAR(forward.solution().motion().twist(i), request.motion().twist(i), 1e-9);
    EXPECT_NEAR(forward.solution().motion().twist_rate(i), request.motion().twist_rate(i), 1e-7);
  }
}

TEST_F(HexapodWire, RefusalsNameStrutBoundAndCure) {
  const v1::Refusal high = Inverse(At({0, 0, 1200, 0, 0, 0})).refusal();
  EXPECT_EQ(high.reason(), v1::REASON_ACTUATOR_LIMIT);
  EXPECT_THAT(high.message(), HasSubstr("longer than it can be"));
  EXPECT_GE(high.strut(), 1u);
  EXPECT_GT(high.excess(), 0.0);
  EXPECT_THAT(Inverse(At({0, 0, 500, 0, 0, 0})).refusal().message(), HasSubstr("shorter than it can be"));
  selection_.mutable_hexapod()->set_base_cone_rad(0.3);
  const v1::Refusal aside = Inverse(At({450, 0, 720, 0, 0, 0})).refusal();
  EXPECT_EQ(aside.reason(), v1::REASON_JOINT_LIMIT) << aside.ShortDebugString();
  EXPECT_THAT(aside.message(), HasSubstr("cone at the base"));
  selection_.mutable_hexapod()->set_singular_margin(0.9);
  EXPECT_THAT(Inverse(At({0, 0, 800, 0, 0, 0})).refusal().message(), HasSubstr("below the margin"));

  v1::SolveForwardRequest forward;
  *forward.mutable_mechanism() = selection_;
  for (const double reading : {890.0, 890.0, 890.0, 5000.0, 890.0, 890.0}) {
    forward.add_actuator_position_mm(reading);
  }
  v1::SolveForwardResponse response;
  ASSERT_TRUE(answers_.SolveForward(forward, response).ok());
  EXPECT_EQ(response.refusal().reason(), v1::REASON_NOT_CONVERGED);
  EXPECT_THAT(response.refusal().message(), HasSubstr("mm are left"));
}

TEST_F(HexapodWire, AMixedBatchAnswersEachPose) {
  v1::SolveInverseBatchRequest request;
  *request.mutable_mechanism() = selection_;
  request.set_stride(6);
  for (const double number : {0., 0., 800., 0., 0., 0.,    kNoNumber, 0., 800., 0.,  0., 0.,   0., 0., 1e300,
                              0., 0., 0.,   0., 0., 1500., 0.,        0., 0.,   10., 0., 820., .1, .1, .1}) {
    request.add_pose(number);
  }
  v1::SolveInverseBatchResponse response;
  ASSERT_TRUE(answers_.AnswerBatch(request, response).ok());
  ASSERT_EQ(response.reason_size(), 5);
  EXPECT_EQ(response.reason(0), v1::REASON_SOLVED);
  EXPECT_EQ(response.reason(1), v1::REASON_NOT_FINITE);
  EXPECT_NE(response.reason(2), v1::REASON_SOLVED);
  EXPECT_EQ(response.reason(3), v1::REASON_ACTUATOR_LIMIT);
  EXPECT_EQ(response.reason(4), v1::REASON_SOLVED);
  EXPECT_EQ(response.refused_count(), 3u);
  for (const double number : response.actuator_position_mm()) {
    EXPECT_TRUE(std::isfinite(number));
  }
}

v1::ComputeHexapodWorkspaceRequest WorkspaceRequest(const v1::MechanismSelection& selection) {
  v1::ComputeHexapodWorkspaceRequest request;
  *request.mutable_mechanism() = selection;
  Place({-600, -600, 600}, *request.mutable_box_from());
  Place({600, 600, 1100}, *request.mutable_box_to());
  request.set_step_mm(50);
  request.add_slice_z_mm(800);
  request.set_voxels(true);
  return request;
}

TEST_F(HexapodWire, WorkspaceAsSlicesAndVoxels) {
  v1::ComputeHexapodWorkspaceResponse response;
  const absl::Status status = ComputeHexapodWorkspace(slot_, WorkspaceRequest(selection_), {}, response);
  ASSERT_TRUE(status.ok()) << status.ToString();
  ASSERT_EQ(response.slice_size(), 1);
  const v1::HexapodSlice& slice = response.slice(0);
  EXPECT_GT(slice.area_mm2(), 1e5);
  ASSERT_EQ(slice.span_size() % 3, 0);
  EXPECT_EQ(slice.bound_size(), slice.span_size() / 3 * 2);
  const v1::HexapodVoxels& voxels = response.voxels();
  EXPECT_EQ(voxels.reason().size(), voxels.count_x() * voxels.count_y() * voxels.count_z());
  EXPECT_GT(voxels.volume_mm3(), 1e7);
}

TEST_F(HexapodWire, WorkspaceRequestsThatAreNoneAreRefused) {
  const auto reason = [&](const v1::ComputeHexapodWorkspaceRequest& request) {
    v1::ComputeHexapodWorkspaceResponse response;
    return TroubleReason(ComputeHexapodWorkspace(slot_, request, {}, response));
  };
  auto request = WorkspaceRequest(selection_);
  request.set_step_mm(0.01);
  EXPECT_EQ(reason(request), "TOO_FINE");
  request = WorkspaceRequest(selection_);
  request.set_step_mm(kNoNumber);
  EXPECT_EQ(reason(request), "NOT_FINITE");
  request = WorkspaceRequest(selection_);
  request.mutable_box_to()->set_x_mm(-900);
  EXPECT_NE(reason(request), "");
  request = WorkspaceRequest(selection_);
  request.mutable_mechanism()->mutable_lambda()->set_main_link_length_mm(1200);
  request.mutable_mechanism()->mutable_lambda()->set_attach_length_mm(600);
  request.mutable_mechanism()->mutable_lambda()->set_second_link_length_mm(700);
  EXPECT_EQ(reason(request), "WRONG_MECHANISM");
  v1::ComputeHexapodWorkspaceResponse response;
  EXPECT_EQ(ComputeHexapodWorkspace(
                slot_, WorkspaceRequest(selection_), [] { return true; }, response)
                .code(),
            absl::StatusCode::kCancelled);
}

TEST_F(HexapodWire, ServiceAreaIsThePapersAndTheExactOne) {
  v1::ComputeServiceAreaRequest request;
  (*request.mutable_parameter())["tilt_rad"] = 15 * kDeg;
  v1::ComputeServiceAreaResponse response;
  ASSERT_TRUE(answers_.ComputeServiceArea(request, response).ok());
  ASSERT_EQ(response.area_size(), 1);
  EXPECT_NEAR(response.area(0).paper_mm2(), 923218.311903975, 1e-6);
  EXPECT_NEAR(response.area(0).intersection_mm2(), 728544.75236, 1e-5);
  EXPECT_NEAR(response.area(0).union_mm2(), 984171.47748, 1e-5);
}

}  // namespace
}  // namespace lambdajet::kinematics
