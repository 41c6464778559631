// Differentiates the actuator readings of a hexapod by its pose and by every parameter, and carries motion
// both ways.
//
// Model: seed paper 004, equation (1): dL_j = g_j . dC + (R B'_j x g_j) . w, with g_j = u_j = (C + R B'_j -
// A_j) / L_j for an ideal joint and g_j = n / (n . u) for an imperfect one (universal_joint.hpp). Parameters
// by the implicit function theorem: dL/dp = -g . dB/dp at fixed angles and length. Accelerations: L'' = g .
// (a_B - a chain's own acceleration at constant rates). A screw's share (hexapod.hpp) is included everywhere.
// Frames: shifts of C and turns written in M. Units: mm, rad, s. Shapes: row j is strut j.
// Validity: L > 0. Threads: any. Cost: below a microsecond (parameters of imperfect joints: a few); no
// allocation.
#pragma once

#include <Eigen/Core>

#include "kinematics/core/hexapod.hpp"

namespace lambdajet::kinematics {

using PoseJacobian = Eigen::Matrix<double, 6, 6>;

// d(actuators) / d(shift of C in M [mm], turn in M [rad]).
PoseJacobian ActuatorJacobian(const Hexapod& hexapod, const Pose& X_MP);

// The same by x, y, z, psi, theta, gamma. Its determinant is -cos(theta) times the other's.
PoseJacobian ActuatorJacobianKrylov(const Hexapod& hexapod, const PlatformPose& pose);

// The parameters of one strut. A and a1 shift the same point, A written in M and a1 in the joint's frame.
enum class StrutParameter {
  kAx,
  kAy,
  kAz,  // A_j in M
  kBx,
  kBy,
  kBz,          // B'_j in P
  kLengthZero,  // l0
  kA1x,
  kA1y,
  kA1z,
  kDx,
  kDz,
  kEx,
  kEz,
  kEps,
  kH,
  kNu,  // UniversalJoint, in its order
  kCount
};
inline constexpr int kStrutParameters = static_cast<int>(StrutParameter::kCount);
std::string_view StrutParameterName(StrutParameter parameter);  // unit last
double ParameterValue(const HexapodGeometry& geometry, int strut, StrutParameter parameter);
void SetParameterValue(HexapodGeometry& geometry, int strut, StrutParameter parameter, double value);

// Element (j, p): reading of actuator j by parameter p of strut j. No strut depends on another's parameters.
using ParameterJacobian = Eigen::Matrix<double, kStruts, kStrutParameters>;
ParameterJacobian ActuatorParameterJacobian(const Hexapod& hexapod, const Pose& X_MP);

struct ActuatorMotion {
  StrutVector velocity_mm_per_s = StrutVector::Zero();
  StrutVector acceleration_mm_per_s2 = StrutVector::Zero();
};
ActuatorMotion ActuatorMotionOf(const Hexapod& hexapod, const Pose& X_MP, const Twist& twist,
                                const TwistRate& rate);

struct PlatformMotion {
  Reason reason = Reason::kSolved;  // kSingular: the actuators do not determine the platform's motion
  Twist twist;
  TwistRate rate;
};
PlatformMotion PlatformMotionOf(const Hexapod& hexapod, const Pose& X_MP, const ActuatorMotion& motion);

// The same for the origin of the tool T. `holds` is false where the pose does not determine the motion or a number
// overflows; all is 0 then.
struct ToolMotion {
  bool holds = false;
  Twist twist;
  TwistRate rate;
};
ToolMotion ToolMotionOf(const Hexapod& hexapod, const Pose& X_MP, const ActuatorMotion& motion);
struct ActuatorMotionAnswer {
  bool holds = false;
  ActuatorMotion motion;
};
ActuatorMotionAnswer ActuatorMotionOfTool(const Hexapod& hexapod, const Pose& X_MP, const Twist& twist,
                                          const TwistRate& rate);

}  // namespace lambdajet::kinematics
