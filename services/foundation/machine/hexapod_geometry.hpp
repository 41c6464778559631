// Describes one hexapod: joint centres, length zeros, how its universal joints depart from perfect ones, home, tool, limits.
//
// Model: seed paper 004; the deviations of a joint and their gauge stand in kinematics/core/universal_joint.hpp, the screws'
// coupling in kinematics/core/hexapod.hpp. Strut j runs from A_j on the base M to B_j on the platform P.
// Units: mm, rad. Shapes: struts are columns 0 to 5. Validity: FaultOf() names what is wrong.
// Threads: values.
#pragma once

#include <Eigen/Core>
#include <array>
#include <limits>
#include <string_view>

#include "foundation/geometry/pose.hpp"

namespace lambdajet {

inline constexpr int kStruts = 6;
using StrutVector = Eigen::Matrix<double, kStruts, 1>;
using StrutPoints = Eigen::Matrix<double, 3, kStruts>;

struct UniversalJoint {
  double a1x_mm = 0.0;  // axis 1 off the nominal centre
  double a1y_mm = 0.0;
  double a1z_mm = 0.0;
  double dx_rad = 0.0;  // direction of axis 1
  double dz_rad = 0.0;
  double ex_mm = 0.0;  // axis 2 off axis 1
  double ez_mm = 0.0;
  double eps_rad = 0.0;  // axes 1 and 2 off 90 deg
  double h_mm = 0.0;     // the strut's axis off axis 2
  double nu_rad = 0.0;   // the strut not square to axis 2
  friend bool operator==(const UniversalJoint&, const UniversalJoint&) = default;
};

struct HexapodLimits {
  double strut_min_mm = 0.0;
  double strut_max_mm = std::numeric_limits<double>::infinity();
  double base_cone_rad = 3.15;      // of a strut against its direction at home, seen from the base
  double platform_cone_rad = 3.15;  // the same, seen from the platform
  double singular_margin =
      0.0;  // smallest singular value that is still served, mm/mm (hexapod_singularity.hpp)
};

struct HexapodGeometry {
  StrutPoints p_MA_mm = StrutPoints::Zero();
  StrutPoints p_PB_mm = StrutPoints::Zero();
  StrutVector length_zero_mm = StrutVector::Zero();  // l0: actuator reading = L - l0
  // Frames A_j of the base's joints, y along the fixed axis. They stay as they are when an identified A_j
  // moves.
  std::array<Eigen::Matrix3d, kStruts> R_MA = {Eigen::Matrix3d::Identity(), Eigen::Matrix3d::Identity(),
                                               Eigen::Matrix3d::Identity(), Eigen::Matrix3d::Identity(),
                                               Eigen::Matrix3d::Identity(), Eigen::Matrix3d::Identity()};
  Pose X_MP_home;
  Pose X_PT;  // the tool in the platform
  double screw_lead_mm =
      0.0;  // right-handed positive; 0: the strut cannot turn, or does not move when it does
  HexapodLimits limits;
  std::array<UniversalJoint, kStruts> joints{};  // all zero: ideal
};

// Lays the joint frames as the nominal design has them: z along the strut at home, y = Z_M x z (Y_M if that
// is nothing), x = y x z.
void LayJointFrames(HexapodGeometry& geometry);

// What is wrong with a geometry, first fault only; empty if nothing is.
std::string_view FaultOf(const HexapodGeometry& geometry);

}  // namespace lambdajet
