#include "kinematics/core/hexapod_jacobian.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <array>
#include <cmath>

namespace lambdajet::kinematics {
namespace {

// One strut as a chain from base to platform, all vectors in M.
struct StrutState {
  Eigen::Vector3d s1, s2;            // axes of the joint
  Eigen::Vector3d from_a1, from_a2;  // B - A1, B - A2
  Eigen::Vector3d u;
  Eigen::Vector3d g;
  Eigen::Vector3d turned;            // R B'
  Eigen::Matrix3d R_MA, R_Mz, R_M2;  // nominal frame, after dz, frame that carries a2 (turned by q1)
  Eigen::Matrix3d R_M3;              // frame of a3 and u (turned by eps and q2)
  double length;
};

StrutState StateOf(const Hexapod& hexapod, const Pose& X_MP, int j, const SolvedJoint& solved) {
  const HexapodGeometry& geometry = hexapod.geometry();
  const UniversalJoint& joint = geometry.joints[static_cast<std::size_t>(j)];
  StrutState state;
  state.R_MA = geometry.R_MA[static_cast<std::size_t>(j)];
  state.R_Mz = state.R_MA * RotationZ(joint.dz_rad);
  const Eigen::Matrix3d R_M1 = state.R_Mz * RotationX(joint.dx_rad);
  state.R_M2 = R_M1 * RotationY(solved.q1_rad);
  const Eigen::Matrix3d R_eps = state.R_M2 * RotationZ(joint.eps_rad);
  state.R_M3 = R_eps * RotationX(solved.q2_rad);
  state.s1 = R_M1.col(1);
  state.s2 = R_eps.col(0);
  state.u = state.R_M3 * Eigen::Vector3d(std::sin(joint.nu_rad), 0.0, std::cos(joint.nu_rad));
  state.length = solved.length_mm;
  state.from_a2 = state.R_M3.col(1) * joint.h_mm + state.u * state.length;
  state.from_a1 = state.R_M2 * Eigen::Vector3d(joint.ex_mm, 0.0, joint.ez_mm) + state.from_a2;
  const Eigen::Vector3d n = state.s1.cross(state.from_a1).cross(state.s2.cross(state.from_a2));
  state.g = n / n.dot(state.u);
  state.turned = X_MP.R * geometry.p_PB_mm.col(j);
  return state;
}

std::array<StrutState, kStruts> StatesOf(const Hexapod& hexapod, const Pose& X_MP) {
  const std::array<SolvedJoint, 6> solved = SolveUniversalJoints(hexapod, X_MP);
  std::array<StrutState, kStruts> states;
  for (int j = 0; j < kStruts; ++j) {
    states[static_cast<std::size_t>(j)] = StateOf(hexapod, X_MP, j, solved[static_cast<std::size_t>(j)]);
  }
  return states;
}

double ScrewShiftPerRad(const Hexapod& hexapod) {
  return hexapod.geometry().screw_lead_mm / (2.0 * EIGEN_PI);
}

// What the chain accelerates at B with constant q1', q2', L'.
Eigen::Vector3d AccelerationAtConstantRates(const StrutState& s, const Eigen::Vector3d& v_B) {
  Eigen::Matrix3d columns;
  columns << s.s1.cross(s.from_a1), s.s2.cross(s.from_a2), s.u;
  const Eigen::Vector3d rates = columns.inverse() * v_B;
  const Eigen::Vector3d w1 = s.s1 * rates[0];
  const Eigen::Vector3d w2 = w1 + s.s2 * rates[1];
  const Eigen::Vector3d v_A2 = w1.cross(s.from_a1 - s.from_a2);
  return w1.cross(v_B) + rates[1] * (w1.cross(s.s2).cross(s.from_a2) + s.s2.cross(v_B - v_A2)) +
         rates[2] * w2.cross(s.u);
}

// d/dt of the screws' twist gradients along the motion, times the twist. The gradients are analytic; their
// change along a known motion is a central difference, whose error is the square of the step, 1e-9 relative.
StrutVector TwistBias(const Hexapod& hexapod, const Pose& X_MP, const Twist& twist) {
  const double speed = twist.v_mm_per_s.norm() / hexapod.lever_mm() + twist.w_rad_per_s.norm();
  if (speed == 0.0) {
    return StrutVector::Zero();
  }
  const double h = 3e-5 / speed;
  const auto at = [&](double t) {
    return ScrewTwistGradients(hexapod, Displaced(X_MP, t * twist.v_mm_per_s, t * twist.w_rad_per_s)).by_pose;
  };
  Eigen::Matrix<double, 6, 1> motion;
  motion << twist.v_mm_per_s, twist.w_rad_per_s;
  return (at(h) - at(-h)) / (2.0 * h) * motion;
}

// Actuator accelerations at zero acceleration of the platform.
StrutVector ActuatorBias(const Hexapod& hexapod, const Pose& X_MP, const Twist& twist) {
  const std::array<StrutState, kStruts> states = StatesOf(hexapod, X_MP);
  StrutVector bias;
  for (int j = 0; j < kStruts; ++j) {
    const StrutState& s = states[static_cast<std::size_t>(j)];
    const Eigen::Vector3d v_turn = twist.w_rad_per_s.cross(s.turned);
    const Eigen::Vector3d a_B = twist.w_rad_per_s.cross(v_turn);
    bias[j] = s.g.dot(a_B - AccelerationAtConstantRates(s, twist.v_mm_per_s + v_turn));
  }
  if (hexapod.geometry().screw_lead_mm != 0.0) {
    bias -= ScrewShiftPerRad(hexapod) * TwistBias(hexapod, X_MP, twist);
  }
  return bias;
}

double& Place(HexapodGeometry& geometry, int strut, StrutParameter parameter) {
  UniversalJoint& joint = geometry.joints[static_cast<std::size_t>(strut)];
  switch (parameter) {
    case StrutParameter::kAx:
    case StrutParameter::kAy:
    case StrutParameter::kAz:
      return geometry.p_MA_mm(static_cast<int>(parameter), strut);
    case StrutParameter::kBx:
    case StrutParameter::kBy:
    case StrutParameter::kBz:
      return geometry.p_PB_mm(static_cast<int>(parameter) - 3, strut);
    case StrutParameter::kA1x:
      return joint.a1x_mm;
    case StrutParameter::kA1y:
      return joint.a1y_mm;
    case StrutParameter::kA1z:
      return joint.a1z_mm;
    case StrutParameter::kDx:
      return joint.dx_rad;
    case StrutParameter::kDz:
      return joint.dz_rad;
    case StrutParameter::kEx:
      return joint.ex_mm;
    case StrutParameter::kEz:
      return joint.ez_mm;
    case StrutParameter::kEps:
      return joint.eps_rad;
    case StrutParameter::kH:
      return joint.h_mm;
    case StrutParameter::kNu:
      return joint.nu_rad;
    case StrutParameter::kLengthZero:
    case StrutParameter::kCount:
      break;
  }
  return geometry.length_zero_mm[strut];
}

}  // namespace

PoseJacobian ActuatorJacobian(const Hexapod& hexapod, const Pose& X_MP) {
  kernel::RawPose raw;
  Eigen::Map<Eigen::Vector3d>(raw.p) = X_MP.p_mm;
  Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(raw.R) = X_MP.R;
  kernel::Lanes gradient[6];
  if (hexapod.ideal()) {
    kernel::LengthGradients(hexapod.strut_lanes(), raw, gradient);
  } else {
    kernel::JointAngles solved;
    kernel::SolveJoints(hexapod.strut_lanes(), hexapod.joint_lanes(), raw, 8, solved);
    kernel::LengthGradientsNonIdeal(hexapod.strut_lanes(), hexapod.joint_lanes(), raw, solved, gradient);
  }
  PoseJacobian J;
  for (int c = 0; c < 6; ++c) {
    J.col(c) = Eigen::Map<const StrutVector>(gradient[c].lane);
  }
  if (hexapod.geometry().screw_lead_mm != 0.0) {
    J -= ScrewShiftPerRad(hexapod) * ScrewTwistGradients(hexapod, X_MP).by_pose;
  }
  return J;
}

PoseJacobian ActuatorJacobianKrylov(const Hexapod& hexapod, const PlatformPose& pose) {
  PoseJacobian J = ActuatorJacobian(hexapod, pose.X_MP());
  const KrylovAngles angles{pose.psi_rad, pose.theta_rad, pose.gamma_rad};
  J.rightCols<3>() = (J.rightCols<3>() * angles.AngularVelocityPerRate()).eval();
  return J;
}

std::string_view StrutParameterName(StrutParameter parameter) {
  static constexpr std::array<std::string_view, kStrutParameters> kNames = {
      "a_x_mm",  "a_y_mm", "a_z_mm", "b_x_mm", "b_y_mm", "b_z_mm",  "length_zero_mm", "a1_x_mm", "a1_y_mm",
      "a1_z_mm", "dx_rad", "dz_rad", "ex_mm",  "ez_mm",  "eps_rad", "h_mm",           "nu_rad"};
  return kNames[static_cast<std::size_t>(parameter)];
}

double ParameterValue(const HexapodGeometry& geometry, int strut, StrutParameter parameter) {
  HexapodGeometry copy = geometry;
  return Place(copy, strut, parameter);
}

void SetParameterValue(HexapodGeometry& geometry, int strut, StrutParameter parameter, double value) {
  Place(geometry, strut, parameter) = value;
}

ParameterJacobian ActuatorParameterJacobian(const Hexapod& hexapod, const Pose& X_MP) {
  const std::array<StrutState, kStruts> states = StatesOf(hexapod, X_MP);
  ParameterJacobian J;
  for (int j = 0; j < kStruts; ++j) {
    const StrutState& s = states[static_cast<std::size_t>(j)];
    const UniversalJoint& joint = hexapod.geometry().joints[static_cast<std::size_t>(j)];
    const Eigen::Vector3d u_by_nu =
        s.R_M3 * Eigen::Vector3d(std::cos(joint.nu_rad), 0.0, -std::sin(joint.nu_rad));
    const Eigen::Vector3d g_A = s.R_MA.transpose() * s.g;
    J.row(j) << -s.g.transpose(), (X_MP.R.transpose() * s.g).transpose(), -1.0, -g_A.transpose(),
        -s.g.dot(s.R_Mz.col(0).cross(s.from_a1)), -s.g.dot(s.R_MA.col(2).cross(s.from_a1)),
        -s.g.dot(s.R_M2.col(0)), -s.g.dot(s.R_M2.col(2)), -s.g.dot(s.R_M2.col(2).cross(s.from_a2)),
        -s.g.dot(s.R_M3.col(1)), -s.g.dot(u_by_nu) * s.length;
  }
  if (hexapod.geometry().screw_lead_mm != 0.0) {
    // A reading is relative to home, so the twist at home takes its share with the other sign.
    const Pose& X_home = hexapod.geometry().X_MP_home;
    const double shift = ScrewShiftPerRad(hexapod);
    const StrutPoints here = ScrewTwistGradients(hexapod, X_MP).by_strut_M;
    const StrutPoints home = ScrewTwistGradients(hexapod, X_home).by_strut_M;
    J.leftCols<3>() += shift * (here - home).transpose();
    J.middleCols<3>(3) -= shift * (X_MP.R.transpose() * here - X_home.R.transpose() * home).transpose();
  }
  return J;
}

ActuatorMotion ActuatorMotionOf(const Hexapod& hexapod, const Pose& X_MP, const Twist& twist,
                                const TwistRate& rate) {
  const PoseJacobian J = ActuatorJacobian(hexapod, X_MP);
  Eigen::Matrix<double, 6, 1> velocity;
  velocity << twist.v_mm_per_s, twist.w_rad_per_s;
  Eigen::Matrix<double, 6, 1> acceleration;
  acceleration << rate.a_mm_per_s2, rate.alpha_rad_per_s2;
  return {J * velocity, J * acceleration + ActuatorBias(hexapod, X_MP, twist)};
}

PlatformMotion PlatformMotionOf(const Hexapod& hexapod, const Pose& X_MP, const ActuatorMotion& motion) {
  PlatformMotion answer;
  PoseJacobian J = ActuatorJacobian(hexapod, X_MP);
  J.rightCols<3>() /= hexapod.lever_mm();
  const Eigen::FullPivLU<PoseJacobian> lu(J);
  if (!J.allFinite() || lu.matrixLU().diagonal().cwiseAbs().minCoeff() < 1e-12 * lu.maxPivot()) {
    answer.reason = Reason::kSingular;
    return answer;
  }
  const Eigen::Matrix<double, 6, 1> velocity = lu.solve(motion.velocity_mm_per_s);
  answer.twist = {velocity.head<3>(), velocity.tail<3>() / hexapod.lever_mm()};
  const StrutVector bias = ActuatorBias(hexapod, X_MP, answer.twist);
  const Eigen::Matrix<double, 6, 1> acceleration = lu.solve(motion.acceleration_mm_per_s2 - bias);
  answer.rate = {acceleration.head<3>(), acceleration.tail<3>() / hexapod.lever_mm()};
  return answer;
}

ToolMotion ToolMotionOf(const Hexapod& hexapod, const Pose& X_MP, const ActuatorMotion& motion) {
  const PlatformMotion platform = PlatformMotionOf(hexapod, X_MP, motion);
  const Eigen::Vector3d lever = X_MP.R * hexapod.geometry().X_PT.p_mm;
  const ToolMotion tool{platform.reason == Reason::kSolved, AtLever(platform.twist, lever),
                        AtLever(platform.twist, platform.rate, lever)};
  const bool finite = tool.twist.v_mm_per_s.allFinite() && tool.twist.w_rad_per_s.allFinite() &&
                      tool.rate.a_mm_per_s2.allFinite() && tool.rate.alpha_rad_per_s2.allFinite();
  return tool.holds && finite ? tool : ToolMotion{};
}

ActuatorMotionAnswer ActuatorMotionOfTool(const Hexapod& hexapod, const Pose& X_MP, const Twist& twist,
                                          const TwistRate& rate) {
  const Eigen::Vector3d lever = -X_MP.R * hexapod.geometry().X_PT.p_mm;
  const ActuatorMotion motion =
      ActuatorMotionOf(hexapod, X_MP, AtLever(twist, lever), AtLever(twist, rate, lever));
  const bool finite = motion.velocity_mm_per_s.allFinite() && motion.acceleration_mm_per_s2.allFinite();
  return finite ? ActuatorMotionAnswer{true, motion} : ActuatorMotionAnswer{};
}

}  // namespace lambdajet::kinematics
