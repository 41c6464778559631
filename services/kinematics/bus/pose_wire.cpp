#include "kinematics/bus/pose_wire.hpp"

#include "lambdajet/drive/v1/state.h"
#include "lambdajet/kinematics/v1/pose.h"

namespace lambdajet::kinematics {
namespace {

std::array<double, 2> Pair(const Eigen::Vector2d& v) { return {v.x(), v.y()}; }

}  // namespace

void ToWire(const ActiveMachine& machine, const idl::drive::v1::State& drive,
            idl::kinematics::v1::Pose& wire) {
  const Motion actuators{{drive.actuator_position_mm()[0], drive.actuator_position_mm()[1]},
                         {drive.actuator_velocity_mm_per_s()[0], drive.actuator_velocity_mm_per_s()[1]},
                         Eigen::Vector2d::Zero()};
  const ForwardAnswer pose = SolveForward(machine.mechanism, actuators.position_mm);
  const bool finite = pose.reason != Reason::kNotFinite;
  wire = idl::kinematics::v1::Pose();
  wire.header().time_ns(drive.header().time_ns());
  wire.model_version(machine.description.version);
  wire.model_hash(machine.description.hash);
  wire.reason(static_cast<std::uint32_t>(pose.reason));
  wire.actuator_position_mm(Pair(finite ? actuators.position_mm : Eigen::Vector2d(0.0, 0.0)));
  wire.travel_margin_mm(pose.travel_margin_mm);
  wire.assembly_mode(pose.assembly_mode);
  if (!pose.positioned) {
    return;
  }
  wire.p_DE_mm(Pair(pose.p_DE_mm));
  const MachineDescription& description = machine.description;
  wire.p_WJ_mm(Pair(description.X_EW().Inverse() * (description.X_DJ().translation_mm() - pose.p_DE_mm)));
  wire.v_DE_mm_per_s(Pair(SolveForwardMotion(machine.mechanism, actuators).motion.velocity_mm_per_s));
  wire.working_mode({pose.working_mode.s1, pose.working_mode.s2});
  wire.serial_distance_mm(pose.serial_distance_mm);
  wire.parallel_distance_mm(pose.parallel_distance_mm);
}

}  // namespace lambdajet::kinematics
