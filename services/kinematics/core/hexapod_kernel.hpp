// Computes the six struts of a hexapod in the lanes of one vector, and solves its six equations by Newton's
// method.
//
// Model: seed paper 004, equation (1) as |C + R B'_j - A_j|, and its universal joints with 10 deviations and
// the length zero each (universal_joint.hpp). This is the inside of hexapod.hpp and
// universal_joint.hpp, which check what they pass in; nobody else includes it. Frames: M base, P platform
// with its origin in the pole C, Aj the nominal frame of universal joint j. Units: mm, rad. Shapes: eight
// lanes, strut j in lane j, lanes 6 and 7 repeat strut 5 (so that they stay finite); in blocks, eight poses
// in the lanes instead. Validity: |angles| <= 1e5 rad. Threads: functions of their arguments. Cost: see
// tests/benchmark; no allocation. Each function is compiled three times, for AVX-512, for AVX2 with FMA and
// for plain x86-64, and the processor chooses.
#pragma once

#include <cstddef>

namespace lambdajet::kinematics::kernel {

inline constexpr int kLanes = 8;

struct alignas(64) Lanes {
  double lane[kLanes] = {};
};

// Joint centres: A_j in M, B'_j in P.
struct StrutLanes {
  Lanes ax, ay, az;
  Lanes bx, by, bz;
};

// R_MA and A of the nominal joint frame, R_M1 = R_MA R1 and A1 of the frame of the real first axis, then the
// rest.
struct UniversalJointLanes {
  Lanes R_MA[9];        // row-major
  Lanes R_M1[9];        // row-major
  Lanes a1x, a1y, a1z;  // A1 in M
  Lanes ex, ez;
  Lanes cos_eps, sin_eps;
  Lanes h;
  Lanes cos_nu, sin_nu;
};

// Position of C and the rotation R_MP, row-major.
struct RawPose {
  double p[3] = {0, 0, 0};
  double R[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
};

struct NewtonSettings {
  double step_tolerance_mm = 1e-5;      // a step this small leaves an error of its square over a strut length
  double residual_tolerance_mm = 1e-9;  // of every strut
  double lever_mm = 1.0;                // turns are measured as shifts at this radius
  double largest_turn_rad = 0.6;        // longer steps are shortened to this
  double largest_shift_mm = 1e3;
  int iteration_limit = 40;
  int strut_order[6] = {0, 1, 2, 3, 4, 5};  // the first three should not lie in a plane
  double order_parity = 1.0;                // +1 if that is an even permutation, -1 if odd
};

struct NewtonResult {
  RawPose pose;
  double residual_mm = 0.0;        // largest of the six
  double determinant_start = 0.0;  // of the struts in strut_order
  double determinant_end =
      0.0;  // at the last point where it was formed, one quadratic step before the answer
  int iterations = 0;
  bool converged = false;
};

struct JointAngles {
  Lanes q1_cos, q1_sin, q2_cos, q2_sin;
  Lanes length;
  Lanes residual;  // |B(q1, q2, L) - B| per strut
};

// psi, theta, gamma of equation (1).
void RotationOfKrylov(const double angles_rad[3], double R[9]);

void StrutLengths(const StrutLanes& struts, const RawPose& pose, Lanes& lengths_mm);
void StrutLengthsOfKrylov(const StrutLanes& struts, const double pose[6], Lanes& lengths_mm);

// `count` poses as six columns (x, y, z, psi, theta, gamma), into six columns of lengths.
void StrutLengthsBlock(const StrutLanes& struts, const double* const pose_columns[6], std::size_t count,
                       double* const length_columns[6]);

NewtonResult SolvePose(const StrutLanes& struts, const Lanes& lengths_mm, const RawPose& start,
                       const NewtonSettings& settings);

// Newton on (q1, q2, L) of every joint from the ideal start; `updates` steps at most, returns how many were
// made.
int SolveJoints(const StrutLanes& struts, const UniversalJointLanes& joints, const RawPose& pose,
                int update_limit, JointAngles& joints_out);

NewtonResult SolvePoseNonIdeal(const StrutLanes& struts, const UniversalJointLanes& joints,
                               const Lanes& lengths_mm, const RawPose& start, const NewtonSettings& settings);

// Row j: dL_j to a shift of C and to a turn (both in M): g = n/(n.u) and (R B'_j) x g; the ideal joint has g
// = u.
void LengthGradients(const StrutLanes& struts, const RawPose& pose, Lanes gradient[6]);
void LengthGradientsNonIdeal(const StrutLanes& struts, const UniversalJointLanes& joints, const RawPose& pose,
                             const JointAngles& solved, Lanes gradient[6]);

}  // namespace lambdajet::kinematics::kernel
