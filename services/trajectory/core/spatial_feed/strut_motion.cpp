#include "trajectory/core/spatial_feed/strut_motion.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "kinematics/core/hexapod_singularity.hpp"

namespace lambdajet::trajectory {
namespace {

constexpr double kDegrees = 180.0 / static_cast<double>(EIGEN_PI);

double WithoutMinusZero(double value) { return std::abs(value) < 0.005 ? 0.0 : value; }

const char* UnitOf(kinematics::HexapodBound bound) {
  using kinematics::HexapodBound;
  return bound == HexapodBound::kStrutMin || bound == HexapodBound::kStrutMax ? "mm"
         : bound == HexapodBound::kSingularMargin                             ? "mm/mm"
                                                                              : "rad";
}

constexpr double kLeastMargin = 1e-6;

// A description may leave out the margin; through a singular place nothing is driven.
HexapodGeometry WithMargin(HexapodGeometry geometry) {
  geometry.limits.singular_margin = std::max(geometry.limits.singular_margin, kLeastMargin);
  return geometry;
}

// W against the tool as it stands at A0 B0 C0; its own inverse.
Eigen::Matrix3d HalfTurn() { return Eigen::Vector3d(1, -1, -1).asDiagonal(); }

}  // namespace

StrutMotion::StrutMotion(const HexapodGeometry& geometry, const Pose& X_MT_zero)

    : hexapod_(WithMargin(geometry)),
      X_MW_{X_MT_zero.p_mm, X_MT_zero.R * HalfTurn()},
      X_TP_(geometry.X_PT.Inverse()) {}

Pose StrutMotion::PlatformAt(const Eigen::Vector3d& p_W_mm, const Eigen::Quaterniond& q_W) const {
  return X_MW_ * Pose{p_W_mm, q_W.toRotationMatrix() * HalfTurn()} * X_TP_;
}

Pose StrutMotion::ToolAt(const Pose& X_MP) const {
  const Pose X_WT = X_MW_.Inverse() * X_MP * hexapod_.geometry().X_PT;
  return {X_WT.p_mm, X_WT.R * HalfTurn()};
}

StrutState StrutMotion::At(const ToolMotion& tool) const {
  const Pose X_MT = X_MW_ * Pose{tool.p_mm, tool.q.toRotationMatrix() * HalfTurn()};
  const Pose X_MP = X_MT * X_TP_;
  const Eigen::Vector3d lever = X_MT.R * X_TP_.p_mm;
  const Twist twist{X_MW_.R * tool.twist.v_mm_per_s, X_MW_.R * tool.twist.w_rad_per_s};
  const TwistRate rate{X_MW_.R * tool.rate.a_mm_per_s2, X_MW_.R * tool.rate.alpha_rad_per_s2};
  const kinematics::ActuatorMotion motion =
      kinematics::ActuatorMotionOf(hexapod_, X_MP, AtLever(twist, lever), AtLever(twist, rate, lever));
  return {kinematics::SolveInverse(hexapod_, X_MP).actuators_mm, motion.velocity_mm_per_s,
          motion.acceleration_mm_per_s2};
}

bool StrutMotion::Reaches(const Eigen::Vector3d& p_W_mm, const Eigen::Quaterniond& q_W, std::uint32_t line,
                          ProgramFault& fault) const {
  const kinematics::HexapodInverse answer =
      kinematics::SolveInverseWithMargin(hexapod_, PlatformAt(p_W_mm, q_W));
  if (answer.reason == kinematics::Reason::kSolved) {
    return true;
  }
  const RollPitchYaw r = RollPitchYaw::Of(q_W.toRotationMatrix());
  const std::string strut = answer.strut >= 0 ? " of strut " + std::to_string(answer.strut + 1) : "";
  char text[320];
  std::snprintf(
      text, sizeof text,
      "the machine cannot hold the tool at X%.3f Y%.3f Z%.3f A%.2f B%.2f C%.2f deg: beyond %s%s by %.3g %s; "
      "move the part or tilt less",
      p_W_mm.x(), p_W_mm.y(), p_W_mm.z(), WithoutMinusZero(r.roll_rad * kDegrees),
      WithoutMinusZero(r.pitch_rad * kDegrees), WithoutMinusZero(r.yaw_rad * kDegrees),
      std::string(kinematics::BoundName(answer.bound)).c_str(), strut.c_str(), answer.excess,
      UnitOf(answer.bound));
  fault = {line, 0, kinematics::ReasonName(answer.reason), "", text};
  return false;
}

}  // namespace lambdajet::trajectory
