#include "kinematics/bus/hexapod_wire.hpp"

#include <algorithm>
#include <array>

#include "kinematics/core/hexapod_jacobian.hpp"
#include "kinematics/core/hexapod_singularity.hpp"
#include "lambdajet/kinematics/v1/spatial_pose.h"

namespace lambdajet::kinematics {
namespace {

std::array<double, 3> Triple(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

StrutVector SixOf(const std::array<double, kStruts>& wire) {
  return Eigen::Map<const StrutVector>(wire.data());
}

}  // namespace

void HexapodFollower::ToWire(const idl::kinematics::v1::StrutReadings& readings,
                             idl::kinematics::v1::SpatialPose& wire) {
  const Hexapod& hexapod = own_.hexapod;
  wire = idl::kinematics::v1::SpatialPose();
  wire.header().time_ns(readings.header().time_ns());
  wire.model_hash(own_.hash);
  const StrutVector actuators_mm = SixOf(readings.actuator_position_mm());
  const HexapodForward pose = SolveForward(hexapod, actuators_mm, start_);
  wire.iterations(static_cast<std::uint32_t>(pose.iterations));
  wire.reason(static_cast<std::uint32_t>(pose.reason));
  if (actuators_mm.allFinite()) {
    wire.actuator_position_mm(readings.actuator_position_mm());
  }
  if (pose.reason != Reason::kSolved) {
    start_ = hexapod.geometry().X_MP_home;
    return;
  }
  start_ = pose.X_MP;
  const Pose X_MT = ToolFromPlatform(hexapod, pose.X_MP);
  const KrylovAngles angles = X_MT.krylov();
  wire.p_MT_mm(Triple(X_MT.p_mm));
  wire.krylov_rad({angles.psi_rad, angles.theta_rad, angles.gamma_rad});
  const StrutVector velocity = SixOf(readings.actuator_velocity_mm_per_s());
  const ToolMotion motion = ToolMotionOf(hexapod, pose.X_MP, {velocity, StrutVector::Zero()});
  wire.v_MT_mm_per_s(Triple(motion.twist.v_mm_per_s));
  wire.w_MT_rad_per_s(Triple(motion.twist.w_rad_per_s));
  const double margin = AnalyseSingularity(hexapod, pose.X_MP).signed_margin;
  wire.singular_margin_ratio(margin);
  if (!(margin > hexapod.geometry().limits.singular_margin)) {
    wire.reason(static_cast<std::uint32_t>(Reason::kSingular));
  }
}

}  // namespace lambdajet::kinematics
