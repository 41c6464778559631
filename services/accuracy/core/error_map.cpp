#include "accuracy/core/error_map.hpp"

#include <algorithm>
#include <cmath>

namespace lambdajet::accuracy {
namespace {

std::vector<Eigen::Vector2d> Grid(const MachineDescription& machine, const ErrorMapOptions& options) {
  const int columns = std::clamp(options.columns, 2, 400);
  const int rows = std::clamp(options.rows, 2, 400);
  std::vector<Eigen::Vector2d> grid;
  grid.reserve(static_cast<std::size_t>(columns * rows));
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) {
      grid.emplace_back(machine.sheet_width_mm * c / (columns - 1), machine.sheet_height_mm * r / (rows - 1));
    }
  }
  return grid;
}

double JetOffsetVariance(const ErrorChain& chain) {
  double square = 0.0;
  for (const double radius : chain.jet_offset_mm) {
    square += radius * radius;
  }
  return 0.5 * square;  // each coordinate
}

double LargerEigenvalue(const Eigen::Matrix2d& m) {
  const double middle = 0.5 * (m(0, 0) + m(1, 1));
  return middle + std::hypot(0.5 * (m(0, 0) - m(1, 1)), m(0, 1));
}

}  // namespace

PlaceError PlaceErrorAt(const ErrorChain& chain, const Eigen::Vector2d& p_W_mm, double mean_mm) {
  PlaceError error;
  error.p_W_mm = p_W_mm;
  const PlaceSensitivity place = SensitivityAt(chain, p_W_mm);
  if (!place.valid) {
    return error;
  }
  const Uncertainties& u = chain.uncertainties;
  const double slider = u.following_mm * u.following_mm + 0.25 * u.backlash_mm * u.backlash_mm;
  const Eigen::Matrix2d spread =
      place.J_p_parameters * chain.covariance * place.J_p_parameters.transpose() +
      slider * place.J_p_q * place.J_p_q.transpose() +
      u.straightness_mm * u.straightness_mm * place.J_p_rail * place.J_p_rail.transpose() +
      (u.jet_wander_mm * u.jet_wander_mm + JetOffsetVariance(chain)) * Eigen::Matrix2d::Identity();
  error.valid = true;
  error.mean_mm = mean_mm;
  error.sigma_mm = std::sqrt(std::max(0.0, LargerEigenvalue(spread)));
  error.bound_95_mm = FoldedNormalQuantile(mean_mm, error.sigma_mm, 0.95);
  return error;
}

std::vector<PlaceError> MapErrors(const MachineDescription& machine, const ErrorMapOptions& options) {
  const ErrorChain chain(machine);
  const double mean =
      options.compensated ? 0.0 : chain.elastic_lag_s2 * std::abs(options.acceleration_mm_per_s2);
  std::vector<PlaceError> map;
  for (const Eigen::Vector2d& p_W : Grid(machine, options)) {
    map.push_back(PlaceErrorAt(chain, p_W, mean));
  }
  return map;
}

std::vector<ParameterShare> RankParameters(const MachineDescription& machine,
                                           const ErrorMapOptions& options) {
  const ErrorChain chain(machine);
  ParameterVector squares = ParameterVector::Zero();
  int places = 0;
  for (const Eigen::Vector2d& p_W : Grid(machine, options)) {
    const PlaceSensitivity place = SensitivityAt(chain, p_W);
    if (place.valid) {
      squares += place.J_p_parameters.colwise().squaredNorm().transpose();
      ++places;
    }
  }
  squares /= std::max(1, places);
  const double a = options.acceleration_mm_per_s2;
  squares[static_cast<Eigen::Index>(Parameter::kElasticLagS2)] = a * a;
  std::vector<ParameterShare> ranking;
  for (std::size_t i = 0; i < kParameterCount; ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    const double sensitivity = std::sqrt(squares[k]);
    const double sigma = std::sqrt(std::max(0.0, chain.covariance(k, k)));
    ranking.push_back({static_cast<Parameter>(i), sensitivity, sensitivity * sigma});
  }
  std::ranges::stable_sort(ranking, std::greater<>{}, &ParameterShare::contribution_mm);
  return ranking;
}

}  // namespace lambdajet::accuracy
