// Laws of the planar derivatives: Jacobians against complex steps, motions against each other and against
// differences, distances to singular lines against walking there.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <complex>
#include <random>

#include "tests/laws/kinematics_planar_cases.hpp"

namespace lambdajet::kinematics {
namespace {

using Complex = std::complex<double>;
constexpr double kStep = 1e-30;
constexpr double kRelative = 1e-8;

std::array<Complex, 9> Widen(const MechanismParameters& p) {
  std::array<Complex, 9> wide;
  std::copy(p.data(), p.data() + 9, wide.begin());
  return wide;
}

Eigen::Vector2d ImaginaryInverse(const std::array<Complex, 9>& p, const lambda::Point<Complex>& tool,
                                 WorkingMode mode) {
  const auto g = lambda::MakeGeometry(p.data());
  const auto q = lambda::ReadingsOf(g, lambda::CloseInverse(g, tool, mode.s1, mode.s2));
  return Eigen::Vector2d(q.q1_mm.imag(), q.q2_mm.imag()) / kStep;
}

Eigen::Vector2d ImaginaryForward(const std::array<Complex, 9>& p, const lambda::Readings<Complex>& q,
                                 const LambdaMechanism& m) {
  const auto g = lambda::MakeGeometry(p.data());
  const auto a = lambda::Assemble(g, q, m.assembly_mode, m.rails_apart);
  return Eigen::Vector2d(a.tool.x.imag(), a.tool.y.imag()) / kStep;
}

double Relative(const Eigen::MatrixXd& ours, const Eigen::MatrixXd& theirs) {
  return ((ours - theirs).cwiseAbs().array() / theirs.cwiseAbs().array().max(1.0)).maxCoeff();
}

template <class Check>
void ForEveryCase(int poses, Check check) {
  std::mt19937_64 random(99);
  for (const PlanarCase& c : PlanarCases()) {
    for (const WorkingMode mode : c.modes) {
      const auto m = LambdaMechanism::FromParameters(c.parameters, mode, AssemblyModeOf(c, mode));
      for (int i = 0; i < poses; ++i) {
        check(c, m, RandomPose(c, random));
      }
    }
  }
}

TEST(PlanarJacobian, ToTheToolMatchesComplexStep) {
  ForEveryCase(500, [](const PlanarCase& c, const LambdaMechanism& m, const Eigen::Vector2d& p) {
    const LambdaJacobians j = ComputeJacobians(m, p);
    ASSERT_TRUE(j.invertible);
    Eigen::Matrix2d expected;
    const auto wide = Widen(c.parameters);
    expected.col(0) = ImaginaryInverse(wide, {Complex(p.x(), kStep), p.y()}, m.working_mode);
    expected.col(1) = ImaginaryInverse(wide, {p.x(), Complex(p.y(), kStep)}, m.working_mode);
    ASSERT_LE(Relative(j.J_q_x, expected), kRelative) << c.name;
    ASSERT_NEAR(j.determinant, expected.determinant(),
                kRelative * std::max(1.0, std::abs(expected.determinant())));
    ASSERT_LE(Relative(j.J_x_q * expected, Eigen::Matrix2d::Identity()), kRelative) << c.name;
    const Eigen::Vector2d singular = expected.jacobiSvd().singularValues();
    ASSERT_NEAR(j.condition, singular[0] / singular[1], kRelative * j.condition) << c.name;
  });
}

TEST(PlanarJacobian, OfTheInverseToEveryParameterMatchesComplexStep) {
  ForEveryCase(300, [](const PlanarCase& c, const LambdaMechanism& m, const Eigen::Vector2d& p) {
    const LambdaJacobians j = ComputeJacobians(m, p);
    for (int k = 0; k < kMechanismParameterCount; ++k) {
      auto wide = Widen(c.parameters);
      wide[k] += Complex(0.0, kStep);
      ASSERT_LE(Relative(j.J_q_parameters.col(k), ImaginaryInverse(wide, {p.x(), p.y()}, m.working_mode)),
                kRelative)
          << c.name << ", " << ParameterName(static_cast<Parameter>(k));
    }
  });
}

TEST(PlanarJacobian, OfTheForwardToEveryParameterMatchesComplexStep) {
  ForEveryCase(300, [](const PlanarCase& c, const LambdaMechanism& m, const Eigen::Vector2d& p) {
    const LambdaJacobians j = ComputeJacobians(m, p);
    const Eigen::Vector2d q = SolveInverse(m, p).actuator_position_mm;
    for (int k = 0; k < kMechanismParameterCount; ++k) {
      auto wide = Widen(c.parameters);
      wide[k] += Complex(0.0, kStep);
      ASSERT_LE(Relative(j.J_x_parameters.col(k), ImaginaryForward(wide, {q.x(), q.y()}, m)), kRelative)
          << c.name << ", " << ParameterName(static_cast<Parameter>(k)) << " at " << p.transpose();
    }
  });
}

TEST(PlanarMotion, ForwardUndoesInverse) {
  ForEveryCase(300, [](const PlanarCase& c, const LambdaMechanism& m, const Eigen::Vector2d& p) {
    const Motion tool{p, {120.0, -80.0}, {900.0, 1500.0}};
    const MotionAnswer actuators = SolveInverseMotion(m, tool);
    const MotionAnswer back = SolveForwardMotion(m, actuators.motion);
    ASSERT_TRUE(back.differentiable) << c.name;
    ASSERT_LE((back.motion.velocity_mm_per_s - tool.velocity_mm_per_s).norm(), 1e-7) << c.name;
    ASSERT_LE((back.motion.acceleration_mm_per_s2 - tool.acceleration_mm_per_s2).norm(), 1e-5) << c.name;
  });
}

// Along p(t) = p + v t + a t^2/2 the complex step gives q'(t) to all digits; its central difference is q''.
TEST(PlanarMotion, AccelerationIsTheDerivativeOfVelocity) {
  ForEveryCase(100, [](const PlanarCase& c, const LambdaMechanism& m, const Eigen::Vector2d& p) {
    const Eigen::Vector2d v(0.7, -0.4), a(0.3, 0.9);
    const auto velocity = [&](double t) {
      const Eigen::Vector2d at = p + v * t + 0.5 * a * t * t;
      const Eigen::Vector2d rate = v + a * t;
      return ImaginaryInverse(Widen(c.parameters),
                              {Complex(at.x(), kStep * rate.x()), Complex(at.y(), kStep * rate.y())},
                              m.working_mode);
    };
    constexpr double h = 1e-2;
    const Eigen::Vector2d expected =
        (8.0 * (velocity(h) - velocity(-h)) - (velocity(2 * h) - velocity(-2 * h))) / (12.0 * h);
    const MotionAnswer ours = SolveInverseMotion(m, {p, v, a});
    ASSERT_LE((ours.motion.velocity_mm_per_s - velocity(0.0)).norm(), 1e-10 * velocity(0.0).norm());
    ASSERT_LE((ours.motion.acceleration_mm_per_s2 - expected).norm(),
              kRelative * std::max(1.0, expected.norm()))
        << c.name;
  });
}

TEST(PlanarSingularity, DistancesOnParallelRailsAreTrueDistances) {
  for (const double second : {500.0, 700.0}) {
    const auto m = LambdaMechanism::FromParameters(IdealLambda(1200, 600, second));
    const double reach = std::min(1200.0, 2.0 * second);
    for (double y = 5.0; y < reach; y += 7.0) {
      const InverseAnswer answer = SolveInverse(m, {250.0, y});
      EXPECT_NEAR(answer.serial_distance_mm, reach - y, 1e-9);
      EXPECT_NEAR(answer.parallel_distance_mm, y, 1e-9);
      EXPECT_EQ(ReportSingularity(m, {250.0, y}).type, SingularityType::kRegular);
    }
  }
}

// On tilted rails: walk along the report's direction of steepest descent and meet the locus at the distance
// it named.
TEST(PlanarSingularity, DistancesOnTiltedRailsHoldToSecondOrder) {
  const auto m =
      LambdaMechanism::FromParameters(WithRails(IdealLambda(1200, 600, 500), 2e-3, 0, -1e-3, 0, 0, 0));
  for (double y = 700.0; y < 980.0; y += 20.0) {
    const double claimed = ReportSingularity(m, {100.0, y}).second_link_distance_mm;
    double low = y, high = 1100.0;
    for (int i = 0; i < 60; ++i) {
      const double middle = 0.5 * (low + high);
      (SolveInverse(m, {100.0, middle}).positioned ? low : high) = middle;
    }
    EXPECT_NEAR(claimed, low - y, 0.01 * (low - y) + 0.05) << y;
  }
}

TEST(PlanarSingularity, IsRefusedWithinItsMarginAndNamesTheShortfall) {
  auto m = LambdaMechanism::FromParameters(IdealLambda(1200, 600, 700));
  m.singular_margin_mm = 20.0;
  const InverseAnswer near_rail = SolveInverse(m, {0.0, 12.0});
  EXPECT_EQ(near_rail.reason, Reason::kSingular);
  EXPECT_NEAR(near_rail.excess_mm, 8.0, 1e-9);
  EXPECT_EQ(ReportSingularity(m, {0.0, 12.0}).type, SingularityType::kParallel);
  EXPECT_EQ(ReportSingularity(m, {0.0, 1190.0}).type, SingularityType::kSerial);
  EXPECT_EQ(SolveInverse(m, {0.0, -100.0}).reason, Reason::kModeMismatch);
  const InverseAnswer beyond = SolveInverse(m, {0.0, 1207.5});
  EXPECT_EQ(beyond.reason, Reason::kOutOfReach);
  EXPECT_NEAR(beyond.excess_mm, 7.5, 1e-9);
}

TEST(PlanarSingularity, DeterminantsAreThoseOfTheClosureEquations) {
  ForEveryCase(50, [](const PlanarCase& c, const LambdaMechanism& m, const Eigen::Vector2d& p) {
    const SingularityReport r = ReportSingularity(m, p);
    ASSERT_NEAR(r.determinant * r.serial_determinant_mm2, r.parallel_determinant_mm2,
                1e-9 * std::abs(r.parallel_determinant_mm2) + 1e-6)
        << c.name;
  });
}

}  // namespace
}  // namespace lambdajet::kinematics
