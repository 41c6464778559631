#include "foundation/machine/hexapod_geometry.hpp"

#include <Eigen/Geometry>
#include <cmath>

namespace lambdajet {
namespace {

// B_j - A_j of the nominal centres at home.
StrutPoints StrutsAtHome(const HexapodGeometry& g) {
  return ((g.X_MP_home.R * g.p_PB_mm).colwise() + g.X_MP_home.p_mm) - g.p_MA_mm;
}

bool Finite(const Pose& X) { return X.p_mm.allFinite() && X.R.allFinite(); }

}  // namespace

std::string_view FaultOf(const HexapodGeometry& g) {
  if (!g.p_MA_mm.allFinite() || !g.p_PB_mm.allFinite() || !g.length_zero_mm.allFinite()) {
    return "joint centres and length zeros must be finite numbers";
  }
  if (!Finite(g.X_MP_home) || !Finite(g.X_PT) || !std::isfinite(g.screw_lead_mm)) {
    return "home pose, tool and screw lead must be finite numbers";
  }
  if (!(g.limits.strut_min_mm >= 0.0 && g.limits.strut_max_mm > g.limits.strut_min_mm)) {
    return "strut limits must be 0 <= strut_min_mm < strut_max_mm";
  }
  if (!(g.limits.base_cone_rad > 0.0 && g.limits.platform_cone_rad > 0.0 &&
        g.limits.singular_margin >= 0.0)) {
    return "joint cones must be above 0 and the singular margin 0 or above";
  }
  const StrutPoints s = StrutsAtHome(g);
  for (int j = 0; j < kStruts; ++j) {
    const double length = s.col(j).norm();
    if (!(length > 1e-6)) {
      return "a strut has no length at home";
    }
    const Eigen::Matrix3d& R_MA = g.R_MA[static_cast<std::size_t>(j)];
    if (!((R_MA * R_MA.transpose() - Eigen::Matrix3d::Identity()).norm() < 1e-9)) {
      return "a joint frame is not a rotation";
    }
    const UniversalJoint& u = g.joints[static_cast<std::size_t>(j)];
    const double sum = u.a1x_mm + u.a1y_mm + u.a1z_mm + u.dx_rad + u.dz_rad + u.ex_mm + u.ez_mm + u.eps_rad +
                       u.h_mm + u.nu_rad;
    if (!std::isfinite(sum)) {
      return "universal joint deviations must be finite numbers";
    }
  }
  if (!(g.p_PB_mm.colwise().norm().maxCoeff() > 1e-6)) {
    return "the platform's joint centres coincide with its pole";
  }
  return {};
}

void LayJointFrames(HexapodGeometry& geometry) {
  const StrutPoints s = StrutsAtHome(geometry);
  for (int j = 0; j < kStruts; ++j) {
    const Eigen::Vector3d z = s.col(j).normalized();
    const Eigen::Vector3d across = Eigen::Vector3d::UnitZ().cross(z);
    const Eigen::Vector3d y = across.norm() > 1e-9
                                  ? Eigen::Vector3d(across.normalized())
                                  : Eigen::Vector3d((Eigen::Vector3d::UnitY() - z * z.y()).normalized());
    geometry.R_MA[static_cast<std::size_t>(j)] << y.cross(z), y, z;
  }
}

}  // namespace lambdajet
