// Laws of the hexapod: there and back, derivatives against complex steps, invariances, refusals, no allocation.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <complex>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <new>
#include <random>
#include <vector>

#include "kinematics/core/hexapod.hpp"
#include "kinematics/core/hexapod_jacobian.hpp"
#include "kinematics/core/hexapod_singularity.hpp"
#include "kinematics/core/service_area.hpp"
#include "tests/papers/kinematics_hexapod_cases.hpp"

namespace {
std::atomic<long> allocations{0};
}
// Counts what the solves below must not do. GCC takes the pair apart and sees malloc's memory given to free by another name.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wmismatched-new-delete"
void* operator new(std::size_t size) {
  allocations.fetch_add(1, std::memory_order_relaxed);
  void* memory = std::malloc(size == 0 ? 1 : size);
  return memory != nullptr ? memory : throw std::bad_alloc();
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
#pragma GCC diagnostic pop

namespace lambdajet::kinematics {
namespace {

using worked::kDeg;

class Poses {
 public:
  Poses(unsigned seed, double angle_deg) : random_(seed), angle_rad_(angle_deg * kDeg) {}
  PlatformPose operator()() {
    return {150 * U(), 150 * U(), 850 + 100 * U(), angle_rad_ * U(), angle_rad_ * U(), angle_rad_ * U()};
  }
  double U() { return unit_(random_); }

 private:
  std::mt19937_64 random_;
  std::uniform_real_distribution<double> unit_{-1.0, 1.0};
  double angle_rad_;
};

double ShiftError(const PlatformPose& a, const PlatformPose& b) {
  return std::max({std::abs(a.x_mm - b.x_mm), std::abs(a.y_mm - b.y_mm), std::abs(a.z_mm - b.z_mm)});
}
double AngleError(const PlatformPose& a, const PlatformPose& b) {
  return std::max({std::abs(a.psi_rad - b.psi_rad), std::abs(a.theta_rad - b.theta_rad),
                   std::abs(a.gamma_rad - b.gamma_rad)});
}

struct Tally {
  long poses = 0, failures = 0, iterations = 0;
  int most = 0;
  double shift_mm = 0.0, angle_rad = 0.0, relative_residual = 0.0;

  void Count(const HexapodForward& answer, const PlatformPose& truth, double shortest_mm) {
    ++poses;
    failures += answer.reason == Reason::kSolved ? 0 : 1;
    iterations += answer.iterations;
    most = std::max(most, answer.iterations);
    const PlatformPose got = answer.platform_pose();
    shift_mm = std::max(shift_mm, ShiftError(got, truth));
    angle_rad = std::max(angle_rad, AngleError(got, truth));
    relative_residual = std::max(relative_residual, answer.residual_mm / shortest_mm);
  }
  double mean() const { return static_cast<double>(iterations) / static_cast<double>(poses); }
  void Print(const char* name) const {
    std::printf(
        "%s: %ld poses, %ld failures, %.3f iterations on average, %d at most, %.1e mm, %.1e rad, residual "
        "%.1e L\n",
        name, poses, failures, mean(), most, shift_mm, angle_rad, relative_residual);
  }
};

Tally FromHome(const Hexapod& hexapod, unsigned seed, double angle_deg, int count) {
  Poses poses(seed, angle_deg);
  Tally tally;
  for (int i = 0; i < count; ++i) {
    const PlatformPose truth = poses();
    const HexapodInverse inverse = SolveInverse(hexapod, truth);
    tally.Count(SolveForwardFromHome(hexapod, inverse.actuators_mm), truth, inverse.lengths_mm.minCoeff());
  }
  return tally;
}

void ExpectRoundTrip(const Tally& tally) {
  EXPECT_EQ(tally.failures, 0);
  EXPECT_LE(tally.shift_mm, 1e-9);
  EXPECT_LE(tally.angle_rad, 1e-12);
  EXPECT_LE(tally.relative_residual, 1e-12);
}

TEST(HexapodRoundTrip, AMillionPosesFromHome) {
  const Tally tally = FromHome(Hexapod(worked::Geometry()), 1, 30, 1000000);
  tally.Print("ideal, from home, 30 deg");
  ExpectRoundTrip(tally);
}

TEST(HexapodRoundTrip, AHundredThousandPosesWithImperfectJoints) {
  const Tally tally = FromHome(Hexapod(worked::NonIdealGeometry()), 2, 30, 100000);
  tally.Print("non-ideal, from home, 30 deg");
  ExpectRoundTrip(tally);
}

TEST(HexapodRoundTrip, ImperfectJointsTenTimesWorse) {
  HexapodGeometry geometry = worked::Geometry();
  for (int j = 0; j < kStruts; ++j) {
    geometry.joints[static_cast<std::size_t>(j)] = worked::JointOf(worked::SignsOf(j), 0.5, 2e-3);
    geometry.length_zero_mm[j] = 500.0 + j;
  }
  ExpectRoundTrip(FromHome(Hexapod(geometry), 3, 30, 20000));
}

TEST(HexapodForward, NeedsFewIterationsFromHome) {
  const Hexapod hexapod(worked::Geometry());
  const Tally near = FromHome(hexapod, 4, 15, 100000);
  near.Print("ideal, from home, 15 deg");
  EXPECT_LE(near.mean(), 5.5);
  EXPECT_LE(near.most, 8);
  const Tally far = FromHome(hexapod, 5, 30, 100000);
  far.Print("ideal, from home, 30 deg");
  EXPECT_LE(far.mean(), 6.0);
  EXPECT_LE(far.most, 12);
}

PlatformPose OnPath(double w) {
  const double a = 15 * kDeg;
  return {150 * std::sin(w),     150 * std::cos(1.3 * w), 850 + 100 * std::sin(0.7 * w),
          a * std::sin(1.1 * w), a * std::sin(1.7 * w),   a * std::cos(0.9 * w)};
}

TEST(HexapodForward, NeedsFewerIterationsAlongAPath) {
  const Hexapod hexapod(worked::Geometry());
  Tally tally;
  Pose previous = OnPath(0.0).X_MP();
  for (int i = 1; i <= 100000; ++i) {
    const PlatformPose truth = OnPath(2 * M_PI * i / 2000.0);
    const HexapodInverse inverse = SolveInverse(hexapod, truth);
    const HexapodForward answer = SolveForward(hexapod, inverse.actuators_mm, previous);
    tally.Count(answer, truth, inverse.lengths_mm.minCoeff());
    previous = answer.X_MP;
  }
  tally.Print("ideal, along a path, 15 deg");
  ExpectRoundTrip(tally);
  EXPECT_LE(tally.mean(), 3.5);
  EXPECT_LE(tally.most, 4);
}

TEST(HexapodForward, AnswersWhatCannotBeSolved) {
  const Hexapod hexapod(worked::Geometry());
  StrutVector lengths = hexapod.home_lengths_mm();
  lengths[3] = 5000.0;  // no platform reaches that
  EXPECT_EQ(SolveForwardFromHome(hexapod, lengths).reason, Reason::kNotConverged);
  lengths[3] = -1.0;
  const HexapodForward negative = SolveForwardFromHome(hexapod, lengths);
  EXPECT_EQ(negative.reason, Reason::kOutOfReach);
  EXPECT_EQ(negative.strut, 3);
  lengths[3] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(SolveForwardFromHome(hexapod, lengths).reason, Reason::kNotFinite);
  Pose nowhere;
  nowhere.p_mm.x() = std::numeric_limits<double>::infinity();
  EXPECT_EQ(SolveForward(hexapod, hexapod.home_lengths_mm(), nowhere).reason, Reason::kNotFinite);
}

TEST(HexapodForward, NeverGivesAnswersThatAreNotFinite) {
  const Hexapod ideal(worked::Geometry());
  const Hexapod real(worked::NonIdealGeometry());
  std::mt19937_64 random(17);
  std::uniform_real_distribution<double> length(-10.0, 3000.0);
  int solved = 0;
  for (int i = 0; i < 20000; ++i) {
    StrutVector lengths;
    for (int j = 0; j < kStruts; ++j) {
      lengths[j] = length(random);
    }
    for (const Hexapod* hexapod : {&ideal, &real}) {
      const HexapodForward answer = SolveForwardFromHome(*hexapod, lengths);
      ASSERT_TRUE(answer.X_MP.p_mm.allFinite() && answer.X_MP.R.allFinite() &&
                  std::isfinite(answer.residual_mm));
      if (answer.reason == Reason::kSolved) {
        ++solved;
        ASSERT_LT((SolveInverse(*hexapod, answer.X_MP).actuators_mm - lengths).cwiseAbs().maxCoeff(), 1e-8);
      }
    }
  }
  EXPECT_GT(solved, 0);
}

TEST(HexapodForward, NamesAnotherAssembly) {
  // The platform mirrored below the base has the same lengths; a start there leads there, and its det J has the other sign.
  const Hexapod hexapod(worked::Geometry());
  const HexapodForward below =
      SolveForward(hexapod, hexapod.home_lengths_mm(), Pose{{0, 0, -700}, Eigen::Matrix3d::Identity()});
  const HexapodForward above = SolveForwardFromHome(hexapod, hexapod.home_lengths_mm());
  ASSERT_EQ(above.reason, Reason::kSolved);
  ASSERT_EQ(below.reason, Reason::kSolved);
  EXPECT_LT(below.X_MP.p_mm.z(), 0.0);
  EXPECT_EQ(above.assembly_sign, -below.assembly_sign);
}

TEST(HexapodInverse, PlainAndBlockAndPoseAgree) {
  const Hexapod hexapod(worked::Geometry());
  Poses poses(6, 30);
  constexpr std::size_t kCount = 1003;  // not a multiple of the lanes
  std::array<std::vector<double>, 6> in, out;
  std::vector<PlatformPose> list;
  for (std::size_t i = 0; i < kCount; ++i) {
    const PlatformPose p = poses();
    list.push_back(p);
    const std::array<double, 6> raw = {p.x_mm, p.y_mm, p.z_mm, p.psi_rad, p.theta_rad, p.gamma_rad};
    for (std::size_t c = 0; c < 6; ++c) {
      in[c].push_back(raw[c]);
      out[c].push_back(-1.0);
    }
  }
  PlatformPoseColumns pose_columns;
  StrutLengthColumns length_columns;
  for (std::size_t c = 0; c < 6; ++c) {
    out[c].push_back(-2.0);  // behind the end
    pose_columns.columns[c] = in[c].data();
    length_columns.columns[c] = out[c].data();
  }
  SolveInverseBlock(hexapod, pose_columns, kCount, length_columns);
  for (std::size_t i = 0; i < kCount; ++i) {
    const HexapodInverse plain = SolveInverse(hexapod, list[i]);
    const HexapodInverse by_pose = SolveInverse(hexapod, list[i].X_MP());
    for (std::size_t j = 0; j < 6; ++j) {
      ASSERT_NEAR(out[j][i], plain.lengths_mm[static_cast<int>(j)], 1e-12);
      ASSERT_NEAR(by_pose.lengths_mm[static_cast<int>(j)], plain.lengths_mm[static_cast<int>(j)], 1e-12);
    }
  }
  for (std::size_t c = 0; c < 6; ++c) {
    EXPECT_EQ(out[c][kCount], -2.0);
  }
}

TEST(HexapodInverse, ImperfectJointsReduceToPerfectOnes) {
  const Hexapod hexapod(worked::Geometry());
  Poses poses(7, 30);
  for (int i = 0; i < 10000; ++i) {
    const PlatformPose pose = poses();
    const StrutVector lengths = SolveInverse(hexapod, pose).lengths_mm;
    const std::array<SolvedJoint, 6> joints = SolveUniversalJoints(hexapod, pose.X_MP());
    for (int j = 0; j < kStruts; ++j) {
      ASSERT_NEAR(joints[static_cast<std::size_t>(j)].length_mm / lengths[j], 1.0, 1e-15 * 4);
      ASSERT_NEAR(joints[static_cast<std::size_t>(j)].length_mm, lengths[j], 1e-12);
    }
  }
}

TEST(HexapodKernel, SineAndCosineAreThoseOfTheLibrary) {
  std::mt19937_64 random(8);
  std::uniform_real_distribution<double> small(-7.0, 7.0), large(-1e5, 1e5);
  for (int i = 0; i < 100000; ++i) {
    const double angle = i % 2 == 0 ? small(random) : large(random);
    const double angles[3] = {angle, 0.0, 0.0};
    double R[9];
    kernel::RotationOfKrylov(angles, R);
    ASSERT_NEAR(R[1], std::sin(angle), 2.3e-16) << angle;
    ASSERT_NEAR(R[0], std::cos(angle), 2.3e-16) << angle;
  }
}

TEST(HexapodInverse, DoesNotChangeWhenEverythingMovesTogether) {
  Poses poses(9, 30);
  const Pose X_NM = Pose::FromRollPitchYaw({100, -50, 30}, {0.3, -0.2, 2.0});
  const Pose X_QP = Pose::FromRollPitchYaw({5, 6, 7}, {-0.1, 0.4, 0.2});
  HexapodGeometry moved = worked::NonIdealGeometry();
  for (int j = 0; j < kStruts; ++j) {
    moved.p_MA_mm.col(j) = X_NM * Eigen::Vector3d(moved.p_MA_mm.col(j));
    moved.p_PB_mm.col(j) = X_QP * Eigen::Vector3d(moved.p_PB_mm.col(j));
    moved.R_MA[static_cast<std::size_t>(j)] = X_NM.R * moved.R_MA[static_cast<std::size_t>(j)];
  }
  moved.X_MP_home = X_NM * moved.X_MP_home * X_QP.Inverse();
  const Hexapod here(worked::NonIdealGeometry());
  const Hexapod there(moved);
  for (int i = 0; i < 2000; ++i) {
    const Pose X_MP = poses().X_MP();
    const StrutVector off =
        SolveInverse(here, X_MP).lengths_mm - SolveInverse(there, X_NM * X_MP * X_QP.Inverse()).lengths_mm;
    ASSERT_LT(off.cwiseAbs().maxCoeff(), 1e-11);
  }
}

TEST(HexapodTool, OffsetHoldsWhenTilted) {
  HexapodGeometry geometry = worked::Geometry();
  geometry.X_PT = Pose::FromRollPitchYaw({10, -20, -150}, {0.1, 0.2, 0.3});
  const Hexapod hexapod(geometry);
  Poses poses(10, 30);
  for (int i = 0; i < 1000; ++i) {
    const Pose X_MP = poses().X_MP();
    const Pose X_MT = ToolFromPlatform(hexapod, X_MP);
    EXPECT_LT((X_MT.p_mm - (X_MP.p_mm + X_MP.R * geometry.X_PT.p_mm)).norm(), 1e-12 * 1e3);
    const Pose back = PlatformFromTool(hexapod, X_MT);
    ASSERT_LT((back.p_mm - X_MP.p_mm).norm(), 1e-12 * 1e3);
    ASSERT_LT((back.R - X_MP.R).norm(), 1e-14 * 10);
  }
}

TEST(Rotations, EveryConventionReadsBackWhatItWrote) {
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> full(-3.1, 3.1), half(-1.55, 1.55);
  for (int i = 0; i < 20000; ++i) {
    const KrylovAngles k{full(random), half(random), full(random)};
    const KrylovAngles k2 = KrylovAngles::Of(k.Rotation());
    ASSERT_NEAR(k2.psi_rad, k.psi_rad, 1e-13);
    ASSERT_NEAR(k2.theta_rad, k.theta_rad, 1e-13);
    ASSERT_NEAR(k2.gamma_rad, k.gamma_rad, 1e-13);
    const RollPitchYaw r{full(random), half(random), full(random)};
    const RollPitchYaw r2 = RollPitchYaw::Of(r.Rotation());
    ASSERT_NEAR(r2.roll_rad, r.roll_rad, 1e-13);
    ASSERT_NEAR(r2.pitch_rad, r.pitch_rad, 1e-13);
    ASSERT_NEAR(r2.yaw_rad, r.yaw_rad, 1e-13);
    const Eigen::Quaterniond q = UnitQuaternionOf(r.Rotation());
    ASSERT_GE(q.w(), 0.0);
    ASSERT_LT((Pose::FromQuaternion({0, 0, 0}, q).R - r.Rotation()).norm(), 1e-14);
  }
  for (const double sign : {1.0, -1.0}) {
    const Eigen::Matrix3d krylov = KrylovAngles{0.4, sign * M_PI / 2, 0.3}.Rotation();
    EXPECT_LT((KrylovAngles::Of(krylov).Rotation() - krylov).norm(), 1e-12);
    const Eigen::Matrix3d rpy = RollPitchYaw{0.4, sign * M_PI / 2, 0.3}.Rotation();
    EXPECT_LT((RollPitchYaw::Of(rpy).Rotation() - rpy).norm(), 1e-12);
  }
}

// --- Derivatives, against complex steps in a second, plain statement of the model.

using Complex = std::complex<double>;
using Vector3c = Eigen::Matrix<Complex, 3, 1>;
using Matrix3c = Eigen::Matrix<Complex, 3, 3>;
constexpr double kTiny = 1e-30;

Matrix3c Rx(Complex a) {
  return (Matrix3c() << 1, 0, 0, 0, std::cos(a), -std::sin(a), 0, std::sin(a), std::cos(a)).finished();
}
Matrix3c Ry(Complex a) {
  return (Matrix3c() << std::cos(a), 0, std::sin(a), 0, 1, 0, -std::sin(a), 0, std::cos(a)).finished();
}
Matrix3c Rz(Complex a) {
  return (Matrix3c() << std::cos(a), -std::sin(a), 0, std::sin(a), std::cos(a), 0, 0, 0, 1).finished();
}

struct ComplexStrut {
  Vector3c a, b;
  Matrix3c R_MA;
  Complex l0, a1x, a1y, a1z, dx, dz, ex, ez, eps, h, nu;
  Vector3c C;
  Matrix3c R;

  Complex& operator[](int p) {
    Complex* const places[kStrutParameters] = {&a[0], &a[1], &a[2], &b[0], &b[1], &b[2], &l0, &a1x, &a1y,
                                               &a1z,  &dx,   &dz,   &ex,   &ez,   &eps,  &h,  &nu};
    return *places[p];
  }

  Vector3c End(Complex q1, Complex q2, Complex L) const {
    const Vector3c u(std::sin(nu), 0.0, std::cos(nu));
    const Vector3c w = Vector3c(ex, 0, ez) + Rz(eps) * (Rx(q2) * (Vector3c(0, h, 0) + L * u));
    return a + R_MA * (Vector3c(a1x, a1y, a1z) + Rz(dz) * (Rx(dx) * (Ry(q1) * w)));
  }

  // Newton with a difference Jacobian of the real part: the imaginary part converges with it, one order a step.
  Complex Reading() const {
    const Vector3c target = C + R * b;
    const Vector3c s = R_MA.transpose() * (target - a);
    Complex q1 = std::atan(s[0] / s[2]);
    Complex L = std::sqrt(s[0] * s[0] + s[1] * s[1] + s[2] * s[2]);
    Complex q2 = -std::asin(s[1] / L);
    for (int i = 0; i < 30; ++i) {
      const Vector3c off = target - End(q1, q2, L);
      const double d = 1e-6;
      Matrix3c J;
      J.col(0) = (End(q1 + d, q2, L) - End(q1 - d, q2, L)) / (2 * d);
      J.col(1) = (End(q1, q2 + d, L) - End(q1, q2 - d, L)) / (2 * d);
      J.col(2) = (End(q1, q2, L + d) - End(q1, q2, L - d)) / (2 * d);
      const Vector3c step = J.inverse() * off;
      q1 += step[0];
      q2 += step[1];
      L += step[2];
    }
    return L - l0;
  }
};

ComplexStrut StrutOf(const HexapodGeometry& geometry, int j, const Pose& X_MP) {
  ComplexStrut strut;
  strut.R_MA = geometry.R_MA[static_cast<std::size_t>(j)].cast<Complex>();
  for (int p = 0; p < kStrutParameters; ++p) {
    strut[p] = ParameterValue(geometry, j, static_cast<StrutParameter>(p));
  }
  strut.C = X_MP.p_mm.cast<Complex>();
  strut.R = X_MP.R.cast<Complex>();
  return strut;
}

void ExpectJacobiansMatchComplexSteps(const HexapodGeometry& geometry, unsigned seed) {
  const Hexapod hexapod(geometry);
  Poses poses(seed, 30);
  double worst_pose = 0.0, worst_parameter = 0.0;
  for (int i = 0; i < 100; ++i) {
    const Pose X_MP = poses().X_MP();
    const PoseJacobian J = ActuatorJacobian(hexapod, X_MP);
    const ParameterJacobian P = ActuatorParameterJacobian(hexapod, X_MP);
    for (int j = 0; j < kStruts; ++j) {
      // Relative to the row's largest entry of the same unit: an entry that is zero by symmetry has no size of its own.
      for (int c = 0; c < 6; ++c) {
        ComplexStrut strut = StrutOf(geometry, j, X_MP);
        if (c < 3) {
          strut.C[c] += Complex(0, kTiny);
        } else {
          strut.R += Complex(0, kTiny) * (CrossMatrix(Eigen::Vector3d::Unit(c - 3)) * X_MP.R).cast<Complex>();
        }
        const double truth = strut.Reading().imag() / kTiny;
        const double scale = J.block<1, 3>(j, c < 3 ? 0 : 3).cwiseAbs().maxCoeff();
        worst_pose = std::max(worst_pose, std::abs(J(j, c) - truth) / scale);
      }
      for (int p = 0; p < kStrutParameters; ++p) {
        ComplexStrut strut = StrutOf(geometry, j, X_MP);
        strut[p] += Complex(0, kTiny);
        const double truth = strut.Reading().imag() / kTiny;
        const double scale = std::max(std::abs(truth), 1e-4);
        worst_parameter = std::max(worst_parameter, std::abs(P(j, p) - truth) / scale);
      }
    }
  }
  std::printf("worst relative difference from complex steps: pose %.1e, parameters %.1e\n", worst_pose,
              worst_parameter);
  EXPECT_LE(worst_pose, 1e-8);
  EXPECT_LE(worst_parameter, 1e-8);
}

TEST(HexapodJacobian, OfPerfectJointsMatchesComplexSteps) {
  ExpectJacobiansMatchComplexSteps(worked::Geometry(), 12);
}

TEST(HexapodJacobian, OfImperfectJointsMatchesComplexSteps) {
  HexapodGeometry geometry = worked::Geometry();
  for (int j = 0; j < kStruts; ++j) {
    geometry.joints[static_cast<std::size_t>(j)] = worked::JointOf(worked::SignsOf(j), 2.0, 0.02);
    geometry.joints[static_cast<std::size_t>(j)].a1y_mm = -1.0;
    geometry.length_zero_mm[j] = 3.0;
  }
  ExpectJacobiansMatchComplexSteps(geometry, 13);
}

template <class Function>
auto SixthOrder(const Function& f, double h) {
  return ((45.0 * (f(h) - f(-h)) - 9.0 * (f(2 * h) - f(-2 * h)) + (f(3 * h) - f(-3 * h))) / (60.0 * h))
      .eval();
}

HexapodGeometry WithScrews(HexapodGeometry geometry) {
  geometry.screw_lead_mm = 10.0;
  return geometry;
}

TEST(HexapodScrews, JacobiansMatchDifferencesOfHighOrder) {
  const HexapodGeometry geometry = WithScrews(worked::NonIdealGeometry());
  const Hexapod hexapod(geometry);
  Poses poses(14, 30);
  for (int i = 0; i < 50; ++i) {
    const Pose X_MP = poses().X_MP();
    const PoseJacobian J = ActuatorJacobian(hexapod, X_MP);
    for (int c = 0; c < 6; ++c) {
      const double h = c < 3 ? 2.0 : 5e-3;
      const StrutVector truth = SixthOrder(
          [&](double t) {
            const Eigen::Vector3d axis = t * Eigen::Vector3d::Unit(c % 3);
            const Eigen::Vector3d none = Eigen::Vector3d::Zero();
            return SolveInverse(hexapod, Displaced(X_MP, c < 3 ? axis : none, c < 3 ? none : axis))
                .actuators_mm;
          },
          h);
      const double scale = J.col(c).cwiseAbs().maxCoeff();
      ASSERT_LT((J.col(c) - truth).cwiseAbs().maxCoeff(), 1e-8 * scale);
    }
    const ParameterJacobian P = ActuatorParameterJacobian(hexapod, X_MP);
    for (int p = 0; p < 6; ++p) {
      const StrutVector truth = SixthOrder(
          [&](double t) {
            HexapodGeometry other = geometry;
            for (int j = 0; j < kStruts; ++j) {
              const auto parameter = static_cast<StrutParameter>(p);
              SetParameterValue(other, j, parameter, ParameterValue(geometry, j, parameter) + t);
            }
            return SolveInverse(Hexapod(other), X_MP).actuators_mm;
          },
          2.0);
      ASSERT_LT((P.col(p) - truth).cwiseAbs().maxCoeff(), 1e-8);
    }
  }
}

TEST(HexapodScrews, RoundTripAndSizeOfTheCoupling) {
  const Hexapod with(WithScrews(worked::Geometry()));
  const Hexapod without(worked::Geometry());
  Poses poses(15, 30);
  double largest = 0.0;
  for (int i = 0; i < 5000; ++i) {
    const PlatformPose truth = poses();
    const StrutVector readings = SolveInverse(with, truth).actuators_mm;
    largest = std::max(largest, (readings - SolveInverse(without, truth).actuators_mm).cwiseAbs().maxCoeff());
    const HexapodForward answer = SolveForwardFromHome(with, readings);
    ASSERT_EQ(answer.reason, Reason::kSolved);
    ASSERT_LT(ShiftError(answer.platform_pose(), truth), 1e-9);
    ASSERT_LT(AngleError(answer.platform_pose(), truth), 1e-12);
  }
  std::printf("a lead of 10 mm moves a reading by up to %.3f mm\n", largest);
  EXPECT_GT(largest, 0.1);
  EXPECT_LT(largest, 10.0);
  EXPECT_LT((SolveInverse(with, worked::Geometry().X_MP_home).actuators_mm - with.home_lengths_mm()).norm(),
            1e-12 * 1e3);
}

// A motion with constant twist rate in M to second order: pose(t) by composing small turns is not needed, since only
// derivatives at 0 are compared: R(t) = exp(w t + alpha t^2 / 2) has w and alpha at 0.
Pose AtTime(const Pose& X_MP, const Twist& twist, const TwistRate& rate, double t) {
  return Displaced(X_MP, twist.v_mm_per_s * t + rate.a_mm_per_s2 * (t * t / 2),
                   twist.w_rad_per_s * t + rate.alpha_rad_per_s2 * (t * t / 2));
}

TEST(HexapodMotion, MatchesDifferencesAndItsOwnInverse) {
  for (const HexapodGeometry& geometry :
       {worked::Geometry(), worked::NonIdealGeometry(), WithScrews(worked::NonIdealGeometry())}) {
    const Hexapod hexapod(geometry);
    Poses poses(16, 25);
    for (int i = 0; i < 100; ++i) {
      const Pose X_MP = poses().X_MP();
      const Twist twist{{100 * poses.U(), 100 * poses.U(), 100 * poses.U()},
                        {poses.U(), poses.U(), poses.U()}};
      const TwistRate rate{{500 * poses.U(), 500 * poses.U(), 500 * poses.U()},
                           {5 * poses.U(), 5 * poses.U(), 5 * poses.U()}};
      const ActuatorMotion motion = ActuatorMotionOf(hexapod, X_MP, twist, rate);
      const auto at = [&](double t) {
        return SolveInverse(hexapod, AtTime(X_MP, twist, rate, t)).actuators_mm;
      };
      const StrutVector velocity = SixthOrder(at, 2e-3);
      ASSERT_LT((motion.velocity_mm_per_s - velocity).norm(), 1e-8 * velocity.norm());
      const double h = 4e-3;
      const StrutVector acceleration = (-490.0 * at(0) + 270.0 * (at(h) + at(-h)) -
                                        27.0 * (at(2 * h) + at(-2 * h)) + 2.0 * (at(3 * h) + at(-3 * h))) /
                                       (180.0 * h * h);
      ASSERT_LT((motion.acceleration_mm_per_s2 - acceleration).norm(), 1e-6 * acceleration.norm());
      const PlatformMotion back = PlatformMotionOf(hexapod, X_MP, motion);
      ASSERT_EQ(back.reason, Reason::kSolved);
      ASSERT_LT((back.twist.v_mm_per_s - twist.v_mm_per_s).norm(), 1e-10 * 100);
      ASSERT_LT((back.twist.w_rad_per_s - twist.w_rad_per_s).norm(), 1e-12 * 10);
      ASSERT_LT((back.rate.a_mm_per_s2 - rate.a_mm_per_s2).norm(), 1e-9 * 500);
      ASSERT_LT((back.rate.alpha_rad_per_s2 - rate.alpha_rad_per_s2).norm(), 1e-11 * 500);
    }
  }
}

// --- Singularity and limits.

TEST(HexapodSingularity, ChangesSignWhenTheYawPassesNinetyDegrees) {
  const Hexapod hexapod(worked::Geometry());
  for (const double side : {1.0, -1.0}) {
    const auto at = [&](double psi_deg) {
      return AnalyseSingularity(hexapod, PlatformPose{0, 0, 800, side * psi_deg * kDeg, 0, 0}.X_MP());
    };
    EXPECT_GT(at(89.9).signed_margin, 0.0);
    EXPECT_LT(at(90.1).signed_margin, 0.0);
    EXPECT_LT(at(90.0).smallest_singular_value, 1e-12);
    EXPECT_GT(at(89.9).determinant_krylov_mm3, 0.0);
    EXPECT_LT(at(90.1).determinant_krylov_mm3, 0.0);
    EXPECT_LT(std::abs(at(90.0).determinant_krylov_mm3 / at(0.0).determinant_krylov_mm3), 1e-12);
  }
  EXPECT_EQ(PlatformMotionOf(hexapod, PlatformPose{0, 0, 800, 90 * kDeg, 0, 0}.X_MP(), {}).reason,
            Reason::kSingular);
}

TEST(HexapodSingularity, SingularValuesMultiplyToTheDeterminantAndBoundTheWeakestMotion) {
  const Hexapod hexapod(worked::NonIdealGeometry());
  Poses poses(18, 40);
  for (int i = 0; i < 500; ++i) {
    const Pose X_MP = poses().X_MP();
    const HexapodSingularity s = AnalyseSingularity(hexapod, X_MP);
    Eigen::Matrix<double, 6, 1> motion = s.weakest_motion;
    motion.tail<3>() /= s.characteristic_length_mm;
    ASSERT_NEAR((ActuatorJacobian(hexapod, X_MP) * motion).norm(), s.smallest_singular_value, 1e-12);
    ASSERT_GE(std::abs(s.determinant), std::pow(s.smallest_singular_value, 6));
    ASSERT_LE(std::abs(s.determinant), std::pow(s.largest_singular_value, 6));
    const PoseJacobian krylov = ActuatorJacobianKrylov(hexapod, PlatformPose::Of(X_MP));
    ASSERT_NEAR(krylov.determinant() / s.determinant_krylov_mm3, 1.0, 1e-9);
  }
}

TEST(HexapodLimits, NameStrutAndExcess) {
  HexapodGeometry geometry = worked::Geometry();
  geometry.limits.strut_min_mm = 700;
  geometry.limits.strut_max_mm = 1000;
  geometry.limits.base_cone_rad = 20 * kDeg;
  geometry.limits.platform_cone_rad = 25 * kDeg;
  geometry.limits.singular_margin = 0.1;
  const Hexapod hexapod(geometry);
  EXPECT_EQ(SolveInverseWithMargin(hexapod, worked::kPoses[0].X_MP()).reason, Reason::kSolved);

  const HexapodInverse high = SolveInverse(hexapod, PlatformPose{0, 0, 1000, 0, 0, 0});
  EXPECT_EQ(high.bound, HexapodBound::kStrutMax);
  EXPECT_NEAR(high.excess, high.lengths_mm[0] - 1000, 1e-12);
  EXPECT_EQ(SolveInverse(hexapod, PlatformPose{0, 0, 500, 0, 0, 0}).bound, HexapodBound::kStrutMin);

  HexapodGeometry long_struts = geometry;
  long_struts.limits.strut_min_mm = 300;
  long_struts.limits.strut_max_mm = 2000;
  const HexapodInverse aside = SolveInverse(Hexapod(long_struts), PlatformPose{400, 0, 700, 0, 0, 0});
  EXPECT_EQ(aside.reason, Reason::kJointLimit);
  EXPECT_EQ(aside.bound, HexapodBound::kBaseJointCone);
  long_struts.limits.base_cone_rad = 4.0;
  const HexapodInverse leaning = SolveInverse(Hexapod(long_struts), PlatformPose{0, 0, 800, 0, 35 * kDeg, 0});
  EXPECT_EQ(leaning.bound, HexapodBound::kPlatformJointCone);
  const HexapodInverse tilted = SolveInverse(hexapod, PlatformPose{0, 0, 800, 0, 30 * kDeg, 0});
  EXPECT_NE(tilted.reason, Reason::kSolved);
  EXPECT_GT(tilted.excess, 0.0);

  geometry.limits.base_cone_rad = geometry.limits.platform_cone_rad = 4.0;
  geometry.limits.strut_max_mm = 2000;
  const Hexapod loose(geometry);
  EXPECT_EQ(SolveInverseWithMargin(loose, PlatformPose{0, 0, 800, 88 * kDeg, 0, 0}.X_MP()).reason,
            Reason::kSingular);
  EXPECT_EQ(SolveInverseWithMargin(loose, PlatformPose{0, 0, 800, 100 * kDeg, 0, 0}.X_MP()).reason,
            Reason::kSingular);
}

TEST(HexapodLimits, RefuseWhatIsNotFinite) {
  for (const HexapodGeometry& geometry : {worked::Geometry(), worked::NonIdealGeometry()}) {
    const Hexapod hexapod(geometry);
    for (const double bad :
         {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), 1e300}) {
      for (int c = 0; c < 6; ++c) {
        std::array<double, 6> raw = {0, 0, 800, 0, 0, 0};
        raw[static_cast<std::size_t>(c)] = bad;
        const PlatformPose pose{raw[0], raw[1], raw[2], raw[3], raw[4], raw[5]};
        const HexapodInverse answer = SolveInverse(hexapod, pose);
        EXPECT_TRUE(answer.lengths_mm.allFinite() && answer.actuators_mm.allFinite());
        EXPECT_NE(answer.reason, Reason::kSolved);
      }
    }
  }
}

TEST(HexapodGeometryFaults, AreNamed) {
  EXPECT_EQ(FaultOf(worked::Geometry()), "");
  HexapodGeometry geometry = worked::Geometry();
  geometry.p_MA_mm(1, 2) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(FaultOf(geometry), "");
  geometry = worked::Geometry();
  geometry.limits.strut_max_mm = 0.0;
  EXPECT_NE(FaultOf(geometry), "");
  geometry = worked::Geometry();
  geometry.p_MA_mm.col(0) = geometry.X_MP_home * Eigen::Vector3d(geometry.p_PB_mm.col(0));
  EXPECT_NE(FaultOf(geometry), "");
  geometry = worked::Geometry();
  geometry.R_MA[3] *= 2.0;
  EXPECT_NE(FaultOf(geometry), "");
}

TEST(Allocations, NoneInAnySolve) {
  const Hexapod ideal(worked::Geometry());
  const Hexapod real(WithScrews(worked::NonIdealGeometry()));
  ServiceAreaMachine machine;
  machine.tilt_rad = 0.3;
  const long before = allocations.load();
  double sum = 0.0;
  for (const Hexapod* hexapod : {&ideal, &real}) {
    const Pose X_MP = worked::kPoses[1].X_MP();
    const HexapodInverse inverse = SolveInverseWithMargin(*hexapod, X_MP);
    sum += SolveForwardFromHome(*hexapod, inverse.actuators_mm).residual_mm;
    sum += ActuatorJacobian(*hexapod, X_MP).norm() + ActuatorParameterJacobian(*hexapod, X_MP).norm();
    sum += AnalyseSingularity(*hexapod, X_MP).condition;
    const ActuatorMotion motion = ActuatorMotionOf(*hexapod, X_MP, {{1, 2, 3}, {4, 5, 6}}, {});
    sum += PlatformMotionOf(*hexapod, X_MP, motion).twist.v_mm_per_s.norm();
  }
  sum += ExactArea(machine, ServiceRegion::kIntersection) + PaperClosedForm(machine).area_mm2;
  EXPECT_EQ(allocations.load() - before, 0);
  EXPECT_TRUE(std::isfinite(sum));
  ::operator delete(::operator new(8));  // the counter counts
  EXPECT_GE(allocations.load() - before, 1);
}

// --- Service area.

ServiceAreaMachine RandomMachine(std::mt19937_64& random) {
  const auto between = [&](double lo, double hi) {
    return std::uniform_real_distribution<double>(lo, hi)(random);
  };
  ServiceAreaMachine machine;
  machine.base_joint_spacing_mm = between(1000, 1500);
  machine.platform_joint_spacing_mm = between(200, 600);
  machine.strut_min_mm = between(350, 800);
  machine.strut_max_mm = machine.strut_min_mm + between(400, 900);
  machine.tool_length_mm = between(0, 300);
  machine.tilt_rad = between(0, 0.8);
  machine.height_mm = between(900, 1500);
  machine.frame_bottom_ratio = between(0.9, 1.4);
  return machine;
}

TEST(ServiceArea, ExactAreaMatchesAFineGrid) {
  std::mt19937_64 random(20);
  for (int n = 0; n < 6; ++n) {
    const ServiceAreaMachine machine = RandomMachine(random);
    const double width = machine.base_joint_spacing_mm * 1.5;
    const double left = machine.base_joint_spacing_mm / 2 - width / 2;
    const double cell = 1.0;
    for (const ServiceRegion region : {ServiceRegion::kPaper, ServiceRegion::kIntersection,
                                       ServiceRegion::kUnion, ServiceRegion::kSingleTilt}) {
      long inside = 0;
      for (double x = left + cell / 2; x < left + width; x += cell) {
        for (double y = -300 + cell / 2; y < machine.height_mm; y += cell) {
          inside += InRegion(machine, region, x, y) ? 1 : 0;
        }
      }
      const double exact = ExactArea(machine, region);
      EXPECT_NEAR(exact, static_cast<double>(inside) * cell * cell, 1e-3 * std::max(exact, 1e5))
          << RegionName(region);
    }
  }
}

TEST(ServiceArea, RegionsContainEachOther) {
  std::mt19937_64 random(21);
  for (int n = 0; n < 300; ++n) {
    const ServiceAreaMachine machine = RandomMachine(random);
    const double both = ExactArea(machine, ServiceRegion::kIntersection);
    const double one = ExactArea(machine, ServiceRegion::kSingleTilt);
    const double any = ExactArea(machine, ServiceRegion::kUnion);
    ASSERT_LE(both, one + 1e-6);
    ASSERT_LE(one, any + 1e-6);
    ASSERT_NEAR(both + any, 2 * one, 1e-5);
    ASSERT_LE(both, ExactArea(machine, ServiceRegion::kPaper) + 1e-6);
  }
}

}  // namespace
}  // namespace lambdajet::kinematics
