#include "kinematics/rpc/kinematics_answers.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "kinematics/rpc/mechanism_selection.hpp"
#include "kinematics/rpc/wire_planar.hpp"
#include "kinematics/rpc/wire_spatial.hpp"
#include "platform/rpc/argument_checks.hpp"

namespace lambdajet::kinematics {
namespace {

// A question about a hexapod needs X_MT, one about a planar mechanism p_DE.
template <class Request>
void CheckToolKind(const Request& request, bool hexapod, ArgumentChecks& checks) {
  if (hexapod) {
    checks.Require(request.has_x_mt(), "X_MT", "EMPTY", "a hexapod needs its tool's pose in M");
  } else {
    checks.Require(request.has_p_de(), "p_DE", "EMPTY", "a lambda or biglide needs its tool point in D");
  }
}

void AddMotion(const LambdaMechanism& m, const v1::SolveInverseRequest& request,
               const Eigen::Vector2d& p_DE_mm, ArgumentChecks& checks, v1::SolveInverseResponse& response) {
  Motion tool{p_DE_mm, FromWire(request.velocity(), "velocity", "mm/s", checks),
              FromWire(request.acceleration(), "acceleration", "mm/s^2", checks)};
  if (!checks.ok() || !response.has_solution()) {
    return;
  }
  const MotionAnswer answer = SolveInverseMotion(m, tool);
  v1::InverseSolution& solution = *response.mutable_solution();
  for (int i = 0; i < 2; ++i) {
    solution.add_actuator_velocity_mm_per_s(answer.motion.velocity_mm_per_s[i]);
    solution.add_actuator_acceleration_mm_per_s2(answer.motion.acceleration_mm_per_s2[i]);
  }
}

Eigen::Vector2d PairFromWire(const google::protobuf::RepeatedField<double>& wire, const std::string& field,
                             ArgumentChecks& checks) {
  if (wire.empty()) {
    return Eigen::Vector2d::Zero();
  }
  checks.CountInRange(field, static_cast<std::size_t>(wire.size()), 2, 2);
  checks.AllFinite(field, wire);
  return wire.size() == 2 ? Eigen::Vector2d(wire[0], wire[1]) : Eigen::Vector2d::Zero();
}

void AddMotion(const LambdaMechanism& m, const v1::SolveForwardRequest& request,
               const Eigen::Vector2d& position_mm, ArgumentChecks& checks,
               v1::SolveForwardResponse& response) {
  const Motion actuators{
      position_mm, PairFromWire(request.actuator_velocity_mm_per_s(), "actuator_velocity_mm_per_s", checks),
      PairFromWire(request.actuator_acceleration_mm_per_s2(), "actuator_acceleration_mm_per_s2", checks)};
  if (!checks.ok() || !response.has_solution()) {
    return;
  }
  const MotionAnswer answer = SolveForwardMotion(m, actuators);
  ToWire(answer.motion.velocity_mm_per_s, *response.mutable_solution()->mutable_velocity());
  ToWire(answer.motion.acceleration_mm_per_s2, *response.mutable_solution()->mutable_acceleration());
}

}  // namespace

absl::Status KinematicsAnswers::GetMachine(const v1::GetMachineRequest& request,
                                           v1::GetMachineResponse& response) const {
  const auto machine = SelectMachine(slot_, request.machine_id());
  if (!machine.ok()) {
    return machine.status();
  }
  const MachineDescription& description = (*machine)->description;
  ToWire(description, *response.mutable_model_version());
  for (std::size_t i = 0; i < kParameterCount; ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    v1::ParameterValue& entry = *response.add_parameter();
    entry.set_name(std::string(ParameterName(static_cast<Parameter>(i))));
    entry.set_value(description.parameters[at]);
    entry.set_sigma(std::sqrt(std::max(0.0, description.covariance(at, at))));
  }
  ToWire((*machine)->mechanism, *response.mutable_mechanism());
  response.set_sheet_width_mm(description.sheet_width_mm);
  response.set_sheet_height_mm(description.sheet_height_mm);
  return absl::OkStatus();
}

absl::Status KinematicsAnswers::SolveInverse(const v1::SolveInverseRequest& request,
                                             v1::SolveInverseResponse& response) const {
  const auto selected = SelectMechanism(slot_, request.mechanism(), ModeIn(request), std::nullopt,
                                        *response.mutable_model_version());
  if (!selected.ok()) {
    return selected.status();
  }
  ArgumentChecks checks;
  CheckToolKind(request, selected->hexapod.has_value(), checks);
  if (selected->hexapod) {
    const Pose X_MT = FromWire(request.x_mt(), "X_MT", checks);
    if (checks.ok()) {
      SolveToWire(*selected->hexapod, X_MT, response);
    }
    if (request.has_motion() && checks.ok()) {
      MotionToWire(*selected->hexapod, X_MT, request, checks, response);
    }
    return checks.status();
  }
  const Eigen::Vector2d p_DE_mm = FromWire(request.p_de(), "p_DE", "mm", checks);
  if (checks.ok()) {
    ToWire(kinematics::SolveInverse(selected->planar, p_DE_mm), response);
  }
  if (request.has_velocity()) {
    AddMotion(selected->planar, request, p_DE_mm, checks, response);
  }
  return checks.status();
}

absl::Status KinematicsAnswers::SolveForward(const v1::SolveForwardRequest& request,
                                             v1::SolveForwardResponse& response) const {
  const auto selected = SelectMechanism(slot_, request.mechanism(), ModeIn(request), AssemblyIn(request),
                                        *response.mutable_model_version());
  if (!selected.ok()) {
    return selected.status();
  }
  ArgumentChecks checks;
  const std::size_t wanted = selected->hexapod ? kStruts : 2;
  const auto& readings = request.actuator_position_mm();
  checks.CountInRange("actuator_position_mm", static_cast<std::size_t>(readings.size()), wanted, wanted);
  checks.AllFinite("actuator_position_mm", readings);
  if (!checks.ok()) {
    return checks.status();
  }
  if (selected->hexapod) {
    const Hexapod& hexapod = *selected->hexapod;
    const Pose start = request.has_x_mt_start() ? FromWire(request.x_mt_start(), "X_MT_start", checks)
                                                : ToolFromPlatform(hexapod, hexapod.geometry().X_MP_home);
    if (checks.ok()) {
      SolveToWire(hexapod, Eigen::Map<const StrutVector>(readings.data()), start, response);
    }
    if (!request.actuator_velocity_mm_per_s().empty() && checks.ok()) {
      MotionToWire(hexapod, request, checks, response);
    }
    return checks.status();
  }
  const Eigen::Vector2d position_mm(readings[0], readings[1]);
  ToWire(kinematics::SolveForward(selected->planar, position_mm), response);
  if (!request.actuator_velocity_mm_per_s().empty()) {
    AddMotion(selected->planar, request, position_mm, checks, response);
  }
  return checks.status();
}

absl::Status KinematicsAnswers::ComputeJacobian(const v1::ComputeJacobianRequest& request,
                                                v1::ComputeJacobianResponse& response) const {
  const auto selected = SelectMechanism(slot_, request.mechanism(), ModeIn(request), std::nullopt,
                                        *response.mutable_model_version());
  if (!selected.ok()) {
    return selected.status();
  }
  ArgumentChecks checks;
  CheckToolKind(request, selected->hexapod.has_value(), checks);
  if (selected->hexapod) {
    const Pose X_MT = FromWire(request.x_mt(), "X_MT", checks);
    if (checks.ok()) {
      JacobianToWire(*selected->hexapod, X_MT, response);
    }
    return checks.status();
  }
  const Eigen::Vector2d p_DE_mm = FromWire(request.p_de(), "p_DE", "mm", checks);
  if (checks.ok()) {
    ToWire(ComputeJacobians(selected->planar, p_DE_mm), response);
  }
  return checks.status();
}

absl::Status KinematicsAnswers::ReportSingularity(const v1::ReportSingularityRequest& request,
                                                  v1::ReportSingularityResponse& response) const {
  const auto selected = SelectMechanism(slot_, request.mechanism(), ModeIn(request), std::nullopt,
                                        *response.mutable_model_version());
  if (!selected.ok()) {
    return selected.status();
  }
  ArgumentChecks checks;
  CheckToolKind(request, selected->hexapod.has_value(), checks);
  if (selected->hexapod) {
    const Pose X_MT = FromWire(request.x_mt(), "X_MT", checks);
    if (checks.ok()) {
      SingularityToWire(*selected->hexapod, X_MT, response);
    }
    return checks.status();
  }
  const Eigen::Vector2d p_DE_mm = FromWire(request.p_de(), "p_DE", "mm", checks);
  if (checks.ok()) {
    ToWire(kinematics::ReportSingularity(selected->planar, p_DE_mm), response);
  }
  return checks.status();
}

absl::Status KinematicsAnswers::ComputeServiceArea(const v1::ComputeServiceAreaRequest& request,
                                                   v1::ComputeServiceAreaResponse& response) const {
  ArgumentChecks checks;
  const bool sweep = !request.sweep_parameter().empty();
  if (sweep) {
    checks.Finite("sweep_from", request.sweep_from());
    checks.Finite("sweep_to", request.sweep_to());
    checks.CountInRange("sweep_points", request.sweep_points(), 2, kMostSweepPoints);
  }
  const auto machine = slot_.Current();
  if (machine != nullptr) {
    ToWire(machine->description, *response.mutable_model_version());
  }
  const std::uint32_t points = sweep && checks.ok() ? request.sweep_points() : 1;
  for (std::uint32_t i = 0; i < points && checks.ok(); ++i) {
    const double share = points > 1 ? static_cast<double>(i) / (points - 1) : 0.0;
    const double value = request.sweep_from() + share * (request.sweep_to() - request.sweep_from());
    const ServiceAreaMachine at = FromWire(request, value, checks);
    if (checks.ok()) {
      ToWire(at, value, *response.add_area());
    }
  }
  return checks.status();
}

}  // namespace lambdajet::kinematics
