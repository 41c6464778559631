#include "calibration/core/look_model.hpp"

#include <ceres/jet.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "kinematics/core/lambda_kernel.hpp"
#include "kinematics/core/lambda_mechanism.hpp"

namespace lambdajet::calibration {
namespace {

using MechanismJet = ceres::Jet<double, kMechanismSize>;

Eigen::Matrix2d Rotation(double theta_rad) { return PlanarPose{0.0, 0.0, theta_rad}.rotation(); }
Eigen::Vector2d Translation(const ParameterVector& p, Parameter x) { return {p[At(x)], p[At(x) + 1]}; }

// d(R^T(theta) v)/d theta of h = R^T v.
Eigen::Vector2d TurnBackRate(const Eigen::Vector2d& h) { return {h.y(), -h.x()}; }
Eigen::Vector2d TurnRate(const Eigen::Vector2d& h) { return {-h.y(), h.x()}; }

}  // namespace

EffectorPlace PlaceEffector(const MachineDescription& machine, const ParameterVector& parameters,
                            const Eigen::Vector2d& actuator_position_mm) {
  namespace lambda = kinematics::lambda;
  std::array<MechanismJet, kMechanismSize> p;
  for (int i = 0; i < kMechanismSize; ++i) {
    p[static_cast<std::size_t>(i)] = MechanismJet(parameters[i], i);
  }
  EffectorPlace place;
  if (!(p[0].a > 0.0 && p[1].a > 0.0 && p[2].a > 0.0 && parameters.allFinite() &&
        actuator_position_mm.allFinite())) {
    return place;
  }
  const auto geometry = lambda::MakeGeometry(p.data());
  const lambda::Readings<MechanismJet> q{MechanismJet(actuator_position_mm.x()),
                                         MechanismJet(actuator_position_mm.y())};
  const auto assembly = lambda::Assemble(geometry, q, static_cast<double>(machine.assembly_mode),
                                         lambda::RailsApart(p[0].a, p[4].a, p[6].a));
  // Written so that a distance of zero, whose quotient is NaN, is refused too.
  if (!(assembly.distance_2_mm2.a > 0.0 && assembly.height_2.a > 0.0)) {
    return place;
  }
  place.p_DE_mm = {assembly.tool.x.a, assembly.tool.y.a};
  place.J_x_parameters.row(0) = assembly.tool.x.v.transpose();
  place.J_x_parameters.row(1) = assembly.tool.y.v.transpose();
  place.closed = place.p_DE_mm.allFinite() && place.J_x_parameters.allFinite();
  return place;
}

std::optional<Eigen::Vector2d> MarkPlace(const MachineDescription& machine, int mark) {
  const auto found = std::find_if(machine.marks.begin(), machine.marks.end(),
                                  [mark](const SheetMark& m) { return m.id == mark; });
  if (found == machine.marks.end()) {
    return std::nullopt;
  }
  return Eigen::Vector2d(found->x_W_mm, found->y_W_mm);
}

LookPrediction PredictLook(const MachineDescription& machine, const ParameterVector& parameters,
                           const Measurement& look, const Eigen::Vector2d& deflection_D_mm) {
  LookPrediction prediction;
  const EffectorPlace now = PlaceEffector(machine, parameters, look.actuator_position_mm);
  if (!now.closed) {
    return prediction;
  }
  const Eigen::Matrix2d R_JD = Rotation(parameters[At(Parameter::kBaseThetaRad)]).transpose();
  Eigen::Vector2d from_jet_D;  // of the mark
  if (IsHole(look)) {
    const EffectorPlace pierced = PlaceEffector(machine, parameters, look.pierce_actuator_position_mm);
    if (!pierced.closed) {
      return prediction;
    }
    from_jet_D = now.p_DE_mm + deflection_D_mm - pierced.p_DE_mm;
    prediction.J.leftCols<kMechanismSize>() = R_JD * (now.J_x_parameters - pierced.J_x_parameters);
  } else {
    const auto p_W = MarkPlace(machine, look.mark);
    if (!p_W) {
      return prediction;
    }
    const Eigen::Vector2d turned = Rotation(parameters[At(Parameter::kSheetThetaRad)]) * *p_W;
    from_jet_D = now.p_DE_mm + deflection_D_mm + Translation(parameters, Parameter::kSheetXMm) + turned -
                 Translation(parameters, Parameter::kBaseXMm);
    prediction.J.leftCols<kMechanismSize>() = R_JD * now.J_x_parameters;
    prediction.J.middleCols<2>(At(Parameter::kBaseXMm)) = -R_JD;
    prediction.J.middleCols<2>(At(Parameter::kSheetXMm)) = R_JD;
    prediction.J.col(At(Parameter::kSheetThetaRad)) = R_JD * TurnRate(turned);
  }
  const Eigen::Vector2d from_jet_J = R_JD * from_jet_D;
  prediction.p_C_mm = from_jet_J - Translation(parameters, Parameter::kCameraXMm);
  prediction.J.col(At(Parameter::kBaseThetaRad)) = TurnBackRate(from_jet_J);
  prediction.J.middleCols<2>(At(Parameter::kCameraXMm)) = -Eigen::Matrix2d::Identity();
  prediction.closed = prediction.p_C_mm.allFinite();
  return prediction;
}

JetPlace PlaceJet(const MachineDescription& machine, const ParameterVector& parameters,
                  const Eigen::Vector2d& actuator_position_mm) {
  JetPlace jet;
  const EffectorPlace now = PlaceEffector(machine, parameters, actuator_position_mm);
  if (!now.closed) {
    return jet;
  }
  const Eigen::Matrix2d R_WE = Rotation(parameters[At(Parameter::kSheetThetaRad)]).transpose();
  jet.p_WJ_mm = R_WE * (Translation(parameters, Parameter::kBaseXMm) - now.p_DE_mm -
                        Translation(parameters, Parameter::kSheetXMm));
  jet.J.leftCols<kMechanismSize>() = -R_WE * now.J_x_parameters;
  jet.J.middleCols<2>(At(Parameter::kBaseXMm)) = R_WE;
  jet.J.middleCols<2>(At(Parameter::kSheetXMm)) = -R_WE;
  jet.J.col(At(Parameter::kSheetThetaRad)) = TurnBackRate(jet.p_WJ_mm);
  jet.closed = jet.p_WJ_mm.allFinite();
  return jet;
}

std::optional<Eigen::Vector2d> ReadingsForJet(const MachineDescription& machine,
                                              const ParameterVector& parameters,
                                              const Eigen::Vector2d& p_WJ_mm) {
  MachineDescription believed = machine;
  believed.parameters = parameters;
  const auto mechanism = kinematics::LambdaMechanism::FromDescription(believed);
  const auto answer =
      kinematics::SolveInverse(mechanism, believed.X_DJ().translation_mm() - believed.X_EW() * p_WJ_mm);
  if (answer.reason != kinematics::Reason::kSolved) {
    return std::nullopt;
  }
  return answer.actuator_position_mm;
}

Eigen::Vector2d JetPlaceForLook(const ParameterVector& parameters, const Eigen::Vector2d& p_W_mm) {
  const Eigen::Matrix2d R_WE = Rotation(parameters[At(Parameter::kSheetThetaRad)]).transpose();
  const Eigen::Matrix2d R_DJ = Rotation(parameters[At(Parameter::kBaseThetaRad)]);
  return p_W_mm - R_WE * R_DJ * Translation(parameters, Parameter::kCameraXMm);
}

Eigen::Matrix2d StraightnessCovariance(const MachineDescription& machine, const EffectorPlace& place) {
  // A wave of rail i acts like a change of its offset.
  const Eigen::Vector2d rail_1 = place.J_x_parameters.col(At(Parameter::kRail1OffsetMm));
  const Eigen::Vector2d rail_2 = place.J_x_parameters.col(At(Parameter::kRail2OffsetMm));
  const double sigma = machine.uncertainties.straightness_mm;
  return sigma * sigma * (rail_1 * rail_1.transpose() + rail_2 * rail_2.transpose());
}

Eigen::Matrix2d BacklashCovariance(const MachineDescription& machine, const EffectorPlace& place) {
  // Anywhere within the full width: a uniform density's variance is width^2 / 12.
  const double variance = machine.uncertainties.backlash_mm * machine.uncertainties.backlash_mm / 12.0;
  return variance * place.J_x_q() * place.J_x_q().transpose();
}

}  // namespace lambdajet::calibration
