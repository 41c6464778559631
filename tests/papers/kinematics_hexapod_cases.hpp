// The worked hexapod of the papers' checks (seed paper 004): nominal geometry, the imperfect joints, five poses.
#pragma once

#include <array>
#include <cmath>

#include "kinematics/core/hexapod.hpp"

namespace lambdajet::kinematics::worked {

inline constexpr double kDeg = M_PI / 180.0;

inline HexapodGeometry Geometry() {
  constexpr std::array<double, 6> kBaseDeg = {-10, 10, 110, 130, 230, 250};
  constexpr std::array<double, 6> kPlatformDeg = {-50, 50, 70, 170, 190, 290};
  HexapodGeometry geometry;
  for (int j = 0; j < kStruts; ++j) {
    const double a = kBaseDeg[static_cast<std::size_t>(j)] * kDeg;
    const double b = kPlatformDeg[static_cast<std::size_t>(j)] * kDeg;
    geometry.p_MA_mm.col(j) << 600.0 * std::cos(a), 600.0 * std::sin(a), 0.0;
    geometry.p_PB_mm.col(j) << 250.0 * std::cos(b), 250.0 * std::sin(b), -25.0;
  }
  geometry.X_MP_home.p_mm = {0.0, 0.0, 800.0};
  LayJointFrames(geometry);
  return geometry;
}

// Signs in the order a1x a1z dx dz ex ez eps h nu, magnitudes 0.05 mm and 0.2 mrad.
inline constexpr std::array<const char*, 6> kSigns = {"+-++-++-+", "-++-++-+-", "++-+--+++",
                                                      "--+++-+-+", "+--+-+-++", "-+--++++-"};
inline constexpr double kOffsetMm = 0.05;
inline constexpr double kSkewRad = 2e-4;

inline UniversalJoint JointOf(const std::array<double, 9>& sign, double offset_mm = kOffsetMm,
                              double skew_rad = kSkewRad) {
  UniversalJoint joint;
  joint.a1x_mm = sign[0] * offset_mm;
  joint.a1z_mm = sign[1] * offset_mm;
  joint.dx_rad = sign[2] * skew_rad;
  joint.dz_rad = sign[3] * skew_rad;
  joint.ex_mm = sign[4] * offset_mm;
  joint.ez_mm = sign[5] * offset_mm;
  joint.eps_rad = sign[6] * skew_rad;
  joint.h_mm = sign[7] * offset_mm;
  joint.nu_rad = sign[8] * skew_rad;
  return joint;
}

inline std::array<double, 9> SignsOf(int strut) {
  std::array<double, 9> sign{};
  for (std::size_t k = 0; k < sign.size(); ++k) {
    sign[k] = kSigns[static_cast<std::size_t>(strut)][k] == '+' ? 1.0 : -1.0;
  }
  return sign;
}

inline HexapodGeometry NonIdealGeometry() {
  HexapodGeometry geometry = Geometry();
  for (int j = 0; j < kStruts; ++j) {
    geometry.joints[static_cast<std::size_t>(j)] = JointOf(SignsOf(j));
  }
  return geometry;
}

inline constexpr std::array<PlatformPose, 5> kPoses = {{
    {0, 0, 800, 0, 0, 0},
    {100, -50, 850, 10 * kDeg, -5 * kDeg, 8 * kDeg},
    {-120, 80, 760, -15 * kDeg, 12 * kDeg, -10 * kDeg},
    {0, 0, 800, 0, 20 * kDeg, 0},
    {150, 150, 900, 5 * kDeg, 5 * kDeg, -5 * kDeg},
}};

}  // namespace lambdajet::kinematics::worked
