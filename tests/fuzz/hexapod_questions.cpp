#include "tests/fuzz/hexapod_questions.hpp"

#include <cstdlib>

#include "foundation/contract/trouble.hpp"
#include "kinematics/rpc/kinematics_answers.hpp"
#include "kinematics/rpc/wire_hexapod_workspace.hpp"
#include "tests/fuzz/all_finite.hpp"
#include "tests/fuzz/fuzz_target.hpp"
#include "tests/papers/kinematics_hexapod_cases.hpp"

namespace lambdajet::fuzz {
namespace {

namespace v1 = kinematics::v1;
using kinematics::KinematicsAnswers;

void Place(const Eigen::Vector3d& p, v1::SpatialVector& wire) {
  wire.set_x_mm(p.x());
  wire.set_y_mm(p.y());
  wire.set_z_mm(p.z());
}

v1::MechanismSelection Selection() {
  v1::MechanismSelection selection;
  v1::HexapodGeometry& wire = *selection.mutable_hexapod();
  const HexapodGeometry geometry = kinematics::worked::Geometry();
  for (int j = 0; j < kStruts; ++j) {
    v1::StrutGeometry& strut = *wire.add_strut();
    Place(geometry.p_MA_mm.col(j), *strut.mutable_p_ma());
    Place(geometry.p_PB_mm.col(j), *strut.mutable_p_pb());
    if (j % 2 == 1) {
      strut.mutable_joint()->set_ez_mm(0.05);
    }
  }
  wire.set_strut_max_mm(1200);
  wire.set_singular_margin(0.1);
  wire.set_screw_lead_mm(5);
  Place({0, 0, 800}, *wire.mutable_x_mp_home()->mutable_position());
  wire.mutable_x_pt()->mutable_quaternion()->set_w(1.0);
  return selection;
}

v1::SolveInverseRequest InverseSeed() {
  v1::SolveInverseRequest request;
  *request.mutable_mechanism() = Selection();
  Place({50, 20, 830}, *request.mutable_x_mt()->mutable_position());
  request.mutable_x_mt()->mutable_krylov()->set_psi_rad(0.1);
  for (int i = 0; i < 6; ++i) {
    request.mutable_motion()->add_twist(0.1 * i);
    request.mutable_motion()->add_twist_rate(0.2 * i);
  }
  return request;
}

v1::SolveForwardRequest ForwardSeed() {
  v1::SolveForwardRequest request;
  *request.mutable_mechanism() = Selection();
  for (int i = 0; i < 6; ++i) {
    request.add_actuator_position_mm(890.0 + i);
    request.add_actuator_velocity_mm_per_s(i);
    request.add_actuator_acceleration_mm_per_s2(i);
  }
  return request;
}

v1::SolveInverseBatchRequest InverseBatchSeed() {
  v1::SolveInverseBatchRequest request;
  *request.mutable_mechanism() = Selection();
  request.set_stride(6);
  for (int i = 0; i < 60; ++i) {
    request.add_pose(i % 6 == 2 ? 800.0 : 0.05 * (i % 7));
  }
  return request;
}

v1::SolveForwardBatchRequest ForwardBatchSeed() {
  v1::SolveForwardBatchRequest request;
  *request.mutable_mechanism() = Selection();
  request.set_stride(6);
  for (int i = 0; i < 60; ++i) {
    request.add_actuator_position_mm(890.0 + i % 7);
  }
  return request;
}

template <class Request>
Request PoseSeed() {
  Request request;
  *request.mutable_mechanism() = Selection();
  Place({50, 20, 830}, *request.mutable_x_mt()->mutable_position());
  return request;
}

v1::ComputeHexapodWorkspaceRequest WorkspaceSeed() {
  v1::ComputeHexapodWorkspaceRequest request;
  *request.mutable_mechanism() = Selection();
  Place({-300, -300, 700}, *request.mutable_box_from());
  Place({300, 300, 900}, *request.mutable_box_to());
  request.set_step_mm(200);
  request.add_slice_z_mm(800);
  request.set_voxels(true);
  return request;
}

v1::ComputeServiceAreaRequest ServiceAreaSeed() {
  v1::ComputeServiceAreaRequest request;
  (*request.mutable_parameter())["tilt_rad"] = 0.3;
  (*request.mutable_parameter())["strut_min_mm"] = 450;
  (*request.mutable_parameter())["frame_bottom_ratio"] = 1.2;
  request.set_sweep_parameter("tool_length_mm");
  request.set_sweep_to(200);
  request.set_sweep_points(3);
  return request;
}

template <class Request, class Response, class Ask>
HexapodOutcome Try(const std::string& bytes, const Ask& ask) {
  HexapodOutcome outcome;
  Request request;
  if (!request.ParseFromString(bytes)) {
    return outcome;  // gRPC refuses it before it gets to us
  }
  outcome.understood = true;
  if constexpr (requires { request.has_mechanism(); }) {
    static const v1::MechanismSelection& worked = *new v1::MechanismSelection(Selection());
    if (!request.has_mechanism()) {
      *request.mutable_mechanism() = worked;
    }
  }
  Response response;
  const absl::Status status = ask(request, response);
  outcome.answered = status.ok();
  if (status.ok()) {
    Promise(AllFinite(response), "an answer holds only finite numbers");
  } else {
    Promise(!TroubleReason(status).empty(), "trouble has a reason");
  }
  return outcome;
}

absl::Status ComputeWorkspace(const kinematics::MachineSlot& slot,
                              const v1::ComputeHexapodWorkspaceRequest& request,
                              v1::ComputeHexapodWorkspaceResponse& response) {
  int rows = 0;  // a step may ask for millions of samples: give up as a client would
  return ComputeHexapodWorkspace(
      slot, request, [&rows] { return ++rows > 30; }, response);
}

}  // namespace

HexapodOutcome AskHexapod(int question, const std::string& bytes) {
  static const kinematics::MachineSlot& slot = *new kinematics::MachineSlot;
  const KinematicsAnswers answers(slot);
  switch (question) {
    case 0:
      return Try<v1::SolveInverseRequest, v1::SolveInverseResponse>(
          bytes, [&](const auto& asked, auto& answer) { return answers.SolveInverse(asked, answer); });
    case 1:
      return Try<v1::SolveForwardRequest, v1::SolveForwardResponse>(
          bytes, [&](const auto& asked, auto& answer) { return answers.SolveForward(asked, answer); });
    case 2:
      return Try<v1::SolveInverseBatchRequest, v1::SolveInverseBatchResponse>(
          bytes, [&](const auto& asked, auto& answer) { return answers.AnswerBatch(asked, answer); });
    case 3:
      return Try<v1::SolveForwardBatchRequest, v1::SolveForwardBatchResponse>(
          bytes, [&](const auto& asked, auto& answer) { return answers.AnswerBatch(asked, answer); });
    case 4:
      return Try<v1::ComputeJacobianRequest, v1::ComputeJacobianResponse>(
          bytes, [&](const auto& asked, auto& answer) { return answers.ComputeJacobian(asked, answer); });
    case 5:
      return Try<v1::ReportSingularityRequest, v1::ReportSingularityResponse>(
          bytes, [&](const auto& asked, auto& answer) { return answers.ReportSingularity(asked, answer); });
    case 6:
      return Try<v1::ComputeHexapodWorkspaceRequest, v1::ComputeHexapodWorkspaceResponse>(
          bytes, [&](const auto& asked, auto& answer) { return ComputeWorkspace(slot, asked, answer); });
    default:
      return Try<v1::ComputeServiceAreaRequest, v1::ComputeServiceAreaResponse>(
          bytes, [&](const auto& asked, auto& answer) { return answers.ComputeServiceArea(asked, answer); });
  }
}

std::string HexapodSeed(int question) {
  switch (question) {
    case 0:
      return InverseSeed().SerializeAsString();
    case 1:
      return ForwardSeed().SerializeAsString();
    case 2:
      return InverseBatchSeed().SerializeAsString();
    case 3:
      return ForwardBatchSeed().SerializeAsString();
    case 4:
      return PoseSeed<v1::ComputeJacobianRequest>().SerializeAsString();
    case 5:
      return PoseSeed<v1::ReportSingularityRequest>().SerializeAsString();
    case 6:
      return WorkspaceSeed().SerializeAsString();
    default:
      return ServiceAreaSeed().SerializeAsString();
  }
}

}  // namespace lambdajet::fuzz
