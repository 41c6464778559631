// Says how the actuators must move for the jet to move over the sheet.
//
// Model: p_DE = p_DJ - R_EW p_W - p_EW (foundation/geometry/frames.md), then the inverse of the lambda mechanism with its
// first and second time derivative. The effector runs against the jet: its acceleration is -R_EW times the jet's on the sheet.
// Frames: in W. Units: mm, s. Threads: a value, const calls pure. Cost: about 60 ns a point, no allocation.
#pragma once

#include <Eigen/Core>

#include "foundation/machine/machine_description.hpp"
#include "kinematics/core/lambda_mechanism.hpp"

namespace lambdajet::trajectory {

class SheetMotion {
 public:
  explicit SheetMotion(const MachineDescription& machine)
      : mechanism_(kinematics::LambdaMechanism::FromDescription(machine)),
        rotation_(machine.X_EW().rotation()),
        origin_(machine.X_DJ().translation_mm() - machine.X_EW().translation_mm()) {}

  Eigen::Vector2d EffectorAt(const Eigen::Vector2d& p_W_mm) const { return origin_ - rotation_ * p_W_mm; }

  kinematics::Motion EffectorMotion(const kinematics::Motion& jet_W) const {
    return {EffectorAt(jet_W.position_mm), -(rotation_ * jet_W.velocity_mm_per_s),
            -(rotation_ * jet_W.acceleration_mm_per_s2)};
  }

  kinematics::MotionAnswer Actuators(const kinematics::Motion& jet_W) const {
    return kinematics::SolveInverseMotion(mechanism_, EffectorMotion(jet_W));
  }

  kinematics::InverseAnswer Position(const Eigen::Vector2d& p_W_mm) const {
    return kinematics::SolveInverse(mechanism_, EffectorAt(p_W_mm));
  }

 private:
  kinematics::LambdaMechanism mechanism_;
  Eigen::Matrix2d rotation_;
  Eigen::Vector2d origin_;
};

}  // namespace lambdajet::trajectory
