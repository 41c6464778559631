#include "calibration/core/prior.hpp"

#include <Eigen/Eigenvalues>

namespace lambdajet::calibration {

Prior Prior::Of(const ParameterVector& mean, const ParameterCovariance& covariance) {
  const ParameterVector sigma = covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
  const ParameterVector inverse = (sigma.array() > 0.0).select(sigma.cwiseInverse(), 0.0);
  ParameterCovariance correlation = inverse.asDiagonal() * covariance * inverse.asDiagonal();
  for (Eigen::Index i = 0; i < correlation.rows(); ++i) {
    correlation(i, i) = 1.0;  // of a known parameter too: its row of the scale is 0 all the same
  }
  ParameterCovariance off_diagonal = correlation;
  off_diagonal.diagonal().setZero();
  Prior prior{mean, ParameterCovariance::Zero()};
  if (off_diagonal.isZero(0.0)) {
    prior.scale = sigma.asDiagonal();  // exact, and the common case
    return prior;
  }
  const Eigen::SelfAdjointEigenSolver<ParameterCovariance> eigen(correlation);
  const ParameterVector root = eigen.eigenvalues().cwiseMax(0.0).cwiseSqrt();
  prior.scale =
      sigma.asDiagonal() * eigen.eigenvectors() * root.asDiagonal() * eigen.eigenvectors().transpose();
  return prior;
}

}  // namespace lambdajet::calibration
