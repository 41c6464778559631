// Solves a hexapod both ways: strut lengths of a platform pose, and the platform pose of strut lengths.
//
// Model: seed paper 004, equation (1), L_j = |C + R B'_j - A_j|, R of the Krylov angles psi, theta, gamma as
// in foundation/geometry/pose.hpp; with imperfect universal joints at the base (universal_joint.hpp) the
// length of strut j is that of its joint's equations instead. An actuator reads L_j - l0_j, less the shift of
// its screw: between two cardan joints the nut turns against the screw by tau_j, which moves it by
// lead * (tau_j - tau_j at home) / 2 pi.
// Forward: Newton on the six lengths from a given pose or from home; failure is an answer.
// Frames: M base, P platform with origin in the pole C, T tool; X_PT is the tool in the platform, rotation
// and shift, so a tool offset holds for tilted poses too.
// Units: mm, rad. Shapes: struts are columns and lanes 0 to 5.
// Validity: |angles| <= 1e5 rad, every strut longer than 0. Other poses are answered kNotFinite, but in
// blocks, which check nothing.
// Threads: a Hexapod is immutable; any.
// Cost: tests/benchmark/kinematics_hexapod_benchmark.cpp prints it; no allocation.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <limits>
#include <string_view>

#include "foundation/geometry/pose.hpp"
#include "foundation/machine/hexapod_geometry.hpp"
#include "kinematics/core/hexapod_kernel.hpp"
#include "kinematics/core/reason.hpp"
#include "kinematics/core/universal_joint.hpp"

namespace lambdajet::kinematics {

using lambdajet::HexapodGeometry;
using lambdajet::HexapodLimits;
using lambdajet::kStruts;
using lambdajet::StrutPoints;
using lambdajet::StrutVector;

// C in M and the Krylov angles of equation (1).
struct PlatformPose {
  double x_mm = 0.0;
  double y_mm = 0.0;
  double z_mm = 0.0;
  double psi_rad = 0.0;
  double theta_rad = 0.0;
  double gamma_rad = 0.0;

  Pose X_MP() const { return Pose::FromKrylov({x_mm, y_mm, z_mm}, {psi_rad, theta_rad, gamma_rad}); }
  static PlatformPose Of(const Pose& X_MP) {
    const KrylovAngles a = X_MP.krylov();
    return {X_MP.p_mm.x(), X_MP.p_mm.y(), X_MP.p_mm.z(), a.psi_rad, a.theta_rad, a.gamma_rad};
  }
};

// Which limit a pose is beyond.
enum class HexapodBound { kNone, kStrutMin, kStrutMax, kBaseJointCone, kPlatformJointCone, kSingularMargin };
std::string_view BoundName(HexapodBound bound);  // UPPER_SNAKE

// A geometry with what is prepared from it once.
class Hexapod {
 public:
  // The geometry must be without fault.
  explicit Hexapod(const HexapodGeometry& geometry);

  const HexapodGeometry& geometry() const { return geometry_; }
  bool ideal() const { return ideal_; }
  double lever_mm() const { return lever_mm_; }  // root mean square distance of the B'_j from C
  const StrutVector& home_lengths_mm() const { return home_lengths_mm_; }
  // Unit vectors A_j to B_j at home, in M and in P: the axes of the joint cones.
  const StrutPoints& home_directions_M() const { return home_directions_M_; }
  const StrutPoints& home_directions_P() const { return home_directions_P_; }
  const StrutVector& home_twists_rad() const { return home_twists_rad_; }
  const kernel::StrutLanes& strut_lanes() const { return struts_; }
  const kernel::UniversalJointLanes& joint_lanes() const { return joints_; }
  // Struts with the three first that span space best at home; parity +1 if the permutation is even, -1 if
  // odd.
  const std::array<int, kStruts>& strut_order() const { return strut_order_; }
  double order_parity() const { return order_parity_; }

 private:
  HexapodGeometry geometry_;
  bool ideal_ = true;
  double lever_mm_ = 0.0;
  StrutVector home_lengths_mm_;
  StrutPoints home_directions_M_;
  StrutPoints home_directions_P_;
  StrutVector home_twists_rad_ = StrutVector::Zero();
  std::array<int, kStruts> strut_order_{0, 1, 2, 3, 4, 5};
  double order_parity_ = 1.0;
  kernel::StrutLanes struts_;
  kernel::UniversalJointLanes joints_;
};

struct HexapodInverse {
  Reason reason = Reason::kSolved;
  HexapodBound bound = HexapodBound::kNone;
  int strut = -1;       // the one the reason is about
  double excess = 0.0;  // how far beyond the bound: mm, rad, or mm/mm as the bound says; positive
  StrutVector lengths_mm = StrutVector::Zero();    // L_j
  StrutVector actuators_mm = StrutVector::Zero();  // what the encoders read
};

// Lengths and limits; the joints as the geometry has them.
HexapodInverse SolveInverse(const Hexapod& hexapod, const Pose& X_MP);
HexapodInverse SolveInverse(const Hexapod& hexapod, const PlatformPose& pose);

// Lengths only, nothing checked, ideal joints: for blocks. Six columns in, six columns out, `count` each.
struct PlatformPoseColumns {
  std::array<const double*, 6> columns{};  // x, y, z [mm], psi, theta, gamma [rad]
};
struct StrutLengthColumns {
  std::array<double*, kStruts> columns{};
};
void SolveInverseBlock(const Hexapod& hexapod, const PlatformPoseColumns& poses, std::size_t count,
                       const StrutLengthColumns& lengths_mm);

struct HexapodForward {
  // kNotConverged; kModeMismatch: converged, but det J has not the sign it has at the start: another way to
  // assemble the struts; kOutOfReach: a strut is to be 0 long or less; kNotFinite.
  Reason reason = Reason::kSolved;
  int strut = -1;
  Pose X_MP;
  int iterations = 0;
  double residual_mm = 0.0;  // largest of the six
  int assembly_sign = 0;     // of det J at the answer
  PlatformPose platform_pose() const { return PlatformPose::Of(X_MP); }
};

// `actuators_mm` are encoder readings; the answer is the assembly that Newton reaches from `start`.
HexapodForward SolveForward(const Hexapod& hexapod, const StrutVector& actuators_mm, const Pose& X_MP_start);
HexapodForward SolveForwardFromHome(const Hexapod& hexapod, const StrutVector& actuators_mm);

// The platform pose that puts the tool at X_MT, and back.
inline Pose PlatformFromTool(const Hexapod& hexapod, const Pose& X_MT) {
  return X_MT * hexapod.geometry().X_PT.Inverse();
}
inline Pose ToolFromPlatform(const Hexapod& hexapod, const Pose& X_MP) {
  return X_MP * hexapod.geometry().X_PT;
}

// Turn of each nut against its screw, tau_j: between the second axes of the two cardan joints, about the
// strut, right-handed from base to platform. The fixed axes are y of the joint frames at the base and the
// same vectors as they stand in P at home.
StrutVector ScrewTwists(const Hexapod& hexapod, const Pose& X_MP);
// Its gradient: to a shift of C and a turn of P, both written in M, and to the strut's own vector.
struct ScrewTwistGradient {
  Eigen::Matrix<double, 6, 6> by_pose;           // row j
  Eigen::Matrix<double, 3, kStruts> by_strut_M;  // column j: to B_j - A_j, written in M
};
ScrewTwistGradient ScrewTwistGradients(const Hexapod& hexapod, const Pose& X_MP);

}  // namespace lambdajet::kinematics
