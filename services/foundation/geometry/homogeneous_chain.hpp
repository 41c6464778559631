// Multiplies chains of elementary homogeneous matrices whose arguments move, with first and second derivative
// in time, and carries small errors of the elements to the fixed frame.
//
// Model: seed paper 000, r_i = M_i0 r_0 with M_i0 a product of factors (13)-(18); velocity (19) v = M' r + M
// r'; acceleration (20) a = M'' r + 2 M' r' + M r''; tool to part (23) r_02 = (M''_i,02)^-1 M'_i,01 r_01.
// Error stack (44)-(55) with the paper's signs corrected: [r] = [[0, rz, -ry], [-rz, 0, rx], [ry, -rx, 0]]
// (printed (49) has +rx in row 3) and the element's turns carried into the fixed frame like its shifts, A_0k
// = [[M, [r] M], [0, M]]. Frames: active form, M_k(k-1) is the pose of frame k-1 in frame k; chains are
// written from left to right as they multiply. Angles alpha, beta, gamma are Cardan turns about x, y, z,
// right-handed. Units: mm, rad, s. Threads: functions of their arguments. Cost: one 4x4 triple a factor; no
// allocation.
#pragma once

#include <Eigen/Core>
#include <span>

#include "foundation/contract/expects.hpp"
#include "foundation/geometry/pose.hpp"

namespace lambdajet {

enum class ElementaryMotion { kX, kY, kZ, kAlpha, kBeta, kGamma };

// One factor: which matrix, and its argument with rates (mm or rad, per s, per s^2).
struct ChainFactor {
  ElementaryMotion motion = ElementaryMotion::kX;
  double value = 0.0;
  double rate = 0.0;
  double acceleration = 0.0;
};

struct ChainMotion {
  Eigen::Matrix4d M = Eigen::Matrix4d::Identity();
  Eigen::Matrix4d M_rate = Eigen::Matrix4d::Zero();
  Eigen::Matrix4d M_acceleration = Eigen::Matrix4d::Zero();

