// Describes one imperfect universal joint at the base of a strut, and solves its two angles and the strut's
// length.
//
// Model: seed paper 004, Fig. 4, in a gauge that stays regular for a perfect joint. Frame A: fixed to the
// base at the nominal centre, y the ideal fixed axis, z towards the strut at home. Axis 1 is y of frame 1,
// axis 2 is x of frame 2:
//   B_A = a1 + R1 Ry(q1) [ a2 + R2 Rx(q2) ( a3 + L u ) ],
//   a1 = (a1x, a1y, a1z), R1 = Rz(dz) Rx(dx), a2 = (ex, 0, ez), R2 = Rz(eps), a3 = (0, h, 0), u = (sin nu, 0,
//   cos nu).
// With the actuator's zero l0 (HexapodGeometry) that makes 11 parameters a strut; the ideal joint has all of
// them 0. Inverse: Newton on (q1, q2, L) from the ideal start, columns s1 x (B - A1), s2 x (B - A2), u; two
// or three steps. Length rate: dL/dt = n . v_B / (n . u), n = (s1 x (B - A1)) x (s2 x (B - A2)). Units: mm,
// rad. Validity: deviations small against the strut; q2 away from +-90 deg. Threads: values.
#pragma once

#include <Eigen/Core>
#include <array>

#include "foundation/geometry/pose.hpp"
#include "foundation/machine/hexapod_geometry.hpp"

namespace lambdajet::kinematics {

class Hexapod;
using lambdajet::UniversalJoint;

// B_A of given angles and length, with the joint's deviations.
Eigen::Vector3d StrutEnd(const UniversalJoint& joint, double q1_rad, double q2_rad, double length_mm);

struct SolvedJoint {
  double q1_rad = 0.0;
  double q2_rad = 0.0;
  double length_mm = 0.0;
  double residual_mm = 0.0;
};

// All six joints after at most `update_limit` Newton steps (0: the ideal start).
std::array<SolvedJoint, 6> SolveUniversalJoints(const Hexapod& hexapod, const Pose& X_MP,
                                                int update_limit = 8);

}  // namespace lambdajet::kinematics
