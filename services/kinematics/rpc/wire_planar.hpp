// Translates planar mechanisms, poses and answers between the wire and the core.
//
// Errors: what cannot be a mechanism or a pose is noted in ArgumentChecks under the field's name; nothing is clamped.
// Threads: pure functions.
#pragma once

#include <string>

#include "kinematics/core/lambda_mechanism.hpp"
#include "lambdajet/kinematics/v1/kinematics.pb.h"
#include "platform/rpc/argument_checks.hpp"

namespace lambdajet::kinematics {

LambdaMechanism FromWire(const v1::LambdaGeometry& wire, ArgumentChecks& checks);
LambdaMechanism FromWire(const v1::BiglideGeometry& wire, ArgumentChecks& checks);
WorkingMode FromWire(const v1::WorkingMode& wire, const std::string& field, ArgumentChecks& checks);
Eigen::Vector2d FromWire(const v1::PlanarVector& wire, const std::string& field, const char* unit,
                         ArgumentChecks& checks);

void ToWire(const LambdaMechanism& mechanism, v1::LambdaGeometry& wire);
void ToWire(WorkingMode mode, v1::WorkingMode& wire);
void ToWire(const Eigen::Vector2d& vector, v1::PlanarVector& wire);
void ToWire(const InverseAnswer& answer, v1::SolveInverseResponse& wire);
void ToWire(const ForwardAnswer& answer, v1::SolveForwardResponse& wire);
void ToWire(const LambdaJacobians& jacobians, v1::ComputeJacobianResponse& wire);
void ToWire(const SingularityReport& report, v1::ReportSingularityResponse& wire);

inline v1::Reason ToWire(Reason reason) { return static_cast<v1::Reason>(reason); }

// One sentence for people: what was wrong, by how much, and what would be right.
std::string RefusalMessage(Reason reason, double excess);

// Row by row, whatever the storage order.
template <class Derived>
void MatrixToWire(const Eigen::DenseBase<Derived>& matrix, v1::Matrix& wire) {
  wire.set_rows(static_cast<std::uint32_t>(matrix.rows()));
  wire.set_columns(static_cast<std::uint32_t>(matrix.cols()));
  for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
    for (Eigen::Index j = 0; j < matrix.cols(); ++j) {
      wire.add_element(matrix(i, j));
    }
  }
}

}  // namespace lambdajet::kinematics
