#include "kinematics/core/hexapod_singularity.hpp"

#include <Eigen/LU>
#include <Eigen/SVD>
#include <cmath>
#include <limits>

namespace lambdajet::kinematics {
namespace {

PoseJacobian Scaled(const Hexapod& hexapod, const Pose& X_MP) {
  PoseJacobian J = ActuatorJacobian(hexapod, X_MP);
  J.rightCols<3>() /= hexapod.lever_mm();
  return J;
}

}  // namespace

HexapodSingularity AnalyseSingularity(const Hexapod& hexapod, const Pose& X_MP) {
  HexapodSingularity answer;
  const double lever = hexapod.lever_mm();
  const PoseJacobian J = Scaled(hexapod, X_MP);
  answer.characteristic_length_mm = lever;
  answer.determinant = J.determinant();
  // R(2, 1) = -sin(theta), and the angles' rates turn into angular velocity with determinant -cos(theta).
  const double cos_theta = std::hypot(X_MP.R(0, 1), X_MP.R(1, 1));
  answer.determinant_krylov_mm3 = -cos_theta * answer.determinant * lever * lever * lever;
  const Eigen::JacobiSVD<PoseJacobian> svd(J, Eigen::ComputeFullV);
  if (svd.info() != Eigen::Success) {
    return answer;  // J is not finite; a margin of 0 is refused wherever one is asked for
  }
  answer.largest_singular_value = svd.singularValues()[0];
  answer.smallest_singular_value = svd.singularValues()[5];
  answer.condition = answer.smallest_singular_value > 0.0
                         ? answer.largest_singular_value / answer.smallest_singular_value
                         : std::numeric_limits<double>::infinity();
  answer.weakest_motion = svd.matrixV().col(5);
  const double home_sign = Scaled(hexapod, hexapod.geometry().X_MP_home).determinant() < 0.0 ? -1.0 : 1.0;
  answer.signed_margin =
      home_sign * answer.determinant < 0.0 ? -answer.smallest_singular_value : answer.smallest_singular_value;
  return answer;
}

HexapodInverse SolveInverseWithMargin(const Hexapod& hexapod, const Pose& X_MP) {
  HexapodInverse answer = SolveInverse(hexapod, X_MP);
  const double margin = hexapod.geometry().limits.singular_margin;
  if (answer.reason != Reason::kSolved || margin <= 0.0) {
    return answer;
  }
  const double here = AnalyseSingularity(hexapod, X_MP).signed_margin;
  if (!(here >= margin)) {
    answer.reason = Reason::kSingular;
    answer.bound = HexapodBound::kSingularMargin;
    answer.excess = margin - here;
  }
  return answer;
}

}  // namespace lambdajet::kinematics
