// Translates hexapods, spatial poses, their answers and service areas between the wire and the core.
//
// Model: rotations as kinematics.proto says: Krylov angles of seed paper 004, Hamilton quaternion, roll-pitch-yaw, matrix.
// Errors: what cannot be a hexapod or a pose is noted in ArgumentChecks under the field's name; nothing is clamped, only a
// quaternion is normalised. Threads: pure functions.
#pragma once

#include <optional>
#include <string>

#include "kinematics/core/hexapod.hpp"
#include "kinematics/core/hexapod_jacobian.hpp"
#include "kinematics/core/service_area.hpp"
#include "lambdajet/kinematics/v1/kinematics.pb.h"
#include "platform/rpc/argument_checks.hpp"

namespace lambdajet::kinematics {

// Nothing if a check failed.
std::optional<Hexapod> FromWire(const v1::HexapodGeometry& wire, ArgumentChecks& checks);
Eigen::Vector3d FromWire(const v1::SpatialVector& wire, const std::string& field, ArgumentChecks& checks);
void ToWire(const Eigen::Vector3d& vector_mm, v1::SpatialVector& wire);
Pose FromWire(const v1::SpatialPose& wire, const std::string& field, ArgumentChecks& checks);
void ToWire(const Pose& pose, v1::SpatialPose& wire);

// Answers to one question about a hexapod; the poses are the tool's.
void SolveToWire(const Hexapod& hexapod, const Pose& X_MT, v1::SolveInverseResponse& wire);
void SolveToWire(const Hexapod& hexapod, const StrutVector& actuators_mm, const Pose& X_MT_start,
                 v1::SolveForwardResponse& wire);
// Motion beside the solution, if the request asks for it and there is a solution.
void MotionToWire(const Hexapod& hexapod, const Pose& X_MT, const v1::SolveInverseRequest& request,
                  ArgumentChecks& checks, v1::SolveInverseResponse& wire);
void MotionToWire(const Hexapod& hexapod, const v1::SolveForwardRequest& request, ArgumentChecks& checks,
                  v1::SolveForwardResponse& wire);
// Columns of J_q_parameters: of a strut, or of a lambda or biglide.
void ParameterNamesToWire(bool hexapod, google::protobuf::RepeatedPtrField<std::string>& wire);
void JacobianToWire(const Hexapod& hexapod, const Pose& X_MT, v1::ComputeJacobianResponse& wire);
void SingularityToWire(const Hexapod& hexapod, const Pose& X_MT, v1::ReportSingularityResponse& wire);

// The paper's machine with the request's numbers in it; `swept` (empty: none) is set to `value`.
ServiceAreaMachine FromWire(const v1::ComputeServiceAreaRequest& wire, double value, ArgumentChecks& checks);
void ToWire(const ServiceAreaMachine& machine, double value, v1::ServiceArea& wire);

}  // namespace lambdajet::kinematics
