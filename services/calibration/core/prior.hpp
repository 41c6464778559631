// Scales the 19 parameters by what is known of them beforehand, so that one unit of each is one sigma.
//
// Model: parameters = mean + scale z with z ~ N(0, I); scale scale^T is the covariance, scale the symmetric root of the
// correlation matrix between its sigmas. A parameter of variance 0 does not move with z: it is known.
// Units: z has none.
// Threads: values.
// Cost: one eigenvalue decomposition of 19 x 19.
#pragma once

#include "foundation/machine/machine_description.hpp"

namespace lambdajet::calibration {

struct Prior {
  ParameterVector mean = ParameterVector::Zero();
  ParameterCovariance scale = ParameterCovariance::Zero();

  static Prior Of(const ParameterVector& mean, const ParameterCovariance& covariance);
  ParameterVector At(const ParameterVector& z) const { return mean + scale * z; }
};

}  // namespace lambdajet::calibration
