// Predicts what the camera sees and where the jet stands on the sheet, each with its derivatives to all 19 parameters.
//
// Model: the chain of foundation/geometry/frames.md,
//     still:    p_C = R_DJ^T (p_DE(q) + u + X_EW p_W - p_DJ) - p_JC
//     hole:     p_C = R_DJ^T (p_DE(q) - p_DE(q_pierce)) - p_JC       (its place p_W = X_EW^-1 (p_DJ -
//     p_DE(q_pierce)) put in) jet:      p_WJ = X_EW^-1 (p_DJ - p_DE(q))
// with p_DE(q) the lambda mechanism's forward solution and u the elastic deflection (0 at rest). A mark or hole off its
// place, by the sheet's making or by the jet's wander, adds straight to p_C.
// Frames: p_C in the camera's frame C, u in D.
// Units: mm, rad.
// Threads: pure functions.
// Cost: one forward solution with nine derivatives, under a microsecond; no allocation.
// Errors: `closed` is false where the mechanism cannot be assembled at the readings; no answer holds NaN.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "calibration/core/measurement.hpp"
#include "foundation/machine/machine_description.hpp"

namespace lambdajet::calibration {

inline constexpr int kMechanismSize = 9;  // the first entries of the parameter vector
inline constexpr int kAll = static_cast<int>(kParameterCount);
inline constexpr int At(Parameter p) { return static_cast<int>(p); }

using ParameterJacobian2 = Eigen::Matrix<double, 2, kAll>;

struct EffectorPlace {
  bool closed = false;
  Eigen::Vector2d p_DE_mm = Eigen::Vector2d::Zero();
  Eigen::Matrix<double, 2, kMechanismSize> J_x_parameters = Eigen::Matrix<double, 2, kMechanismSize>::Zero();
  // A reading and the slider's zero act alike: q enters only as reading + zero.
  Eigen::Matrix2d J_x_q() const { return J_x_parameters.rightCols<2>(); }
};

EffectorPlace PlaceEffector(const MachineDescription& machine, const ParameterVector& parameters,
                            const Eigen::Vector2d& actuator_position_mm);

struct LookPrediction {
  bool closed = false;
  Eigen::Vector2d p_C_mm = Eigen::Vector2d::Zero();
  ParameterJacobian2 J = ParameterJacobian2::Zero();  // the deflection held
};

// Which mark a measurement looks at, as the sheet's drawing has it; none for a hole.
std::optional<Eigen::Vector2d> MarkPlace(const MachineDescription& machine, int mark);

LookPrediction PredictLook(const MachineDescription& machine, const ParameterVector& parameters,
                           const Measurement& look,
                           const Eigen::Vector2d& deflection_D_mm = Eigen::Vector2d::Zero());

struct JetPlace {
  bool closed = false;
  Eigen::Vector2d p_WJ_mm = Eigen::Vector2d::Zero();
  ParameterJacobian2 J = ParameterJacobian2::Zero();  // the readings held
};

JetPlace PlaceJet(const MachineDescription& machine, const ParameterVector& parameters,
                  const Eigen::Vector2d& actuator_position_mm);

// The readings that bring the jet to a place on the sheet; none where a link, a slider's travel or the
// singular margin forbids it.
std::optional<Eigen::Vector2d> ReadingsForJet(const MachineDescription& machine,
                                              const ParameterVector& parameters,
                                              const Eigen::Vector2d& p_WJ_mm);

// Where the jet stands on the sheet when a point p_W of it is in the middle of the picture.
Eigen::Vector2d JetPlaceForLook(const ParameterVector& parameters, const Eigen::Vector2d& p_W_mm);

// Covariance of the effector's place, in D, by what no parameter describes.
Eigen::Matrix2d StraightnessCovariance(const MachineDescription& machine, const EffectorPlace& place);
Eigen::Matrix2d BacklashCovariance(const MachineDescription& machine, const EffectorPlace& place);

}  // namespace lambdajet::calibration