  Pose pose() const { return {M.topRightCorner<3, 1>(), M.topLeftCorner<3, 3>()}; }
};

// A point with its rates in the chain's moving frame, or what the chain makes of it.
struct PointMotion {
  Eigen::Vector3d r_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d v_mm_per_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d a_mm_per_s2 = Eigen::Vector3d::Zero();
};

namespace homogeneous_chain_detail {

inline Eigen::Vector3d AxisOf(ElementaryMotion motion) {
  return Eigen::Vector3d::Unit(static_cast<int>(motion) % 3);
}

inline bool IsTurn(ElementaryMotion motion) { return static_cast<int>(motion) >= 3; }

inline Eigen::Matrix3d Turn(ElementaryMotion motion, double angle_rad) {
  switch (motion) {
    case ElementaryMotion::kAlpha:
      return RotationX(angle_rad);
    case ElementaryMotion::kBeta:
      return RotationY(angle_rad);
    default:
      return RotationZ(angle_rad);
  }
}

}  // namespace homogeneous_chain_detail

// Matrices (13)-(18) with their derivatives: m' = m_v v', m'' = m_vv v'^2 + m_v v''.
inline ChainMotion Elementary(const ChainFactor& factor) {
  using namespace homogeneous_chain_detail;
  ChainMotion result;
  const Eigen::Vector3d axis = AxisOf(factor.motion);
  if (!IsTurn(factor.motion)) {
    result.M.topRightCorner<3, 1>() = axis * factor.value;
    result.M_rate.topRightCorner<3, 1>() = axis * factor.rate;
    result.M_acceleration.topRightCorner<3, 1>() = axis * factor.acceleration;
    return result;
  }
  const Eigen::Matrix3d R = Turn(factor.motion, factor.value);
  const Eigen::Matrix3d R_v = CrossMatrix(axis) * R;
  const Eigen::Matrix3d R_vv = CrossMatrix(axis) * R_v;
  result.M.topLeftCorner<3, 3>() = R;
  result.M_rate.topLeftCorner<3, 3>() = R_v * factor.rate;
  result.M_acceleration.topLeftCorner<3, 3>() =
      R_vv * (factor.rate * factor.rate) + R_v * factor.acceleration;
  return result;
}

// (P Q)' = P' Q + P Q', (P Q)'' = P'' Q + 2 P' Q' + P Q''.
inline ChainMotion operator*(const ChainMotion& P, const ChainMotion& Q) {
  ChainMotion result;
  result.M.noalias() = P.M * Q.M;
  result.M_rate = P.M_rate * Q.M + P.M * Q.M_rate;
  result.M_acceleration = P.M_acceleration * Q.M + 2.0 * (P.M_rate * Q.M_rate) + P.M * Q.M_acceleration;
  return result;
}

inline ChainMotion MultiplyChain(std::span<const ChainFactor> factors) {
  ChainMotion product;
  for (const ChainFactor& factor : factors) {
    product = product * Elementary(factor);
  }
  return product;
}

// The way back, from N M = 1 differentiated: N' = -N M' N, N'' = -(2 N' M' + N M'') N.
inline ChainMotion InverseOf(const ChainMotion& chain) {
  ChainMotion back;
  const Eigen::Matrix3d R_back = chain.M.topLeftCorner<3, 3>().transpose();
  back.M.topLeftCorner<3, 3>() = R_back;
  back.M.topRightCorner<3, 1>() = -R_back * chain.M.topRightCorner<3, 1>();
  back.M_rate = -back.M * chain.M_rate * back.M;
  back.M_acceleration = -(2.0 * back.M_rate * chain.M_rate + back.M * chain.M_acceleration) * back.M;
  return back;
}

// Position, velocity (19) and acceleration (20) in the fixed frame of a point given in the chain's last
// frame.
inline PointMotion CarryPoint(const ChainMotion& chain, const PointMotion& point) {
  const Eigen::Matrix3d R = chain.M.topLeftCorner<3, 3>();
  const Eigen::Matrix3d R_rate = chain.M_rate.topLeftCorner<3, 3>();
  PointMotion carried;
  carried.r_mm = R * point.r_mm + chain.M.topRightCorner<3, 1>();
  carried.v_mm_per_s = R_rate * point.r_mm + chain.M_rate.topRightCorner<3, 1>() + R * point.v_mm_per_s;
  carried.a_mm_per_s2 = chain.M_acceleration.topLeftCorner<3, 3>() * point.r_mm +
                        chain.M_acceleration.topRightCorner<3, 1>() + 2.0 * (R_rate * point.v_mm_per_s) +
                        R * point.a_mm_per_s2;
  return carried;
}

// Equation (23) with its derivatives: the tool's chain as seen from the part; both are given in the fixed frame.
inline ChainMotion ToolInPart(const ChainMotion& tool, const ChainMotion& part) {
  return InverseOf(part) * tool;
}

// Six small errors of one element: shifts (mm), then turns (rad).
using SmallErrors = Eigen::Matrix<double, 6, 1>;

// [r] of (49), sign corrected: [r] psi = psi x r.
inline Eigen::Matrix3d LeverMatrix(const Eigen::Vector3d& r_mm) { return -CrossMatrix(r_mm); }

// A_0k of (50)-(55): carries the errors of element k, written in its own frame, to the point at r_kn from the
// element (written in the fixed frame); R_0k is the element's rotation in the fixed frame.
inline Eigen::Matrix<double, 6, 6> ErrorMap(const Eigen::Matrix3d& R_0k, const Eigen::Vector3d& r_kn_0_mm) {
  Eigen::Matrix<double, 6, 6> A = Eigen::Matrix<double, 6, 6>::Zero();
  A.topLeftCorner<3, 3>() = R_0k;
  A.topRightCorner<3, 3>() = LeverMatrix(r_kn_0_mm) * R_0k;
  A.bottomRightCorner<3, 3>() = R_0k;
  return A;
}

// Sum over the stack, Delta_0 = sum A_0k Delta_k (44), with poses of the elements in the fixed frame and the
// common point.
inline SmallErrors SumOfErrors(std::span<const Pose> X_0k, std::span<const SmallErrors> errors_k,
                               const Eigen::Vector3d& point_0_mm) {
  Expects(X_0k.size() == errors_k.size(), "SumOfErrors: one set of errors for each element");
  SmallErrors sum = SmallErrors::Zero();
  for (std::size_t k = 0; k < X_0k.size(); ++k) {
    sum += ErrorMap(X_0k[k].R, point_0_mm - X_0k[k].p_mm) * errors_k[k];
  }
  return sum;
}

}  // namespace lambdajet
