// Says how far a hexapod's pose is from a singular one, where the struts no longer hold the platform.
//
// Model: J of seed paper 004, equation (1). A hexapod has no serial (type 1) singularity with struts longer
// than 0; det J = 0 is its parallel (type 2) one. Turns are measured as shifts at the characteristic length,
// the root mean square distance of the platform's joints from the pole C (Hexapod::lever_mm), so that
// singular values are in mm of strut for mm of platform. With base and platform symmetric about z, turning
// the platform by +-90 deg about z at home is singular.
// Units: mm, rad. Threads: any. Cost: about 6 us (one 6 x 6 singular value decomposition); no allocation.
#pragma once

#include <Eigen/Core>

#include "kinematics/core/hexapod.hpp"
#include "kinematics/core/hexapod_jacobian.hpp"

namespace lambdajet::kinematics {

struct HexapodSingularity {
  double determinant_krylov_mm3 = 0.0;   // by x, y, z, psi, theta, gamma; mm^3 a rad^3
  double determinant = 0.0;              // of J scaled to mm/mm, by shifts and turns in M
  double smallest_singular_value = 0.0;  // mm/mm
  double largest_singular_value = 0.0;
  double condition = 0.0;  // infinity when singular
  double characteristic_length_mm = 0.0;
  // The smallest singular value with the sign that det J has against its sign at home: negative beyond a
  // singular surface.
  double signed_margin = 0.0;
  // The motion that the struts hold worst: shift of C in mm with turns in mm at the characteristic length;
  // unit.
  Eigen::Matrix<double, 6, 1> weakest_motion = Eigen::Matrix<double, 6, 1>::Zero();
};
HexapodSingularity AnalyseSingularity(const Hexapod& hexapod, const Pose& X_MP);

// SolveInverse that refuses with kSingular where signed_margin is below limits.singular_margin, too.
HexapodInverse SolveInverseWithMargin(const Hexapod& hexapod, const Pose& X_MP);

}  // namespace lambdajet::kinematics
