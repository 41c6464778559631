#include "kinematics/rpc/wire_spatial.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <array>
#include <cmath>
#include <limits>

#include "kinematics/core/hexapod_jacobian.hpp"
#include "kinematics/core/hexapod_singularity.hpp"
#include "kinematics/core/service_rectangle.hpp"
#include "kinematics/rpc/wire_planar.hpp"

namespace lambdajet::kinematics {
namespace {

constexpr double kLargestMm = 1e6;
constexpr double kLargestRad = 1e3;
constexpr double kUnlimitedRad = 3.15;

double AngleFromWire(double angle_rad, const std::string& field, ArgumentChecks& checks) {
  checks.InRange(field, angle_rad, -kLargestRad, kLargestRad, "rad");
  return angle_rad;
}

Eigen::Matrix3d QuaternionFromWire(const v1::Quaternion& q, const std::string& field,
                                   ArgumentChecks& checks) {
  const double norm = std::hypot(std::hypot(q.w(), q.x()), std::hypot(q.y(), q.z()));
  checks.InRange(field + ".quaternion", norm, 0.5, 2.0, "norm");
  return norm > 0.0 && std::isfinite(norm)
             ? Eigen::Quaterniond(q.w(), q.x(), q.y(), q.z()).normalized().toRotationMatrix()
             : Eigen::Matrix3d::Identity();
}

Eigen::Matrix3d MatrixFromWire(const v1::RotationMatrix& wire, const std::string& field,
                               ArgumentChecks& checks) {
  checks.CountInRange(field + ".matrix.element", static_cast<std::size_t>(wire.element_size()), 9, 9);
  if (wire.element_size() != 9) {
    return Eigen::Matrix3d::Identity();
  }
  const Eigen::Matrix3d R =
      Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(wire.element().data());
  const double fault = (R * R.transpose() - Eigen::Matrix3d::Identity()).norm();
  checks.Require(fault <= 1e-6 && R.determinant() > 0.0, field + ".matrix.element", "NOT_A_ROTATION",
                 fmt::format("differs from a rotation by {:.3g}; at most 1e-6 is right", fault));
  return R;
}

Eigen::Matrix3d RotationFromWire(const v1::SpatialPose& wire, const std::string& field,
                                 ArgumentChecks& checks) {
  switch (wire.rotation_case()) {
    case v1::SpatialPose::kKrylov:
      return KrylovAngles{AngleFromWire(wire.krylov().psi_rad(), field + ".krylov.psi_rad", checks),
                          AngleFromWire(wire.krylov().theta_rad(), field + ".krylov.theta_rad", checks),
                          AngleFromWire(wire.krylov().gamma_rad(), field + ".krylov.gamma_rad", checks)}
          .Rotation();
    case v1::SpatialPose::kRollPitchYaw:
      return RollPitchYaw{
          AngleFromWire(wire.roll_pitch_yaw().roll_rad(), field + ".roll_pitch_yaw.roll_rad", checks),
          AngleFromWire(wire.roll_pitch_yaw().pitch_rad(), field + ".roll_pitch_yaw.pitch_rad", checks),
          AngleFromWire(wire.roll_pitch_yaw().yaw_rad(), field + ".roll_pitch_yaw.yaw_rad", checks)}
          .Rotation();
    case v1::SpatialPose::kQuaternion:
      return QuaternionFromWire(wire.quaternion(), field, checks);
    case v1::SpatialPose::kMatrix:
      return MatrixFromWire(wire.matrix(), field, checks);
    case v1::SpatialPose::ROTATION_NOT_SET:
      break;
  }
  return Eigen::Matrix3d::Identity();
}

UniversalJoint JointFromWire(const v1::UniversalJoint& w) {
  UniversalJoint j;
  j.a1x_mm = w.a1x_mm();
  j.a1y_mm = w.a1y_mm();
  j.a1z_mm = w.a1z_mm();
  j.dx_rad = w.dx_rad();
  j.dz_rad = w.dz_rad();
  j.ex_mm = w.ex_mm();
  j.ez_mm = w.ez_mm();
  j.eps_rad = w.eps_rad();
  j.h_mm = w.h_mm();
  j.nu_rad = w.nu_rad();
  return j;
}

void CheckJoint(const v1::UniversalJoint& w, const std::string& field, ArgumentChecks& checks) {
  for (const double length : {w.a1x_mm(), w.a1y_mm(), w.a1z_mm(), w.ex_mm(), w.ez_mm(), w.h_mm()}) {
    checks.InRange(field, length, -100.0, 100.0, "mm");
  }
  for (const double angle : {w.dx_rad(), w.dz_rad(), w.eps_rad(), w.nu_rad()}) {
    checks.InRange(field, angle, -0.5, 0.5, "rad");
  }
}

void StrutFromWire(const v1::HexapodGeometry& wire, int j, HexapodGeometry& geometry,
                   ArgumentChecks& checks) {
  const std::string field = fmt::format("mechanism.hexapod.strut[{}]", j);
  const v1::StrutGeometry& strut = wire.strut(j);
  geometry.p_MA_mm.col(j) = FromWire(strut.p_ma(), field + ".p_MA", checks);
  geometry.p_PB_mm.col(j) = FromWire(strut.p_pb(), field + ".p_PB", checks);
  checks.InRange(field + ".length_zero_mm", strut.length_zero_mm(), -kLargestMm, kLargestMm, "mm");
  geometry.length_zero_mm[j] = strut.length_zero_mm();
  if (strut.has_joint()) {
    CheckJoint(strut.joint(), field + ".joint", checks);
    geometry.joints[static_cast<std::size_t>(j)] = JointFromWire(strut.joint());
  }
}

void LimitsFromWire(const v1::HexapodGeometry& wire, HexapodLimits& limits, ArgumentChecks& checks) {
  checks.InRange("mechanism.hexapod.strut_min_mm", wire.strut_min_mm(), 0.0, kLargestMm, "mm");
  checks.InRange("mechanism.hexapod.strut_max_mm", wire.strut_max_mm(), 0.0, kLargestMm, "mm");
  checks.InRange("mechanism.hexapod.base_cone_rad", wire.base_cone_rad(), 0.0, kUnlimitedRad, "rad");
  checks.InRange("mechanism.hexapod.platform_cone_rad", wire.platform_cone_rad(), 0.0, kUnlimitedRad, "rad");
  checks.InRange("mechanism.hexapod.singular_margin", wire.singular_margin(), 0.0, 1.0, "mm/mm");
  limits.strut_min_mm = wire.strut_min_mm();
  limits.strut_max_mm =
      wire.strut_max_mm() == 0.0 ? std::numeric_limits<double>::infinity() : wire.strut_max_mm();
  limits.base_cone_rad = wire.base_cone_rad() == 0.0 ? kUnlimitedRad : wire.base_cone_rad();
  limits.platform_cone_rad = wire.platform_cone_rad() == 0.0 ? kUnlimitedRad : wire.platform_cone_rad();
  limits.singular_margin = wire.singular_margin();
}

using Six = Eigen::Matrix<double, 6, 1>;

// Six finite numbers, or none where `may_be_absent`.
Six SixFromWire(const google::protobuf::RepeatedField<double>& wire, const std::string& field,
                bool may_be_absent, ArgumentChecks& checks) {
  if (wire.empty() && may_be_absent) {
    return Six::Zero();
  }
  checks.CountInRange(field, static_cast<std::size_t>(wire.size()), 6, 6);
  for (const double number : wire) {
    checks.InRange(field, number, -1e9, 1e9);
  }
  return wire.size() == 6 ? Six(Eigen::Map<const Six>(wire.data())) : Six(Six::Zero());
}

void SixToWire(const Eigen::Vector3d& first, const Eigen::Vector3d& second,
               google::protobuf::RepeatedField<double>& wire) {
  wire.Add(first.data(), first.data() + 3);
  wire.Add(second.data(), second.data() + 3);
}

std::string BoundMessage(const HexapodInverse& answer) {
  switch (answer.bound) {
    case HexapodBound::kStrutMin:
      return fmt::format("would be {:.4f} mm shorter than it can be; move the pose away from the base",
                         answer.excess);
    case HexapodBound::kStrutMax:
      return fmt::format("would be {:.4f} mm longer than it can be; move the pose towards the base",
                         answer.excess);
    case HexapodBound::kBaseJointCone:
      return fmt::format("would leave its cone at the base by {:.6f} rad; move the pose towards home",
                         answer.excess);
    case HexapodBound::kPlatformJointCone:
      return fmt::format("would leave its cone at the platform by {:.6f} rad; tilt less", answer.excess);
    case HexapodBound::kSingularMargin:
      return fmt::format(
          "the smallest singular value is {:.6f} mm/mm below the margin; turn the pose towards home",
          answer.excess);
    case HexapodBound::kNone:
      break;
  }
  return answer.reason == Reason::kNotConverged
             ? "its imperfect joint cannot be closed; give smaller deviations"
             : RefusalMessage(answer.reason, answer.excess);
}

void RefusalToWire(Reason reason, double excess, int strut, const std::string& message, v1::Refusal& wire) {
  wire.set_reason(ToWire(reason));
  wire.set_message(strut < 0 ? message : fmt::format("strut {}: {}", strut + 1, message));
  wire.set_excess(excess);
  wire.set_strut(static_cast<std::uint32_t>(strut + 1));
}

std::string ForwardMessage(const HexapodForward& answer) {
  switch (answer.reason) {
    case Reason::kNotConverged:
      return fmt::format(
          "no pose found in {} steps, {:.4g} mm are left; start nearer or give lengths that one has",
          answer.iterations, answer.residual_mm);
    case Reason::kModeMismatch:
      return "the pose found is another way to assemble the struts than the start's; start nearer";
    case Reason::kOutOfReach:
      return "would be 0 mm long or less; give the encoder's reading and its zero";
    default:
      return RefusalMessage(answer.reason, 0.0);
  }
}

void SetServiceNumber(const std::string& name, double value, const std::string& field,
                      ServiceAreaMachine& machine, ArgumentChecks& checks) {
  for (const ServiceNumber& number : kServiceNumbers) {
    if (name == number.name) {
      checks.InRange(field, value, -kLargestMm, kLargestMm);
      machine.*number.member = value;
      return;
    }
  }
  checks.Require(false, field, "UNKNOWN_PARAMETER",
                 "no number of the service area has this name; see service_area.hpp");
}

std::string ServiceBoundMessage(const ServiceBound& bound) {
  const std::string sentence(ServiceLimitSentence(bound.limit));
  return bound.joint == 0 ? sentence
                          : fmt::format("{}: the one on joint {}, drill tilted {}phi", sentence, bound.joint,
                                        bound.tilt_sign > 0 ? "+" : "-");
}

void RectangleToWire(const ServiceRectangle& found, v1::ServiceArea& wire) {
  const Rectangle& r = found.rectangle;
  if (!(r.area_mm2() > 0.0)) {
    return;
  }
  for (const double number : {r.x_min_mm, r.y_min_mm, r.x_max_mm, r.y_max_mm}) {
    wire.add_rectangle_mm(number);
  }
  constexpr std::array<const char*, 4> kSides = {"left", "right", "base", "table"};
  for (std::size_t i = 0; i < kSides.size(); ++i) {
    const ServiceBound& bound = found.binding[i];
    v1::RectangleSide& side = *wire.add_binding();
    side.set_side(kSides[i]);
    side.set_reason(bound.joint > 0 ? v1::REASON_ACTUATOR_LIMIT : v1::REASON_OUT_OF_REACH);
    side.set_message(ServiceBoundMessage(bound));
  }
}

}  // namespace

std::optional<Hexapod> FromWire(const v1::HexapodGeometry& wire, ArgumentChecks& checks) {
  checks.CountInRange("mechanism.hexapod.strut", static_cast<std::size_t>(wire.strut_size()), kStruts,
                      kStruts);
  checks.Require(wire.has_x_mp_home(), "mechanism.hexapod.X_MP_home", "EMPTY", "the home pose is missing");
  if (!checks.ok()) {
    return std::nullopt;
  }
  HexapodGeometry geometry;
  for (int j = 0; j < kStruts; ++j) {
    StrutFromWire(wire, j, geometry, checks);
  }
  LimitsFromWire(wire, geometry.limits, checks);
  geometry.X_MP_home = FromWire(wire.x_mp_home(), "mechanism.hexapod.X_MP_home", checks);
  if (wire.has_x_pt()) {
    geometry.X_PT = FromWire(wire.x_pt(), "mechanism.hexapod.X_PT", checks);
  }
  checks.InRange("mechanism.hexapod.screw_lead_mm", wire.screw_lead_mm(), -1000.0, 1000.0, "mm a turn");
  geometry.screw_lead_mm = wire.screw_lead_mm();
  if (!checks.ok()) {
    return std::nullopt;
  }
  LayJointFrames(geometry);
  const std::string_view fault = FaultOf(geometry);
  checks.Require(fault.empty(), "mechanism.hexapod", "BAD_GEOMETRY", std::string(fault));
  return fault.empty() ? std::optional<Hexapod>(geometry) : std::nullopt;
}

Eigen::Vector3d FromWire(const v1::SpatialVector& wire, const std::string& field, ArgumentChecks& checks) {
  checks.InRange(field + ".x_mm", wire.x_mm(), -kLargestMm, kLargestMm, "mm");
  checks.InRange(field + ".y_mm", wire.y_mm(), -kLargestMm, kLargestMm, "mm");
  checks.InRange(field + ".z_mm", wire.z_mm(), -kLargestMm, kLargestMm, "mm");
  return {wire.x_mm(), wire.y_mm(), wire.z_mm()};
}

Pose FromWire(const v1::SpatialPose& wire, const std::string& field, ArgumentChecks& checks) {
  return {FromWire(wire.position(), field + ".position", checks), RotationFromWire(wire, field, checks)};
}

void ToWire(const Eigen::Vector3d& vector_mm, v1::SpatialVector& wire) {
  wire.set_x_mm(vector_mm.x());
  wire.set_y_mm(vector_mm.y());
  wire.set_z_mm(vector_mm.z());
}

void ToWire(const Pose& pose, v1::SpatialPose& wire) {
  ToWire(pose.p_mm, *wire.mutable_position());
  const KrylovAngles angles = pose.krylov();
  wire.mutable_krylov()->set_psi_rad(angles.psi_rad);
  wire.mutable_krylov()->set_theta_rad(angles.theta_rad);
  wire.mutable_krylov()->set_gamma_rad(angles.gamma_rad);
}

void SolveToWire(const Hexapod& hexapod, const Pose& X_MT, v1::SolveInverseResponse& wire) {
  const HexapodInverse answer = SolveInverseWithMargin(hexapod, PlatformFromTool(hexapod, X_MT));
  if (answer.reason != Reason::kSolved) {
    return RefusalToWire(answer.reason, answer.excess, answer.strut, BoundMessage(answer),
                         *wire.mutable_refusal());
  }
  wire.mutable_solution()->mutable_actuator_position_mm()->Add(answer.actuators_mm.data(),
                                                               answer.actuators_mm.data() + kStruts);
}

void SolveToWire(const Hexapod& hexapod, const StrutVector& actuators_mm, const Pose& X_MT_start,
                 v1::SolveForwardResponse& wire) {
  const HexapodForward answer = SolveForward(hexapod, actuators_mm, PlatformFromTool(hexapod, X_MT_start));
  if (answer.reason != Reason::kSolved) {
    return RefusalToWire(answer.reason, 0.0, answer.strut, ForwardMessage(answer), *wire.mutable_refusal());
  }
  v1::ForwardSolution& solution = *wire.mutable_solution();
  ToWire(ToolFromPlatform(hexapod, answer.X_MP), *solution.mutable_x_mt());
  solution.set_iterations(static_cast<std::uint32_t>(answer.iterations));
  solution.set_residual_mm(answer.residual_mm);
}

void MotionToWire(const Hexapod& hexapod, const Pose& X_MT, const v1::SolveInverseRequest& request,
                  ArgumentChecks& checks, v1::SolveInverseResponse& wire) {
  const Six twist = SixFromWire(request.motion().twist(), "motion.twist", false, checks);
  const Six rate = SixFromWire(request.motion().twist_rate(), "motion.twist_rate", true, checks);
  if (!checks.ok() || !wire.has_solution()) {
    return;
  }
  const ActuatorMotionAnswer answer =
      ActuatorMotionOfTool(hexapod, PlatformFromTool(hexapod, X_MT), {twist.head<3>(), twist.tail<3>()},
                           {rate.head<3>(), rate.tail<3>()});
  if (!answer.holds) {
    return;
  }
  const ActuatorMotion& motion = answer.motion;
  v1::InverseSolution& solution = *wire.mutable_solution();
  solution.mutable_actuator_velocity_mm_per_s()->Add(motion.velocity_mm_per_s.data(),
                                                     motion.velocity_mm_per_s.data() + kStruts);
  solution.mutable_actuator_acceleration_mm_per_s2()->Add(motion.acceleration_mm_per_s2.data(),
                                                          motion.acceleration_mm_per_s2.data() + kStruts);
}

void MotionToWire(const Hexapod& hexapod, const v1::SolveForwardRequest& request, ArgumentChecks& checks,
                  v1::SolveForwardResponse& wire) {
  const ActuatorMotion actuators{
      SixFromWire(request.actuator_velocity_mm_per_s(), "actuator_velocity_mm_per_s", false, checks),
      SixFromWire(request.actuator_acceleration_mm_per_s2(), "actuator_acceleration_mm_per_s2", true,
                  checks)};
  if (!checks.ok() || !wire.has_solution()) {
    return;
  }
  ArgumentChecks own;  // what this service has written itself
  const Pose X_MP = PlatformFromTool(hexapod, FromWire(wire.solution().x_mt(), "X_MT", own));
  const ToolMotion motion = ToolMotionOf(hexapod, X_MP, actuators);
  if (!motion.holds) {
    return;
  }
  v1::SpatialMotion& out = *wire.mutable_solution()->mutable_motion();
  SixToWire(motion.twist.v_mm_per_s, motion.twist.w_rad_per_s, *out.mutable_twist());
  SixToWire(motion.rate.a_mm_per_s2, motion.rate.alpha_rad_per_s2, *out.mutable_twist_rate());
}

void ParameterNamesToWire(bool hexapod, google::protobuf::RepeatedPtrField<std::string>& wire) {
  const int count = hexapod ? kStrutParameters : kMechanismParameterCount;
  for (int i = 0; i < count; ++i) {
    *wire.Add() = hexapod ? StrutParameterName(static_cast<StrutParameter>(i))
                          : ParameterName(static_cast<Parameter>(i));
  }
}

void JacobianToWire(const Hexapod& hexapod, const Pose& X_MT, v1::ComputeJacobianResponse& wire) {
  const Pose X_MP = PlatformFromTool(hexapod, X_MT);
  const PoseJacobian J = ActuatorJacobian(hexapod, X_MP);
  if (!J.allFinite()) {
    return RefusalToWire(Reason::kSingular, 0.0, -1, "a strut has no length in this pose",
                         *wire.mutable_refusal());
  }
  const HexapodSingularity singularity = AnalyseSingularity(hexapod, X_MP);
  v1::JacobianSolution& solution = *wire.mutable_solution();
  MatrixToWire(J, *solution.mutable_j_q_x());
  MatrixToWire(ActuatorParameterJacobian(hexapod, X_MP), *solution.mutable_j_q_parameters());
  ParameterNamesToWire(true, *solution.mutable_parameter_name());
  solution.set_determinant(singularity.determinant);
  solution.set_smallest_singular_value(singularity.smallest_singular_value);
  if (std::isfinite(singularity.condition) && singularity.condition < 1e12) {
    solution.set_condition(singularity.condition);
    MatrixToWire(J.inverse().eval(), *solution.mutable_j_x_q());
  }
}

void SingularityToWire(const Hexapod& hexapod, const Pose& X_MT, v1::ReportSingularityResponse& wire) {
  const HexapodSingularity answer = AnalyseSingularity(hexapod, PlatformFromTool(hexapod, X_MT));
  if (!std::isfinite(answer.determinant)) {
    return RefusalToWire(Reason::kSingular, 0.0, -1, "a strut has no length in this pose",
                         *wire.mutable_refusal());
  }
  v1::SingularitySolution& solution = *wire.mutable_solution();
  solution.set_type(answer.signed_margin > hexapod.geometry().limits.singular_margin
                        ? v1::SINGULARITY_TYPE_REGULAR
                        : v1::SINGULARITY_TYPE_PARALLEL);
  solution.set_determinant(answer.determinant);
  solution.set_condition(std::isfinite(answer.condition) ? answer.condition : 0.0);
  solution.set_smallest_singular_value(answer.smallest_singular_value);
  solution.set_characteristic_length_mm(answer.characteristic_length_mm);
  solution.set_signed_margin(answer.signed_margin);
}

ServiceAreaMachine FromWire(const v1::ComputeServiceAreaRequest& wire, double value, ArgumentChecks& checks) {
  ServiceAreaMachine machine;
  for (const auto& [name, number] : wire.parameter()) {
    SetServiceNumber(name, number, "parameter." + name.substr(0, 64), machine, checks);
  }
  if (!wire.sweep_parameter().empty()) {
    SetServiceNumber(wire.sweep_parameter(), value, "sweep_parameter", machine, checks);
  }
  if (checks.ok()) {
    const std::string_view fault = FaultOf(machine);
    checks.Require(fault.empty(), "parameter", "BAD_GEOMETRY", std::string(fault));
  }
  return machine;
}

void ToWire(const ServiceAreaMachine& machine, double value, v1::ServiceArea& wire) {
  wire.set_parameter_value(value);
  const PaperServiceArea paper = PaperClosedForm(machine);
  if (paper.defined) {
    wire.set_paper_mm2(paper.area_mm2);
    for (const double part : {paper.s1_mm2, paper.s2_mm2, paper.s3_mm2, paper.s4_mm2}) {
      wire.add_part_mm2(part);
    }
  }
  wire.set_union_mm2(ExactArea(machine, ServiceRegion::kUnion));
  wire.set_intersection_mm2(ExactArea(machine, ServiceRegion::kIntersection));
  wire.set_single_tilt_mm2(ExactArea(machine, ServiceRegion::kSingleTilt));
  RectangleToWire(LargestServiceRectangle(machine), wire);
}

}  // namespace lambdajet::kinematics
