// Says in numbers and in words what a run of looks can tell about the 19 parameters and what it cannot.
//
// Model: `information` is the looks' own information on z, parameters scaled to one prior sigma (core/prior.hpp), with
// marks and tracking runs eliminated (Schur complement). Its eigenvalue for a direction is (prior sigma / sigma from the
// looks alone)^2: above 1 the looks know that combination better than the machine file does, below 1 the machine file
// decides. Gauge freedoms are changes that no look can see because they change no cut either: D's origin and direction are
// free, so X_DJ and X_EW may move together, and slider zeros and rail offsets may move with them. The priors settle how
// such a change is shared out; the place of the jet on the sheet does not depend on it.
// Units: eigenvalues have none; directions in the parameters' own units for one prior sigma.
// Threads: pure.
// Cost: one eigenvalue decomposition of 19 x 19.
#pragma once

#include <string>
#include <vector>

#include "calibration/core/prior.hpp"

namespace lambdajet::calibration {

struct WeakDirection {
  double information = 0.0;  // eigenvalue
  ParameterVector direction = ParameterVector::Zero();
  std::string words;
};

struct Observability {
  int rank = 0;      // of the looks' information, priors left out
  int informed = 0;  // directions in which the looks know more than the prior
  double condition =
      0.0;  // largest over smallest singular value of the looks' scaled Jacobian within its rank
  ParameterVector eigenvalues = ParameterVector::Zero();  // ascending
  std::vector<std::string> gauges;                        // freedoms found, in words
  std::vector<WeakDirection> weak;  // the rest that the looks determine worse than the prior, weakest first
};

Observability Observe(const Prior& prior, const ParameterCovariance& information);

// "base_x_mm 0.71, sheet_x_mm -0.70": the components that matter of a direction given in prior sigmas.
std::string DescribeDirection(const ParameterVector& z_direction);

}  // namespace lambdajet::calibration
