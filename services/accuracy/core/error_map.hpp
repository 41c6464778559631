// Draws over the sheet how well a place can be met, and ranks the parameters by what they cost there.
//
// Model: core/error_chain.hpp without a direction: sigma is that of the worst direction, the root of the
// covariance's larger eigenvalue; the mean is the elastic deflection (m/k) a for a given acceleration where
// it is not compensated. Frames: W. Units: mm. Shapes: row by row from (0, 0) to the sheet's far corner.
// Threads: pure. Cost: some 1 us a point. Errors: a point the mechanism cannot stand at has `valid` false.
#pragma once

#include <string_view>
#include <vector>

#include "accuracy/core/error_chain.hpp"

namespace lambdajet::accuracy {

struct PlaceError {
  bool valid = false;
  Eigen::Vector2d p_W_mm = Eigen::Vector2d::Zero();
  double mean_mm = 0.0;
  double sigma_mm = 0.0;
  double bound_95_mm = 0.0;
};

struct ErrorMapOptions {
  int columns = 41;  // 2 … 400
  int rows = 31;
  double acceleration_mm_per_s2 = 0.0;
  bool compensated = false;
};

PlaceError PlaceErrorAt(const ErrorChain& chain, const Eigen::Vector2d& p_W_mm, double mean_mm);

std::vector<PlaceError> MapErrors(const MachineDescription& machine, const ErrorMapOptions& options);

struct ParameterShare {
  Parameter parameter = Parameter::kCount;
  double sensitivity = 0.0;      // rms over the sheet of the worst direction, mm by the parameter's unit
  double contribution_mm = 0.0;  // sensitivity times the parameter's own sigma, correlations left out
};

// Largest contribution first; over a grid as in MapErrors. The two elastic parameters act with acceleration
// only and rank by options.acceleration_mm_per_s2.
std::vector<ParameterShare> RankParameters(const MachineDescription& machine, const ErrorMapOptions& options);

}  // namespace lambdajet::accuracy
