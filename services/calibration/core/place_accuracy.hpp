// Carries the parameters' covariance to where it is money: the place of the jet on the sheet.
//
// Model: at the readings a controller with these parameters would drive to, p_WJ changes by J d(parameters), so its
// covariance is J C J^T; the circle of 95 % is taken from the larger axis, 2.4477 sigma (chi-square of two degrees of
// freedom).
// Frames: p_WJ in W.
// Units: mm.
// Threads: pure.
// Cost: an inverse and a forward solution a place.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "calibration/core/look_model.hpp"

namespace lambdajet::calibration {

struct PlaceAccuracy {
  Eigen::Vector2d p_W_mm = Eigen::Vector2d::Zero();
  Eigen::Vector2d actuator_position_mm = Eigen::Vector2d::Zero();
  ParameterJacobian2 J = ParameterJacobian2::Zero();
  Eigen::Matrix2d covariance_mm2 = Eigen::Matrix2d::Zero();
  double radius_95_mm = 0.0;
};

// A grid of places over the sheet, edges included, that the jet can reach; columns along W's x.
std::vector<PlaceAccuracy> PredictPlaces(const MachineDescription& machine, const ParameterVector& parameters,
                                         const ParameterCovariance& covariance, int columns = 7,
                                         int rows = 5);

double Radius95(const Eigen::Matrix2d& covariance_mm2);
double WorstRadius95(const std::vector<PlaceAccuracy>& places);

// Where a machine of `truth` puts the jet when driven with `believed`, against where it should be; none out
// of reach.
std::optional<Eigen::Vector2d> JetMiss(const MachineDescription& machine, const ParameterVector& believed,
                                       const ParameterVector& truth, const Eigen::Vector2d& p_W_mm);

}  // namespace lambdajet::calibration
