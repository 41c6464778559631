#include "calibration/core/place_accuracy.hpp"

#include <algorithm>
#include <cmath>

namespace lambdajet::calibration {

double Radius95(const Eigen::Matrix2d& covariance_mm2) {
  const double mean = 0.5 * covariance_mm2.trace();
  const double half = 0.5 * (covariance_mm2(0, 0) - covariance_mm2(1, 1));
  const double largest = mean + std::hypot(half, covariance_mm2(0, 1));
  return 2.4477468306808166 * std::sqrt(std::max(0.0, largest));
}

std::vector<PlaceAccuracy> PredictPlaces(const MachineDescription& machine, const ParameterVector& parameters,
                                         const ParameterCovariance& covariance, int columns, int rows) {
  std::vector<PlaceAccuracy> places;
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) {
      PlaceAccuracy place;
      place.p_W_mm = {machine.sheet_width_mm * c / std::max(1, columns - 1),
                      machine.sheet_height_mm * r / std::max(1, rows - 1)};
      const auto q = ReadingsForJet(machine, parameters, place.p_W_mm);
      if (!q) {
        continue;
      }
      const JetPlace jet = PlaceJet(machine, parameters, *q);
      if (!jet.closed) {
        continue;
      }
      place.actuator_position_mm = *q;
      place.J = jet.J;
      place.covariance_mm2 = jet.J * covariance * jet.J.transpose();
      place.radius_95_mm = Radius95(place.covariance_mm2);
      places.push_back(place);
    }
  }
  return places;
}

double WorstRadius95(const std::vector<PlaceAccuracy>& places) {
  double worst = 0.0;
  for (const PlaceAccuracy& place : places) {
    worst = std::max(worst, place.radius_95_mm);
  }
  return worst;
}

std::optional<Eigen::Vector2d> JetMiss(const MachineDescription& machine, const ParameterVector& believed,
                                       const ParameterVector& truth, const Eigen::Vector2d& p_W_mm) {
  const auto q = ReadingsForJet(machine, believed, p_W_mm);
  if (!q) {
    return std::nullopt;
  }
  const JetPlace jet = PlaceJet(machine, truth, *q);
  if (!jet.closed) {
    return std::nullopt;
  }
  return Eigen::Vector2d(jet.p_WJ_mm - p_W_mm);
}

}  // namespace lambdajet::calibration
