#include "kinematics/core/hexapod_kernel.hpp"

#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>

// Instrumented builds start before the loader may choose a version, so they keep the plain one.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__) || defined(__clang__)
#define LAMBDAJET_PROCESSOR_VERSIONS
#else
#define LAMBDAJET_PROCESSOR_VERSIONS __attribute__((target_clones("avx512f", "fma", "default")))
#endif
#define LAMBDAJET_INLINE __attribute__((always_inline)) inline

namespace lambdajet::kinematics::kernel {
namespace {

// GNU vector extensions: arithmetic on eight lanes, lowered to what the processor has.
using V = double __attribute__((vector_size(64)));
using VI = std::int64_t __attribute__((vector_size(64)));

LAMBDAJET_INLINE V Load(const Lanes& lanes) {
  V v;
  std::memcpy(&v, lanes.lane, sizeof v);
  return v;
}

LAMBDAJET_INLINE V LoadFrom(const double* p) {
  V v;
  std::memcpy(&v, p, sizeof v);
  return v;
}

LAMBDAJET_INLINE void Store(V v, Lanes& lanes) { std::memcpy(lanes.lane, &v, sizeof v); }

LAMBDAJET_INLINE V All(double x) { return V{x, x, x, x, x, x, x, x}; }

LAMBDAJET_INLINE V Sqrt(V x) {
  V r;
  for (int k = 0; k < kLanes; ++k) {
    r[k] = __builtin_sqrt(x[k]);
  }
  return r;
}

LAMBDAJET_INLINE double Sqrt(double x) { return __builtin_sqrt(x); }

LAMBDAJET_INLINE V Magnitude(V x) { return x < 0.0 ? -x : x; }

// Largest over the six struts (lanes 6 and 7 repeat lane 5).
LAMBDAJET_INLINE double Largest(V x) {
  const double a = x[0] > x[1] ? x[0] : x[1];
  const double b = x[2] > x[3] ? x[2] : x[3];
  const double c = x[4] > x[5] ? x[4] : x[5];
  const double ab = a > b ? a : b;
  const double largest = ab > c ? ab : c;
  // A comparison with NaN is false: let NaN through.
  return x[0] + x[1] + x[2] + x[3] + x[4] + x[5] == x[0] + x[1] + x[2] + x[3] + x[4] + x[5] ? largest : NAN;
}

// Sine and cosine by fdlibm's kernels after reduction by pi/2 in three parts; below one unit in the last
// place.
constexpr double kTwoOverPi = 6.36619772367581382433e-01;
constexpr double kPio2High = 1.57079632673412561417e+00;
constexpr double kPio2Middle = 6.07710050630396597660e-11;
constexpr double kPio2Low = 2.02226624879595063154e-21;
constexpr double kRoundingMagic =
    6755399441055744.0;  // 1.5 * 2^52: adding it rounds to an integer in the low bits

template <class T>
LAMBDAJET_INLINE T SinePolynomial(T r, T z) {
  const T p = 8.33333333332248946124e-03 +
              z * (-1.98412698298579493134e-04 +
                   z * (2.75573137070700676789e-06 +
                        z * (-2.50507602534068634195e-08 + z * 1.58969099521155010221e-10)));
  return r + z * r * (-1.66666666666666324348e-01 + z * p);
}

template <class T>
LAMBDAJET_INLINE T CosinePolynomial(T z) {
  const T p = 4.16666666666666019037e-02 +
              z * (-1.38888888888741095749e-03 +
                   z * (2.48015872894767294178e-05 +
                        z * (-2.75573143513906633035e-07 +
                             z * (2.08757232129817482790e-09 + z * -1.13596475577881948265e-11))));
  const T half = 0.5 * z;
  const T w = 1.0 - half;
  return w + (((1.0 - w) - half) + z * z * p);
}

LAMBDAJET_INLINE void SinCos(double x, double& sine, double& cosine) {
  const double shifted = x * kTwoOverPi + kRoundingMagic;
  const auto quadrant = std::bit_cast<std::int64_t>(shifted);
  const double n = shifted - kRoundingMagic;
  const double r = ((x - n * kPio2High) - n * kPio2Middle) - n * kPio2Low;
  const double z = r * r;
  const double s = SinePolynomial(r, z);
  const double c = CosinePolynomial(z);
  const bool swap = (quadrant & 1) != 0;
  const double first = swap ? c : s;
  const double second = swap ? s : c;
  sine = (quadrant & 2) != 0 ? -first : first;
  cosine = ((quadrant + 1) & 2) != 0 ? -second : second;
}

LAMBDAJET_INLINE void SinCos(V x, V& sine, V& cosine) {
  const V shifted = x * kTwoOverPi + kRoundingMagic;
  const VI quadrant = std::bit_cast<VI>(shifted);
  const V n = shifted - kRoundingMagic;
  const V r = ((x - n * kPio2High) - n * kPio2Middle) - n * kPio2Low;
  const V z = r * r;
  const V s = SinePolynomial(r, z);
  const V c = CosinePolynomial(z);
  const VI swap = (quadrant & 1) != 0;
  const V first = swap ? c : s;
  const V second = swap ? s : c;
  sine = (quadrant & 2) != 0 ? -first : first;
  cosine = ((quadrant + 1) & 2) != 0 ? -second : second;
}

// The nine coefficients of equation (1).
template <class T>
LAMBDAJET_INLINE void Krylov(T psi, T theta, T gamma, T (&R)[9]) {
  T sp, cp, st, ct, sg, cg;
  SinCos(psi, sp, cp);
  SinCos(theta, st, ct);
  SinCos(gamma, sg, cg);
  const T spst = sp * st;
  const T cpst = cp * st;
  R[0] = cp * cg + spst * sg;
  R[1] = sp * ct;
  R[2] = spst * cg - cp * sg;
  R[3] = cpst * sg - sp * cg;
  R[4] = cp * ct;
  R[5] = sp * sg + cpst * cg;
  R[6] = ct * sg;
  R[7] = -st;
  R[8] = ct * cg;
}

template <class T>
struct Vector3 {
  T x, y, z;
};

template <class T>
LAMBDAJET_INLINE Vector3<T> Cross(const Vector3<T>& a, const Vector3<T>& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

template <class T>
LAMBDAJET_INLINE T Dot(const Vector3<T>& a, const Vector3<T>& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}

// R B'_j of all struts.
LAMBDAJET_INLINE Vector3<V> TurnedJoints(const StrutLanes& struts, const double* R) {
  const V bx = Load(struts.bx);
  const V by = Load(struts.by);
  const V bz = Load(struts.bz);
  return {R[0] * bx + R[1] * by + R[2] * bz, R[3] * bx + R[4] * by + R[5] * bz,
          R[6] * bx + R[7] * by + R[8] * bz};
}

LAMBDAJET_INLINE Vector3<V> StrutVectors(const StrutLanes& struts, const double* p,
                                         const Vector3<V>& turned) {
  return {turned.x + (p[0] - Load(struts.ax)), turned.y + (p[1] - Load(struts.ay)),
          turned.z + (p[2] - Load(struts.az))};
}

LAMBDAJET_INLINE void LengthsOfEightPoses(const StrutLanes& struts, const V (&pose)[6], V (&length)[6]) {
  V R[9];
  Krylov(pose[3], pose[4], pose[5], R);
  for (int j = 0; j < 6; ++j) {
    const double bx = struts.bx.lane[j], by = struts.by.lane[j], bz = struts.bz.lane[j];
    const V x = pose[0] + (R[0] * bx + R[1] * by + R[2] * bz - struts.ax.lane[j]);
    const V y = pose[1] + (R[3] * bx + R[4] * by + R[5] * bz - struts.ay.lane[j]);
    const V z = pose[2] + (R[6] * bx + R[7] * by + R[8] * bz - struts.az.lane[j]);
    length[j] = Sqrt(x * x + y * y + z * z);
  }
}

struct LinearSolution {
  double x[6];
  double determinant;
};

// Gauss-Jordan with row pivoting: columns in the lanes' direction, so that one elimination is one
// multiply-add a column.
LAMBDAJET_INLINE LinearSolution SolvePivoted(V (&column)[6], V right) {
  LinearSolution solution;
  solution.determinant = 1.0;
  int pivot_of[6];
  double inverse_of[6];
  int row_of[6] = {0, 1, 2, 3, 4, 5};
  for (int k = 0; k < 6; ++k) {
    Lanes current;
    Store(column[k], current);
    int best = k;
    double largest = -1.0;
    for (int i = k; i < 6; ++i) {
      const double size = __builtin_fabs(current.lane[row_of[i]]);
      best = size > largest ? i : best;
      largest = size > largest ? size : largest;
    }
    const int p = row_of[best];
    row_of[best] = row_of[k];
    solution.determinant *= best == k ? current.lane[p] : -current.lane[p];
    pivot_of[k] = p;
    inverse_of[k] = 1.0 / current.lane[p];
    current.lane[p] = 0.0;
    const V factor = Load(current) * inverse_of[k];
    for (int c = k + 1; c < 6; ++c) {
      column[c] -= factor * column[c][p];
    }
    right -= factor * right[p];
  }
  for (int k = 0; k < 6; ++k) {
    solution.x[k] = right[pivot_of[k]] * inverse_of[k];
  }
  return solution;
}

// [[A, B], [C, D]] by 3 x 3 blocks, A the shift gradients of the three struts named first: x_turn from the
// Schur complement S = D - C A^-1 B. Where those three struts lie nearly in a plane, row pivoting takes over.
LAMBDAJET_INLINE LinearSolution SolveColumns(V (&column)[6], V right, const int (&order)[6], double parity) {
  Lanes stored[6];
  Lanes stored_right;
  for (int c = 0; c < 6; ++c) {
    Store(column[c], stored[c]);
  }
  Store(right, stored_right);
  using D3 = Vector3<double>;
  const auto shift = [&](int i) __attribute__((always_inline)) {
    return D3{stored[0].lane[order[i]], stored[1].lane[order[i]], stored[2].lane[order[i]]};
  };
  const auto turn = [&](int i) __attribute__((always_inline)) {
    return D3{stored[3].lane[order[i]], stored[4].lane[order[i]], stored[5].lane[order[i]]};
  };
  const D3 a0 = shift(0), a1 = shift(1), a2 = shift(2);
  const D3 a12 = Cross(a1, a2), a20 = Cross(a2, a0), a01 = Cross(a0, a1);
  const double det_a = Dot(a0, a12);
  if (!(__builtin_fabs(det_a) > 1e-2)) [[unlikely]] {
    LinearSolution solution = SolvePivoted(column, right);
    solution.determinant *= parity;
    return solution;
  }
  // Row i of the lower half: c = A^-T c_i gives the combination of the upper three struts with the same shift
  // gradient.
  const double inverse_a = 1.0 / det_a;
  const D3 b0 = turn(0), b1 = turn(1), b2 = turn(2);
  const double r0 = stored_right.lane[order[0]], r1 = stored_right.lane[order[1]],
               r2 = stored_right.lane[order[2]];
  D3 s[3];
  double t[3];
  for (int i = 0; i < 3; ++i) {
    const D3 c = shift(3 + i);
    const double m0 = Dot(c, a12) * inverse_a, m1 = Dot(c, a20) * inverse_a, m2 = Dot(c, a01) * inverse_a;
    const D3 d = turn(3 + i);
    s[i] = {d.x - m0 * b0.x - m1 * b1.x - m2 * b2.x, d.y - m0 * b0.y - m1 * b1.y - m2 * b2.y,
            d.z - m0 * b0.z - m1 * b1.z - m2 * b2.z};
    t[i] = stored_right.lane[order[3 + i]] - m0 * r0 - m1 * r1 - m2 * r2;
  }
  const D3 s12 = Cross(s[1], s[2]), s20 = Cross(s[2], s[0]), s01 = Cross(s[0], s[1]);
  const double det_s = Dot(s[0], s12);
  const double inverse_s = 1.0 / det_s;
  const D3 w{(s12.x * t[0] + s20.x * t[1] + s01.x * t[2]) * inverse_s,
             (s12.y * t[0] + s20.y * t[1] + s01.y * t[2]) * inverse_s,
             (s12.z * t[0] + s20.z * t[1] + s01.z * t[2]) * inverse_s};
  const double q0 = r0 - Dot(b0, w), q1 = r1 - Dot(b1, w), q2 = r2 - Dot(b2, w);
  LinearSolution solution;
  solution.determinant = det_a * det_s;
  solution.x[0] = (a12.x * q0 + a20.x * q1 + a01.x * q2) * inverse_a;
  solution.x[1] = (a12.y * q0 + a20.y * q1 + a01.y * q2) * inverse_a;
  solution.x[2] = (a12.z * q0 + a20.z * q1 + a01.z * q2) * inverse_a;
  solution.x[3] = w.x;
  solution.x[4] = w.y;
  solution.x[5] = w.z;
  return solution;
}

LAMBDAJET_INLINE void Gradients(const Vector3<V>& g, const Vector3<V>& turned, V (&column)[6]) {
  column[0] = g.x;
  column[1] = g.y;
  column[2] = g.z;
  const Vector3<V> moment = Cross(turned, g);
  column[3] = moment.x;
  column[4] = moment.y;
  column[5] = moment.z;
}

struct Quaternion {
  double w, x, y, z;
};

LAMBDAJET_INLINE Quaternion QuaternionOf(const double* R) {
  // Shepperd's choice of the largest component.
  const double trace = R[0] + R[4] + R[8];
  if (trace > 0.0) {
    const double s = 2.0 * Sqrt(trace + 1.0);
    return {0.25 * s, (R[7] - R[5]) / s, (R[2] - R[6]) / s, (R[3] - R[1]) / s};
  }
  if (R[0] > R[4] && R[0] > R[8]) {
    const double s = 2.0 * Sqrt(1.0 + R[0] - R[4] - R[8]);
    return {(R[7] - R[5]) / s, 0.25 * s, (R[1] + R[3]) / s, (R[2] + R[6]) / s};
  }
  if (R[4] > R[8]) {
    const double s = 2.0 * Sqrt(1.0 + R[4] - R[0] - R[8]);
    return {(R[2] - R[6]) / s, (R[1] + R[3]) / s, 0.25 * s, (R[5] + R[7]) / s};
  }
  const double s = 2.0 * Sqrt(1.0 + R[8] - R[0] - R[4]);
  return {(R[3] - R[1]) / s, (R[2] + R[6]) / s, (R[5] + R[7]) / s, 0.25 * s};
}

// Of a quaternion of any length.
LAMBDAJET_INLINE void RotationOf(const Quaternion& q, double* R) {
  const double inverse = 1.0 / (q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
  const double x = q.x * inverse, y = q.y * inverse, z = q.z * inverse;
  const double xx = x * q.x, yy = y * q.y, zz = z * q.z;
  const double xy = x * q.y, xz = x * q.z, yz = y * q.z;
  const double wx = x * q.w, wy = y * q.w, wz = z * q.w;
  R[0] = 1.0 - 2.0 * (yy + zz);
  R[1] = 2.0 * (xy - wz);
  R[2] = 2.0 * (xz + wy);
  R[3] = 2.0 * (xy + wz);
  R[4] = 1.0 - 2.0 * (xx + zz);
  R[5] = 2.0 * (yz - wx);
  R[6] = 2.0 * (xz - wy);
  R[7] = 2.0 * (yz + wx);
  R[8] = 1.0 - 2.0 * (xx + yy);
}

// q <- turn * q with the turn (1, w/2): the exact turn up to the third power of w. Its length grows and does
// not matter.
LAMBDAJET_INLINE Quaternion Turned(const Quaternion& q, const double* w) {
  const double a = 0.5 * w[0], b = 0.5 * w[1], c = 0.5 * w[2];
  return {q.w - a * q.x - b * q.y - c * q.z, q.x + a * q.w + b * q.z - c * q.y,
          q.y - a * q.z + b * q.w + c * q.x, q.z + a * q.y - b * q.x + c * q.w};
}

// Shortens a step that would leave the neighbourhood where Newton's line is any guide; returns its size
// squared, in mm^2.
LAMBDAJET_INLINE double LimitStep(const NewtonSettings& settings, double (&x)[6]) {
  const double shift = x[0] * x[0] + x[1] * x[1] + x[2] * x[2];
  const double turn = x[3] * x[3] + x[4] * x[4] + x[5] * x[5];
  if (turn > settings.largest_turn_rad * settings.largest_turn_rad ||
      shift > settings.largest_shift_mm * settings.largest_shift_mm) [[unlikely]] {
    const double by_turn = settings.largest_turn_rad / Sqrt(turn);
    const double by_shift = settings.largest_shift_mm / Sqrt(shift);
    const double scale = by_turn < by_shift ? by_turn : by_shift;
    for (double& component : x) {
      component *= scale;
    }
  }
  return shift + settings.lever_mm * settings.lever_mm * turn;
}

// Newton on the six lengths; `evaluate(pose)` gives lengths and, through its arguments, their gradients.
template <class Evaluate>
LAMBDAJET_INLINE NewtonResult Newton(V target, const RawPose& start, const NewtonSettings& settings,
                                     const Evaluate& evaluate) {
  NewtonResult result;
  result.pose = start;
  Quaternion q = QuaternionOf(start.R);
  bool small_step = false;
  for (;;) {
    V column[6];
    const V residual = target - evaluate(result.pose, column);
    result.residual_mm = Largest(Magnitude(residual));
    if (small_step && result.residual_mm <= settings.residual_tolerance_mm) {
      result.converged = true;
      return result;
    }
    if (result.iterations == settings.iteration_limit) {
      return result;
    }
    LinearSolution step = SolveColumns(column, residual, settings.strut_order, settings.order_parity);
    result.determinant_end = step.determinant;
    result.determinant_start = result.iterations == 0 ? step.determinant : result.determinant_start;
    const double size_squared = LimitStep(settings, step.x);
    if (!(size_squared < 1e300)) {  // singular or not a number: no line to follow
      return result;
    }
    ++result.iterations;
    small_step = size_squared < settings.step_tolerance_mm * settings.step_tolerance_mm;
    for (int i = 0; i < 3; ++i) {
      result.pose.p[i] += step.x[i];
    }
    q = Turned(q, step.x + 3);
    RotationOf(q, result.pose.R);
  }
}

struct JointState {
  V c1, s1, c2, s2, length;
};

LAMBDAJET_INLINE Vector3<V> TransposeTimes(const Lanes (&R)[9], const Vector3<V>& v) {
  return {Load(R[0]) * v.x + Load(R[3]) * v.y + Load(R[6]) * v.z,
          Load(R[1]) * v.x + Load(R[4]) * v.y + Load(R[7]) * v.z,
          Load(R[2]) * v.x + Load(R[5]) * v.y + Load(R[8]) * v.z};
}

LAMBDAJET_INLINE Vector3<V> Times(const Lanes (&R)[9], const Vector3<V>& v) {
  return {Load(R[0]) * v.x + Load(R[1]) * v.y + Load(R[2]) * v.z,
          Load(R[3]) * v.x + Load(R[4]) * v.y + Load(R[5]) * v.z,
          Load(R[6]) * v.x + Load(R[7]) * v.y + Load(R[8]) * v.z};
}

// What Newton on one joint needs, in the frame that turns with q1 (axis 1 is its y).
struct JointColumns {
  Vector3<V> residual;   // B - B(q1, q2, L)
  Vector3<V> by_q1;      // y x (B - A1)
  Vector3<V> by_q2;      // s2 x (B - A2)
  Vector3<V> by_length;  // u
};

LAMBDAJET_INLINE JointColumns ColumnsOf(const UniversalJointLanes& joints, const Vector3<V>& target_1,
                                        const JointState& state) {
  const V ce = Load(joints.cos_eps);
  const V se = Load(joints.sin_eps);
  const V su = Load(joints.sin_nu);
  const V cu = Load(joints.cos_nu);
  const V h = Load(joints.h);
  // Rx(q2) of u and of a3 + L u, then R2 = Rz(eps).
  const Vector3<V> u2{su, -state.s2 * cu, state.c2 * cu};
  const Vector3<V> w2{state.length * su, state.c2 * h - state.s2 * (state.length * cu),
                      state.s2 * h + state.c2 * (state.length * cu)};
  JointColumns columns;
  columns.by_length = {ce * u2.x - se * u2.y, se * u2.x + ce * u2.y, u2.z};
  const Vector3<V> from_a2{ce * w2.x - se * w2.y, se * w2.x + ce * w2.y, w2.z};
  const Vector3<V> from_a1{from_a2.x + Load(joints.ex), from_a2.y, from_a2.z + Load(joints.ez)};
  // The target turned back by q1.
  columns.residual = {state.c1 * target_1.x - state.s1 * target_1.z - from_a1.x, target_1.y - from_a1.y,
                      state.s1 * target_1.x + state.c1 * target_1.z - from_a1.z};
  columns.by_q1 = {from_a1.z, All(0.0), -from_a1.x};
  columns.by_q2 = {se * from_a2.z, -ce * from_a2.z, ce * from_a2.y - se * from_a2.x};
  return columns;
}

// Angles are kept as cosine and sine, so that no inverse function stands in the loop.
LAMBDAJET_INLINE void TurnPair(V angle, V& c, V& s) {
  V sine, cosine;
  SinCos(angle, sine, cosine);
  const V turned = c * cosine - s * sine;
  s = s * cosine + c * sine;
  c = turned;
}

LAMBDAJET_INLINE JointState IdealStart(const UniversalJointLanes& joints, const Vector3<V>& strut_M) {
  const Vector3<V> b = TransposeTimes(joints.R_MA, strut_M);
  const V level_squared = b.x * b.x + b.z * b.z;
  const V level = Sqrt(level_squared);
  const V length = Sqrt(level_squared + b.y * b.y);
  return {b.z / level, b.x / level, level / length, -b.y / length, length};
}

LAMBDAJET_INLINE V SolveJointLanes(const UniversalJointLanes& joints, const Vector3<V>& strut_M,
                                   const Vector3<V>& b_M, int update_limit, int& updates, JointState& state,
                                   JointColumns& columns) {
  state = IdealStart(joints, strut_M);
  const Vector3<V> from_a1_M{b_M.x - Load(joints.a1x), b_M.y - Load(joints.a1y), b_M.z - Load(joints.a1z)};
  const Vector3<V> target_1 = TransposeTimes(joints.R_M1, from_a1_M);
  for (updates = 0;; ++updates) {
    columns = ColumnsOf(joints, target_1, state);
    const V residual = Sqrt(Dot(columns.residual, columns.residual));
    if (updates == update_limit || Largest(residual - 1e-12 * state.length) <= 0.0) {
      return residual;
    }
    const Vector3<V> n23 = Cross(columns.by_q2, columns.by_length);
    const V scale = 1.0 / Dot(columns.by_q1, n23);
    const V dq1 = Dot(columns.residual, n23) * scale;
    const V dq2 = Dot(columns.residual, Cross(columns.by_length, columns.by_q1)) * scale;
    const V dlength = Dot(columns.residual, Cross(columns.by_q1, columns.by_q2)) * scale;
    TurnPair(dq1, state.c1, state.s1);
    TurnPair(dq2, state.c2, state.s2);
    state.length += dlength;
  }
}

// dL/dt = n . v_B / (n . u), n = (s1 x (B - A1)) x (s2 x (B - A2)), turned back into M.
LAMBDAJET_INLINE Vector3<V> LengthGradient(const UniversalJointLanes& joints, const JointState& state,
                                           const JointColumns& columns) {
  const Vector3<V> n = Cross(columns.by_q1, columns.by_q2);
  const V scale = 1.0 / Dot(n, columns.by_length);
  const Vector3<V> g{n.x * scale, n.y * scale, n.z * scale};
  const Vector3<V> g1{state.c1 * g.x + state.s1 * g.z, g.y, state.c1 * g.z - state.s1 * g.x};
  return Times(joints.R_M1, g1);
}

}  // namespace

LAMBDAJET_PROCESSOR_VERSIONS
void RotationOfKrylov(const double angles_rad[3], double R[9]) {
  double rotation[9];
  Krylov(angles_rad[0], angles_rad[1], angles_rad[2], rotation);
  std::memcpy(R, rotation, sizeof rotation);
}

LAMBDAJET_PROCESSOR_VERSIONS
void StrutLengths(const StrutLanes& struts, const RawPose& pose, Lanes& lengths_mm) {
  const Vector3<V> s = StrutVectors(struts, pose.p, TurnedJoints(struts, pose.R));
  Store(Sqrt(Dot(s, s)), lengths_mm);
}

LAMBDAJET_PROCESSOR_VERSIONS
void StrutLengthsOfKrylov(const StrutLanes& struts, const double pose[6], Lanes& lengths_mm) {
  double R[9];
  Krylov(pose[3], pose[4], pose[5], R);
  const Vector3<V> s = StrutVectors(struts, pose, TurnedJoints(struts, R));
  Store(Sqrt(Dot(s, s)), lengths_mm);
}

LAMBDAJET_PROCESSOR_VERSIONS
void StrutLengthsBlock(const StrutLanes& struts, const double* const pose_columns[6], std::size_t count,
                       double* const length_columns[6]) {
  const std::size_t whole = count - count % kLanes;
  for (std::size_t first = 0; first < whole; first += kLanes) {
    V pose[6];
    for (int c = 0; c < 6; ++c) {
      pose[c] = LoadFrom(pose_columns[c] + first);
    }
    V length[6];
    LengthsOfEightPoses(struts, pose, length);
    for (int j = 0; j < 6; ++j) {
      std::memcpy(length_columns[j] + first, &length[j], sizeof(V));
    }
  }
  if (whole == count) {
    return;
  }
  V pose[6];
  for (int c = 0; c < 6; ++c) {
    Lanes part;
    std::memcpy(part.lane, pose_columns[c] + whole, (count - whole) * sizeof(double));
    pose[c] = Load(part);
  }
  V length[6];
  LengthsOfEightPoses(struts, pose, length);
  for (int j = 0; j < 6; ++j) {
    std::memcpy(length_columns[j] + whole, &length[j], (count - whole) * sizeof(double));
  }
}

LAMBDAJET_PROCESSOR_VERSIONS
NewtonResult SolvePose(const StrutLanes& struts, const Lanes& lengths_mm, const RawPose& start,
                       const NewtonSettings& settings) {
  return Newton(
      Load(lengths_mm), start,
      settings, [&struts](const RawPose& pose, V(&column)[6]) __attribute__((always_inline)) {
        const Vector3<V> turned = TurnedJoints(struts, pose.R);
        const Vector3<V> s = StrutVectors(struts, pose.p, turned);
        const V length = Sqrt(Dot(s, s));
        const V inverse = 1.0 / length;
        Gradients(Vector3<V>{s.x * inverse, s.y * inverse, s.z * inverse}, turned, column);
        return length;
      });
}

LAMBDAJET_PROCESSOR_VERSIONS
int SolveJoints(const StrutLanes& struts, const UniversalJointLanes& joints, const RawPose& pose,
                int update_limit, JointAngles& joints_out) {
  const Vector3<V> turned = TurnedJoints(struts, pose.R);
  const Vector3<V> s = StrutVectors(struts, pose.p, turned);
  const Vector3<V> b{turned.x + pose.p[0], turned.y + pose.p[1], turned.z + pose.p[2]};
  JointState state;
  JointColumns columns;
  int updates = 0;
  const V residual = SolveJointLanes(joints, s, b, update_limit, updates, state, columns);
  Store(state.c1, joints_out.q1_cos);
  Store(state.s1, joints_out.q1_sin);
  Store(state.c2, joints_out.q2_cos);
  Store(state.s2, joints_out.q2_sin);
  Store(state.length, joints_out.length);
  Store(residual, joints_out.residual);
  return updates;
}

LAMBDAJET_PROCESSOR_VERSIONS
NewtonResult SolvePoseNonIdeal(const StrutLanes& struts, const UniversalJointLanes& joints,
                               const Lanes& lengths_mm, const RawPose& start,
                               const NewtonSettings& settings) {
  return Newton(
      Load(lengths_mm), start, settings,
      [&struts, &joints ](const RawPose& pose, V(&column)[6]) __attribute__((always_inline)) {
        const Vector3<V> turned = TurnedJoints(struts, pose.R);
        const Vector3<V> s = StrutVectors(struts, pose.p, turned);
        const Vector3<V> b{turned.x + pose.p[0], turned.y + pose.p[1], turned.z + pose.p[2]};
        JointState state;
        JointColumns columns;
        int updates = 0;
        SolveJointLanes(joints, s, b, 8, updates, state, columns);
        Gradients(LengthGradient(joints, state, columns), turned, column);
        return state.length;
      });
}

LAMBDAJET_PROCESSOR_VERSIONS
void LengthGradients(const StrutLanes& struts, const RawPose& pose, Lanes gradient[6]) {
  const Vector3<V> turned = TurnedJoints(struts, pose.R);
  const Vector3<V> s = StrutVectors(struts, pose.p, turned);
  const V inverse = 1.0 / Sqrt(Dot(s, s));
  V column[6];
  Gradients(Vector3<V>{s.x * inverse, s.y * inverse, s.z * inverse}, turned, column);
  for (int c = 0; c < 6; ++c) {
    Store(column[c], gradient[c]);
  }
}

LAMBDAJET_PROCESSOR_VERSIONS
void LengthGradientsNonIdeal(const StrutLanes& struts, const UniversalJointLanes& joints, const RawPose& pose,
                             const JointAngles& solved, Lanes gradient[6]) {
  const Vector3<V> turned = TurnedJoints(struts, pose.R);
  const Vector3<V> b{turned.x + pose.p[0] - Load(joints.a1x), turned.y + pose.p[1] - Load(joints.a1y),
                     turned.z + pose.p[2] - Load(joints.a1z)};
  const JointState state{Load(solved.q1_cos), Load(solved.q1_sin), Load(solved.q2_cos), Load(solved.q2_sin),
                         Load(solved.length)};
  const JointColumns columns = ColumnsOf(joints, TransposeTimes(joints.R_M1, b), state);
  V column[6];
  Gradients(LengthGradient(joints, state, columns), turned, column);
  for (int c = 0; c < 6; ++c) {
    Store(column[c], gradient[c]);
  }
}

}  // namespace lambdajet::kinematics::kernel
