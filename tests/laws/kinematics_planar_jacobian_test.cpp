// Laws of the planar derivatives: Jacobians against complex steps, motions against each other and against
// differences, distances to singular lines against walking there.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <complex>
#include <cstdio>
#include <optional>
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

// How far the second link stands from square to its rail, and the tool from the line of the sliders, by drawing the
// mechanism; nothing where the main link does not reach.
struct Drawn {
  double second_mm;
  double side_mm;
};
std::optional<Drawn> Draw(const MechanismParameters& p, WorkingMode mode, const Eigen::Vector2d& tool) {
  const Eigen::Rotation2Dd rail_1(p[3]), rail_2(p[5]);
  const Eigen::Vector2d in_1 = rail_1.inverse() * (tool - Eigen::Vector2d(0.0, p[4]));
  if (std::abs(in_1.y()) >= p[0]) {
    return std::nullopt;
  }
  const double c = std::sqrt(p[0] * p[0] - in_1.y() * in_1.y());
  const Eigen::Vector2d slider_1 =
      rail_1 * Eigen::Vector2d(in_1.x() - mode.s1 * c, 0.0) + Eigen::Vector2d(0.0, p[4]);
  const Eigen::Vector2d attachment = slider_1 + p[1] / p[0] * (tool - slider_1);
  const Eigen::Vector2d in_2 = rail_2.inverse() * (attachment - Eigen::Vector2d(0.0, p[6]));
  const double d = std::sqrt(std::max(0.0, p[2] * p[2] - in_2.y() * in_2.y()));
  const Eigen::Vector2d slider_2 =
      rail_2 * Eigen::Vector2d(in_2.x() + mode.s2 * d, 0.0) + Eigen::Vector2d(0.0, p[6]);
  const Eigen::Vector2d a = slider_2 - slider_1, b = tool - slider_1;
  return Drawn{p[2] - std::abs(in_2.y()), a.x() * b.y() - a.y() * b.x()};
}

// The nearest place where `value` changes its sign, looked for along rays, then along finer ones around the best ray;
// nothing if the nearest lies where the mechanism ends.
template <class Value>
std::optional<double> NearestChange(const Eigen::Vector2d& from, double most_mm, Value value) {
  const auto along = [&](double angle) {
    const Eigen::Vector2d way(std::cos(angle), std::sin(angle));
    const double sign = *value(from) > 0.0 ? 1.0 : -1.0;
    for (double r = 0.0; r < most_mm; r += 5.0) {
      const auto next = value(from + (r + 5.0) * way);
      if (!next.has_value()) {
        return most_mm;
      }
      if (*next * sign <= 0.0) {
        double low = r, high = r + 5.0;
        for (int i = 0; i < 50; ++i) {
          const double middle = 0.5 * (low + high);
          const auto here = value(from + middle * way);
          (here.has_value() && *here * sign > 0.0 ? low : high) = middle;
        }
        return low;
      }
    }
    return most_mm;
  };
  double best = most_mm, at = 0.0;
  for (int i = 0; i < 360; ++i) {
    const double angle = 2.0 * M_PI * i / 360.0;
    const double distance = along(angle);
    if (distance < best) {
      best = distance;
      at = angle;
    }
  }
  if (best >= most_mm) {
    return std::nullopt;
  }
  double low = at - 2.0 * M_PI / 360.0, high = at + 2.0 * M_PI / 360.0;
  for (int i = 0; i < 60; ++i) {
    const double a = low + (high - low) / 3.0, b = high - (high - low) / 3.0;
    (along(a) <= along(b) ? high : low) = along(a) <= along(b) ? b : a;
  }
  return std::min(best, along(low));
}

TEST(PlanarSingularity, DistancesAreThoseOfAnIndependentSearch) {
  std::vector<PlanarCase> cases = PlanarCases();
  cases.push_back({"second link short, rails at a wide angle",
                   WithRails(IdealLambda(1200, 600, 500), 0.06, -5, -0.1, 20, 0, 0), kAllModes, -300, 300,
                   300, 900});
  std::mt19937_64 random(31);
  int serial = 0, parallel = 0;
  double worst_serial = 0.0, worst_parallel = 0.0;
  for (const PlanarCase& c : cases) {
    for (const WorkingMode mode : c.modes) {
      const auto m = LambdaMechanism::FromParameters(c.parameters, mode, AssemblyModeOf(c, mode));
      for (int i = 0; i < 8; ++i) {
        const Eigen::Vector2d p = RandomPose(c, random);
        const SingularityReport report = ReportSingularity(m, p);
        const auto second = NearestChange(p, 500.0, [&](const Eigen::Vector2d& at) -> std::optional<double> {
          const auto drawn = Draw(c.parameters, mode, at);
          return drawn ? std::optional(drawn->second_mm) : std::nullopt;
        });
        if (second.has_value()) {
          ++serial;
          worst_serial = std::max(worst_serial, std::abs(report.second_link_distance_mm - *second));
          EXPECT_NEAR(report.second_link_distance_mm, *second, 1e-6) << c.name << " at " << p.transpose();
        }
        const auto line = NearestChange(p, 500.0, [&](const Eigen::Vector2d& at) -> std::optional<double> {
          const auto drawn = Draw(c.parameters, mode, at);
          return drawn && drawn->second_mm > 0.0 ? std::optional(drawn->side_mm) : std::nullopt;
        });
        // Where rails cross at a wide angle the type 2 locus has a second branch, which can be nearer than the one below.
        if (line.has_value() &&
            (c.name != cases.back().name || std::abs(report.parallel_distance_mm) < 100.0)) {
          ++parallel;
          worst_parallel = std::max(worst_parallel, std::abs(report.parallel_distance_mm - *line));
          EXPECT_NEAR(report.parallel_distance_mm, *line, 1e-6) << c.name << " at " << p.transpose();
        }
      }
    }
  }
  EXPECT_GT(serial, 60);
  EXPECT_GT(parallel, 60);
  std::printf(
      "distance to the second link's line: %d poses, worst %.1e mm off the search; to type 2: %d, %.1e mm\n",
      serial, worst_serial, parallel, worst_parallel);
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
