// Places one planar frame in another: the pose X_AB of frame B in frame A.
//
// Frames: monograms as in foundation/geometry/frames.md; neighbours meet, X_AC = X_AB * X_BC, p_A = X_AB * p_B.
// Units: mm, rad. The angle turns from A's x axis to B's x axis, counter-clockwise, and is not normalised.
// Threads: values. Cost: one sine and cosine an application of a pose; none in composition's angle.
#pragma once

#include <Eigen/Core>
#include <cmath>

namespace lambdajet {

struct PlanarPose {
  double x_mm = 0.0;
  double y_mm = 0.0;
  double theta_rad = 0.0;

  Eigen::Vector2d translation_mm() const { return {x_mm, y_mm}; }

  Eigen::Matrix2d rotation() const {
    const double c = std::cos(theta_rad);
    const double s = std::sin(theta_rad);
    return (Eigen::Matrix2d() << c, -s, s, c).finished();
  }

  PlanarPose Inverse() const {
    const Eigen::Vector2d t = -(rotation().transpose() * translation_mm());
    return {t.x(), t.y(), -theta_rad};
  }

  friend Eigen::Vector2d operator*(const PlanarPose& X_AB, const Eigen::Vector2d& p_B_mm) {
    return X_AB.rotation() * p_B_mm + X_AB.translation_mm();
  }

  friend PlanarPose operator*(const PlanarPose& X_AB, const PlanarPose& X_BC) {
    const Eigen::Vector2d t = X_AB * X_BC.translation_mm();
    return {t.x(), t.y(), X_AB.theta_rad + X_BC.theta_rad};
  }
};

}  // namespace lambdajet
