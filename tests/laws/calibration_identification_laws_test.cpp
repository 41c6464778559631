// What must hold of identification whatever the truth: its covariance covers, chi-square means what it says, the order of the
// looks and the choice of D do not matter, and without noise it finds the truth.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>

#include "calibration/core/chi_square.hpp"
#include "calibration/core/elastic_response.hpp"
#include "calibration/core/identification.hpp"
#include "calibration/core/verification.hpp"
#include "tests/support/simulated_looks.hpp"

namespace lambdajet::calibration {
namespace {

using support::LookSimulator;
using support::PaperSizedMachine;

IdentificationOptions WithoutHoldOut() {
  IdentificationOptions options;
  options.hold_out_folds = 0;
  return options;
}

TEST(Identification, CoversTheTruthAndItsChiSquareIsHonest) {
  const MachineDescription machine = PaperSizedMachine();
  constexpr int kTruths = 40;
  int within = 0;
  int places = 0;
  double squared = 0.0;
  double chi_square = 0.0;
  double degrees = 0.0;
  int improbable = 0;
  double worst_before = 0.0;
  double worst_after = 0.0;
  double elastic_squared = 0.0;
  for (int seed = 1; seed <= kTruths; ++seed) {
    LookSimulator simulator(machine, static_cast<std::uint64_t>(seed));
    simulator.DrawTruth();
    const auto found = Identify(machine, simulator.MeasuringRun(), WithoutHoldOut());
    ASSERT_EQ(found.reason, IdentificationReason::kIdentified) << found.explanation;
    EXPECT_TRUE(found.elasticity_identified);
    for (const PlaceAccuracy& place : found.places) {
      const auto after = JetMiss(machine, found.parameters, simulator.truth(), place.p_W_mm);
      const auto before = JetMiss(machine, machine.parameters, simulator.truth(), place.p_W_mm);
      ASSERT_TRUE(after && before);
      const double distance = after->dot(place.covariance_mm2.inverse() * *after);
      within += distance < 11.829;  // 3 sigma of two coordinates: 99.73 %
      squared += distance;
      ++places;
      worst_before = std::max(worst_before, before->norm());
      worst_after = std::max(worst_after, after->norm());
    }
    const int lag = At(Parameter::kElasticLagS2);
    elastic_squared +=
        std::pow(found.parameters[lag] - simulator.truth()[lag], 2) / found.covariance(lag, lag);
    chi_square += found.chi_square;
    degrees += static_cast<double>(found.degrees_of_freedom);
    improbable += found.p_value < 0.01;
  }
  std::printf(
      "%d truths: %.1f %% of places within 3 sigma, mean squared distance %.2f (2 expected), chi-square/dof "
      "%.4f, "
      "jet's worst miss %.3f mm as set up, %.4f mm identified, (lag error/sigma)^2 %.2f\n",
      kTruths, 100.0 * within / places, squared / places, chi_square / degrees, worst_before, worst_after,
      elastic_squared / kTruths);
  EXPECT_GE(within, 0.95 * places);
  // The places of one truth go together, so the mean scatters like that of some 40 x 4 numbers.
  EXPECT_GT(squared / places, 1.2);
  EXPECT_LT(squared / places, 3.2);
  EXPECT_NEAR(chi_square / degrees, 1.0, 5.0 * std::sqrt(2.0 / degrees));
  EXPECT_LE(improbable, 3);
  EXPECT_LT(elastic_squared / kTruths, 2.5);
  EXPECT_LT(worst_after, 0.05 * worst_before);
}

TEST(Identification, DoesNotDependOnTheOrderOfTheLooks) {
  const MachineDescription machine = PaperSizedMachine();
  LookSimulator simulator(machine, 7);
  simulator.DrawTruth();
  auto run = simulator.MeasuringRun();
  const auto first = Identify(machine, run, WithoutHoldOut());
  std::mt19937 random(3);
  std::shuffle(run.begin(), run.end(), random);
  const auto second = Identify(machine, run, WithoutHoldOut());
  EXPECT_EQ(first.parameters, second.parameters);
  EXPECT_EQ(first.covariance, second.covariance);
  EXPECT_EQ(first.chi_square, second.chi_square);
}

TEST(Identification, FindsThePlaceOfTheJetExactlyAsNoiseVanishes) {
  double last = 1e9;
  for (const double scale : {1.0, 0.1, 0.01}) {
    MachineDescription machine = PaperSizedMachine();
    Uncertainties& u = machine.uncertainties;
    for (double* sigma : {&u.straightness_mm, &u.backlash_mm, &u.camera_mm, &u.mark_mm, &u.jet_wander_mm}) {
      *sigma *= scale;
    }
    LookSimulator simulator(machine, 11);
    simulator.DrawTruth();
    const auto found = Identify(machine, simulator.MeasuringRun(), WithoutHoldOut());
    ASSERT_EQ(found.reason, IdentificationReason::kIdentified) << found.explanation;
    double worst = 0.0;
    for (const PlaceAccuracy& place : found.places) {
      worst = std::max(worst, JetMiss(machine, found.parameters, simulator.truth(), place.p_W_mm)->norm());
    }
    EXPECT_LT(worst, 0.5 * last);
    EXPECT_LT(worst, 2.0 * found.worst_place_mm);
    last = worst;
  }
  EXPECT_LT(last, 1e-3);
}

// D's origin and direction are a choice: a truth described in another D gives the same looks and the same cuts.
TEST(Gauge, ChangesNoLookAndNoCut) {
  const MachineDescription machine = PaperSizedMachine();
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  for (int trial = 0; trial < 200; ++trial) {
    LookSimulator simulator(machine, 100 + static_cast<std::uint64_t>(trial));
    simulator.DrawTruth();
    ParameterVector p = simulator.truth();
    p[At(Parameter::kRail2AngleRad)] =
        p[At(Parameter::kRail1AngleRad)];  // parallel rails may slide along themselves
    ParameterVector moved = p;
    const double along = uniform(random), across = uniform(random), turn = 0.05 * uniform(random);
    const double angle = p[At(Parameter::kRail1AngleRad)];
    const Eigen::Vector2d shift(along * std::cos(angle), along * std::sin(angle) + across);
    moved[At(Parameter::kSlider1ZeroMm)] += along;
    moved[At(Parameter::kSlider2ZeroMm)] += along;
    moved[At(Parameter::kRail1OffsetMm)] += across;
    moved[At(Parameter::kRail2OffsetMm)] += across;
    moved.segment<2>(At(Parameter::kBaseXMm)) += shift;
    // Both poses together, and the whole of D turned; a rail's offset is taken along D's new y.
    const Eigen::Vector2d both(uniform(random), uniform(random));
    moved.segment<2>(At(Parameter::kBaseXMm)) += both;
    moved.segment<2>(At(Parameter::kSheetXMm)) += both;
    const Eigen::Matrix2d R = PlanarPose{0, 0, turn}.rotation();
    for (const Parameter t : {Parameter::kBaseXMm, Parameter::kSheetXMm}) {
      moved.segment<2>(At(t)) = R * moved.segment<2>(At(t));
      moved[At(t) + 2] += turn;
    }
    for (const int rail : {0, 1}) {
      const int a = At(Parameter::kRail1AngleRad) + 2 * rail;
      const double before = moved[a];
      const double offset = moved[a + 1];
      moved[a] += turn;
      // R (0, offset) = (0, offset') + slide * u(angle + turn)
      const double slide = -offset * std::sin(turn) / std::cos(before + turn);
      moved[a + 1] = offset * std::cos(turn) - slide * std::sin(before + turn);
      moved[At(Parameter::kSlider1ZeroMm) + rail] += slide;
    }
    Measurement look = simulator.Still(1 + trial % 20);
    const auto seen = PredictLook(machine, p, look);
    const auto seen_moved = PredictLook(machine, moved, look);
    ASSERT_TRUE(seen.closed && seen_moved.closed);
    EXPECT_LT((seen.p_C_mm - seen_moved.p_C_mm).norm(), 1e-9);
    EXPECT_LT((PlaceJet(machine, p, look.actuator_position_mm).p_WJ_mm -
               PlaceJet(machine, moved, look.actuator_position_mm).p_WJ_mm)
                  .norm(),
              1e-9);
  }
}

TEST(LookModel, JacobiansAreTheDerivatives) {
  const MachineDescription machine = PaperSizedMachine();
  for (int trial = 0; trial < 100; ++trial) {
    LookSimulator simulator(machine, 500 + static_cast<std::uint64_t>(trial));
    simulator.DrawTruth();
    const Measurement look = trial % 2 == 0 ? simulator.Still(1 + trial % 20)
                                            : simulator.Hole(1, {20.0 + 4.0 * trial, 100.0 + 2.0 * trial});
    const auto predicted = PredictLook(machine, simulator.truth(), look);
    const auto jet = PlaceJet(machine, simulator.truth(), look.actuator_position_mm);
    for (int i = 0; i < kAll; ++i) {
      const double h = 1e-4 * std::sqrt(machine.covariance(i, i)) + 1e-9;
      ParameterVector up = simulator.truth(), down = simulator.truth();
      up[i] += h;
      down[i] -= h;
      const Eigen::Vector2d by_difference =
          (PredictLook(machine, up, look).p_C_mm - PredictLook(machine, down, look).p_C_mm) / (2.0 * h);
      const Eigen::Vector2d jet_by_difference = (PlaceJet(machine, up, look.actuator_position_mm).p_WJ_mm -
                                                 PlaceJet(machine, down, look.actuator_position_mm).p_WJ_mm) /
                                                (2.0 * h);
      const double allowed = 1e-6 * (1.0 + predicted.J.col(i).norm()) + 1e-11 / h;
      EXPECT_LT((predicted.J.col(i) - by_difference).norm(), allowed)
          << ParameterName(static_cast<Parameter>(i));
      EXPECT_LT((jet.J.col(i) - jet_by_difference).norm(), 1e-6 * (1.0 + jet.J.col(i).norm()) + 1e-11 / h);
    }
  }
}

// Any stiffness, damping and step; the reference takes 2000 classical Runge-Kutta steps.
TEST(ElasticResponse, SolvesTheSpringMassEquationExactly) {
  std::mt19937_64 random(17);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  for (int trial = 0; trial < 300; ++trial) {
    const double lag = 1e-3 * std::exp(2.0 * uniform(random));
    double damping = 2.0 * std::sqrt(lag) * std::exp(3.0 * uniform(random));
    if (trial % 10 == 0) {
      damping = 2.0 * std::sqrt(lag);  // critical
    }
    const double T = 0.05 * (1.1 + uniform(random));
    const AccelerationCubic<double> a = {500.0 * uniform(random), 5e3 * uniform(random),
                                         5e4 * uniform(random), 5e5 * uniform(random)};
    const Deflection<double> start{uniform(random), 10.0 * uniform(random)};
    const auto end = Advance(start, lag, damping, a, T);
    double u = start.u_mm, v = start.velocity_mm_per_s;
    const int steps = 2000;
    const double h = T / steps;
    const auto f = [&](double t, double x, double w) {
      return -(((a[3] * t + a[2]) * t + a[1]) * t + a[0]) - (damping * w + x) / lag;
    };
    for (int k = 0; k < steps; ++k) {
      const double t = k * h;
      const double k1 = f(t, u, v), k2 = f(t + h / 2, u + h / 2 * v, v + h / 2 * k1);
      const double k3 = f(t + h / 2, u + h / 2 * (v + h / 2 * k1), v + h / 2 * k2);
      const double k4 = f(t + h, u + h * (v + h / 2 * k2), v + h * k3);
      u += h / 6 * (v + 2 * (v + h / 2 * k1) + 2 * (v + h / 2 * k2) + (v + h * k3));
      v += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
    }
    EXPECT_NEAR(end.u_mm, u, 1e-8 * (1.0 + std::abs(u)));
    EXPECT_NEAR(end.velocity_mm_per_s, v, 1e-6 * (1.0 + std::abs(v)));
  }
}

TEST(ChiSquare, TailAgreesWithSampling) {
  std::mt19937_64 random(23);
  for (const int k : {1, 2, 5, 40, 500}) {
    std::chi_squared_distribution<double> chi(k);
    int beyond = 0;
    const double limit = k + 1.3 * std::sqrt(2.0 * k);
    const int samples = 20000;
    for (int i = 0; i < samples; ++i) {
      beyond += chi(random) > limit;
    }
    const double expected = ChiSquareUpperTail(limit, k);
    EXPECT_NEAR(static_cast<double>(beyond) / samples, expected, 5.0 * std::sqrt(expected / samples));
  }
}

TEST(Verification, RaisesFewFalseAlarmsAndSeesThirtyFiveMicrometres) {
  MachineDescription machine = PaperSizedMachine();
  int alarms = 0;
  int seen = 0;
  double squared = 0.0;
  constexpr int kTrials = 25;
  for (int trial = 0; trial < kTrials; ++trial) {
    LookSimulator simulator(machine, 900 + static_cast<std::uint64_t>(trial));
    simulator.DrawTruth();
    const auto found = Identify(machine, simulator.MeasuringRun(), WithoutHoldOut());
    ASSERT_EQ(found.reason, IdentificationReason::kIdentified);
    MachineDescription active = machine;
    active.parameters = found.parameters;
    active.covariance = found.covariance;
    const auto looks = [&] {
      return std::vector<Measurement>{simulator.Still(1), simulator.Still(5), simulator.Still(16),
                                      simulator.Still(20)};
    };
    const auto standing = VerifyBase(active, looks());
    alarms += standing.verdict != Verdict::kPass;
    if (standing.verdict != Verdict::kPass) {
      std::printf("%s p %.4f move p %.4f\n", standing.explanation.c_str(), standing.p_value,
                  standing.move_p_value);
    }
    ParameterVector moved = simulator.truth();
    moved[At(Parameter::kBaseXMm)] += 0.028;
    moved[At(Parameter::kBaseYMm)] -= 0.021;
    simulator.SetTruth(moved);
    const auto verification = VerifyBase(active, looks());
    seen += verification.verdict == Verdict::kMoved;
    const Eigen::Vector3d error = verification.move - Eigen::Vector3d(0.028, -0.021, 0.0);
    squared += error.dot(verification.move_covariance.inverse() * error);
  }
  std::printf(
      "false alarms %d of %d, a move of 35 um seen %d times, mean squared error of the move %.2f (3 "
      "expected)\n",
      alarms, kTrials, seen, squared / kTrials);
  EXPECT_LE(alarms, 1);
  EXPECT_GE(seen, 0.8 * kTrials);
  EXPECT_LT(squared / kTrials, 6.0);
}

}  // namespace
}  // namespace lambdajet::calibration
