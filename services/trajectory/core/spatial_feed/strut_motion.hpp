// Says how the struts must move for the tool to move over the part, and why they cannot where they cannot.
//
// Model: X_MT = X_MT_zero * (W turned by half a turn about x) * X_WT: a program's z points from the part to the spindle, the
// tool's z from the spindle to the part. Then the hexapod's inverse with its first and second derivative.
// Frames: W, M base, P platform, T tool. Units: mm, rad, s. Threads: const calls pure. Cost: 2 us a point with its motion,
// 6 us its reach; no allocation.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "foundation/machine/hexapod_motion.hpp"
#include "kinematics/core/hexapod.hpp"
#include "kinematics/core/hexapod_jacobian.hpp"
#include "trajectory/core/part_program/operation.hpp"

namespace lambdajet::trajectory {

// The tip and the tool's rotation, written in W; the rotation is that of the programmed rotary words.
struct ToolMotion {
  Eigen::Vector3d p_mm = Eigen::Vector3d::Zero();
  Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
  Twist twist;
  TwistRate rate;
};

struct StrutState {
  StrutVector q_mm = StrutVector::Zero();  // encoder readings
  StrutVector first = StrutVector::Zero();
  StrutVector second = StrutVector::Zero();
};

class StrutMotion {
 public:
  StrutMotion(const HexapodGeometry& geometry, const Pose& X_MT_zero);

  const kinematics::Hexapod& hexapod() const { return hexapod_; }
  Pose PlatformAt(const Eigen::Vector3d& p_W_mm, const Eigen::Quaterniond& q_W) const;
  // Of the tool in W, its rotation as the rotary words mean it.
  Pose ToolAt(const Pose& X_MP) const;
  StrutState At(const ToolMotion& tool) const;
  // True where strut lengths, joint cones and singular margin hold; else the fault says which and by how much.
  bool Reaches(const Eigen::Vector3d& p_W_mm, const Eigen::Quaterniond& q_W, std::uint32_t line,
               ProgramFault& fault) const;

 private:
  kinematics::Hexapod hexapod_;
  Pose X_MW_;
  Pose X_TP_;
};

}  // namespace lambdajet::trajectory
