// Laws of the planar solves: forward undoes inverse, batches answer as single solves do, nothing is ever NaN.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "tests/laws/kinematics_planar_cases.hpp"

namespace lambdajet::kinematics {
namespace {

constexpr int kPoses = 1'000'000;

TEST(PlanarRoundTrip, ForwardOfInverseIsThePoseOnEveryMechanismAndMode) {
  for (const PlanarCase& c : PlanarCases()) {
    for (const WorkingMode mode : c.modes) {
      const auto m = LambdaMechanism::FromParameters(c.parameters, mode, AssemblyModeOf(c, mode));
      std::vector<double> poses, actuators(2 * kPoses), back(2 * kPoses);
      std::vector<Reason> inverse(kPoses), forward(kPoses);
      std::mt19937_64 random(20221);
      for (int i = 0; i < kPoses; ++i) {
        const Eigen::Vector2d p = RandomPose(c, random);
        poses.insert(poses.end(), {p.x(), p.y()});
      }
      SolveInverseBatch(m, poses, actuators, inverse);
      SolveForwardBatch(m, actuators, back, forward);
      double worst = 0.0;
      int refused = 0;
      for (int i = 0; i < kPoses; ++i) {
        worst = std::max(worst, std::hypot(back[2 * i] - poses[2 * i], back[2 * i + 1] - poses[2 * i + 1]));
        refused += inverse[i] != Reason::kSolved || forward[i] != Reason::kSolved;
      }
      EXPECT_LE(worst, 1e-9) << c.name << ", mode " << mode.s1 << " " << mode.s2;
      EXPECT_EQ(refused, 0) << c.name << ", mode " << mode.s1 << " " << mode.s2;

      std::printf("round trip of %d poses: worst %.2e mm (%s, mode %+d %+d)\n", kPoses, worst, c.name.c_str(),
                  mode.s1, mode.s2);
    }
  }
}

TEST(PlanarRoundTrip, ForwardReadsTheWorkingModeThatInverseUsed) {
  std::mt19937_64 random(7);
  for (const PlanarCase& c : PlanarCases()) {
    for (const WorkingMode mode : c.modes) {
      const auto m = LambdaMechanism::FromParameters(c.parameters, mode, AssemblyModeOf(c, mode));
      for (int i = 0; i < 2000; ++i) {
        const Eigen::Vector2d p = RandomPose(c, random);
        const InverseAnswer inverse = SolveInverse(m, p);
        const ForwardAnswer forward = SolveForward(m, inverse.actuator_position_mm);
        ASSERT_EQ(forward.working_mode, mode) << c.name;
        const auto other = m.WithModes({-mode.s1, mode.s2}, m.assembly_mode);
        ASSERT_EQ(SolveForward(other, inverse.actuator_position_mm).reason, Reason::kModeMismatch) << c.name;
      }
    }
  }
}

TEST(PlanarRoundTrip, TheOtherAssemblyModeIsAnotherPoseOfTheSameReadings) {
  std::mt19937_64 random(11);
  for (const PlanarCase& c : PlanarCases()) {
    const WorkingMode mode = c.modes.front();
    const auto m = LambdaMechanism::FromParameters(c.parameters, mode, AssemblyModeOf(c, mode));
    for (int i = 0; i < 2000; ++i) {
      const Eigen::Vector2d p = RandomPose(c, random);
      const InverseAnswer inverse = SolveInverse(m, p);
      const ForwardAnswer other =
          SolveForward(m.WithModes(mode, -m.assembly_mode), inverse.actuator_position_mm);
      ASSERT_TRUE(other.positioned) << c.name;
      ASSERT_GT((other.p_DE_mm - p).norm(), 1.0) << c.name;
      const auto there = LambdaMechanism::FromParameters(c.parameters, other.working_mode, -m.assembly_mode);
      const InverseAnswer again = SolveInverse(there, other.p_DE_mm);
      ASSERT_LE((again.actuator_position_mm - inverse.actuator_position_mm).norm(), 1e-7) << c.name;
    }
  }
}

// Poses inside, outside, on the edges and absurd, on a mechanism with travel and margin.
std::vector<double> WildPoses(std::mt19937_64& random, int count) {
  std::uniform_real_distribution<double> wide(-2500.0, 2500.0);
  std::uniform_real_distribution<double> exponent(-320.0, 309.0);
  const double absurd[] = {0.0,
                           -0.0,
                           1200.0,
                           -1200.0,
                           1000.0,
                           1e9,
                           1e300,
                           std::numeric_limits<double>::infinity(),
                           std::numeric_limits<double>::quiet_NaN(),
                           std::numeric_limits<double>::denorm_min()};
  std::vector<double> poses;
  for (int i = 0; i < 2 * count; ++i) {
    const auto kind = random() % 16;
    poses.push_back(kind == 0   ? absurd[random() % std::size(absurd)]
                    : kind == 1 ? std::pow(10.0, exponent(random))
                                : wide(random));
  }
  return poses;
}

TEST(PlanarBatch, AnswersAsTheSingleSolveDoesForAnyPose) {
  std::mt19937_64 random(3);
  for (const PlanarCase& c : PlanarCases()) {
    auto m =
        LambdaMechanism::FromParameters(c.parameters, c.modes.front(), AssemblyModeOf(c, c.modes.front()));
    m.singular_margin_mm = 20.0;
    m.travel = {{{-1500.0, 1400.0}, {-1300.0, 1600.0}}};
    constexpr int kCount = 20'011;
    const std::vector<double> poses = WildPoses(random, kCount);
    std::vector<double> out(poses.size());
    std::vector<Reason> reasons(kCount);
    SolveInverseBatch(m, poses, out, reasons);
    for (int i = 0; i < kCount; ++i) {
      const InverseAnswer single = SolveInverse(m, {poses[2 * i], poses[2 * i + 1]});
      ASSERT_EQ(reasons[i], single.reason) << c.name << " at " << poses[2 * i] << ", " << poses[2 * i + 1];
      ASSERT_NEAR(out[2 * i], single.actuator_position_mm.x(), 1e-9);
      ASSERT_NEAR(out[2 * i + 1], single.actuator_position_mm.y(), 1e-9);
    }
    SolveForwardBatch(m, poses, out, reasons);
    for (int i = 0; i < kCount; ++i) {
      const ForwardAnswer single = SolveForward(m, {poses[2 * i], poses[2 * i + 1]});
      ASSERT_EQ(reasons[i], single.reason) << c.name << " at " << poses[2 * i] << ", " << poses[2 * i + 1];
      ASSERT_NEAR(out[2 * i], single.p_DE_mm.x(), 1e-9 * std::max(1.0, std::abs(single.p_DE_mm.x())));
      ASSERT_NEAR(out[2 * i + 1], single.p_DE_mm.y(), 1e-9 * std::max(1.0, std::abs(single.p_DE_mm.y())));
    }
  }
}

template <class Answer>
bool Finite(const Answer& a, const Eigen::Vector2d& positions) {
  return positions.allFinite() && std::isfinite(a.reach_margin_mm) && std::isfinite(a.serial_distance_mm) &&
         std::isfinite(a.parallel_distance_mm) && std::isfinite(a.travel_margin_mm) &&
         std::isfinite(a.excess_mm);
}

bool Finite(const LambdaJacobians& j) {
  return j.J_q_x.allFinite() && j.J_x_q.allFinite() && j.J_q_parameters.allFinite() &&
         j.J_x_parameters.allFinite() && std::isfinite(j.determinant) && std::isfinite(j.condition) &&
         std::isfinite(j.smallest_singular_value);
}

bool Finite(const SingularityReport& r) {
  return std::isfinite(r.main_link_distance_mm) && std::isfinite(r.second_link_distance_mm) &&
         std::isfinite(r.parallel_distance_mm) && std::isfinite(r.determinant) &&
         std::isfinite(r.serial_determinant_mm2) && std::isfinite(r.parallel_determinant_mm2) &&
         std::isfinite(r.condition);
}

bool Finite(const Motion& m) {
  return m.position_mm.allFinite() && m.velocity_mm_per_s.allFinite() && m.acceleration_mm_per_s2.allFinite();
}

TEST(PlanarAnswers, AreFiniteForAnyGeometryAndAnyPose) {
  std::mt19937_64 random(5);
  for (int g = 0; g < 300; ++g) {
    const std::vector<double> numbers = WildPoses(random, 5);
    MechanismParameters p = Eigen::Map<const MechanismParameters>(numbers.data());
    if (g % 3 != 0) {
      p.head<3>() = p.head<3>().cwiseAbs();  // mostly lengths that can be
      p.segment<3>(3) *= 1e-3;
    }
    auto m = LambdaMechanism::FromParameters(p, kAllModes[random() % 4], random() % 2 == 0 ? 1 : -1);
    const std::vector<double> poses = WildPoses(random, 300);
    for (std::size_t i = 0; i < 300; ++i) {
      const Eigen::Vector2d pose(poses[2 * i], poses[2 * i + 1]);
      const InverseAnswer inverse = SolveInverse(m, pose);
      ASSERT_TRUE(Finite(inverse, inverse.actuator_position_mm))
          << p.transpose() << " at " << pose.transpose();
      const ForwardAnswer forward = SolveForward(m, pose);
      ASSERT_TRUE(Finite(forward, forward.p_DE_mm)) << p.transpose() << " at " << pose.transpose();
      ASSERT_TRUE(Finite(ComputeJacobians(m, pose))) << p.transpose() << " at " << pose.transpose();
      ASSERT_TRUE(Finite(ReportSingularity(m, pose))) << p.transpose() << " at " << pose.transpose();
      const Motion motion{pose, pose.reverse(), {1.0, -2.0}};
      ASSERT_TRUE(Finite(SolveInverseMotion(m, motion).motion));
      ASSERT_TRUE(Finite(SolveForwardMotion(m, motion).motion));
    }
  }
}

}  // namespace
}  // namespace lambdajet::kinematics
