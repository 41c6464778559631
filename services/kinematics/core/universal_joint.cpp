#include "kinematics/core/universal_joint.hpp"

#include <cmath>

#include "kinematics/core/hexapod.hpp"

namespace lambdajet::kinematics {

Eigen::Vector3d StrutEnd(const UniversalJoint& joint, double q1_rad, double q2_rad, double length_mm) {
  const Eigen::Vector3d u(std::sin(joint.nu_rad), 0.0, std::cos(joint.nu_rad));
  const Eigen::Vector3d from_2 = RotationX(q2_rad) * (Eigen::Vector3d(0.0, joint.h_mm, 0.0) + length_mm * u);
  const Eigen::Vector3d from_1 =
      Eigen::Vector3d(joint.ex_mm, 0.0, joint.ez_mm) + RotationZ(joint.eps_rad) * from_2;
  return Eigen::Vector3d(joint.a1x_mm, joint.a1y_mm, joint.a1z_mm) +
         RotationZ(joint.dz_rad) * (RotationX(joint.dx_rad) * (RotationY(q1_rad) * from_1));
}

std::array<SolvedJoint, 6> SolveUniversalJoints(const Hexapod& hexapod, const Pose& X_MP, int update_limit) {
  kernel::RawPose raw;
  Eigen::Map<Eigen::Vector3d>(raw.p) = X_MP.p_mm;
  Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(raw.R) = X_MP.R;
  kernel::JointAngles solved;
  kernel::SolveJoints(hexapod.strut_lanes(), hexapod.joint_lanes(), raw, update_limit, solved);
  std::array<SolvedJoint, 6> joints;
  for (std::size_t j = 0; j < joints.size(); ++j) {
    joints[j] = {std::atan2(solved.q1_sin.lane[j], solved.q1_cos.lane[j]),
                 std::atan2(solved.q2_sin.lane[j], solved.q2_cos.lane[j]), solved.length.lane[j],
                 solved.residual.lane[j]};
  }
  return joints;
}

}  // namespace lambdajet::kinematics
