// What holds for every prediction: agreement of both ways to propagate, bounds, invariances.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "accuracy/core/counter_random.hpp"
#include "accuracy/core/error_map.hpp"
#include "accuracy/core/jet_lag.hpp"
#include "accuracy/core/prediction.hpp"
#include "tests/support/sample_machine.hpp"

namespace lambdajet::accuracy {
namespace {

using support::CirclePlan;
using support::SampleMachine;

constexpr Eigen::Index Index(Parameter p) { return static_cast<Eigen::Index>(p); }

void SetSigma(MachineDescription& m, Parameter p, double sigma) {
  m.covariance(Index(p), Index(p)) = sigma * sigma;
}

MachineDescription UncertainMachine() {
  MachineDescription m = SampleMachine();
  SetSigma(m, Parameter::kMainLinkLengthMm, 0.02);
  SetSigma(m, Parameter::kSlider1ZeroMm, 0.03);
  SetSigma(m, Parameter::kBaseXMm, 0.05);
  SetSigma(m, Parameter::kBaseYMm, 0.02);
  SetSigma(m, Parameter::kSheetThetaRad, 1e-4);
  SetSigma(m, Parameter::kElasticLagS2, 4e-5);
  SetSigma(m, Parameter::kDampingTimeS, 4e-4);
  m.uncertainties.following_mm = 0.01;
  m.uncertainties.backlash_mm = 0.02;
  m.uncertainties.straightness_mm = 0.005;
  m.uncertainties.jet_wander_mm = 0.003;
  m.uncertainties.jet_lag_relative = 0.2;
  return m;
}

// Where the jet really meets the sheet on a machine of other parameters, the readings held.
Eigen::Vector2d TruePlace(const MachineDescription& truth, const Eigen::Vector2d& q) {
  const auto forward = kinematics::SolveForward(kinematics::LambdaMechanism::FromDescription(truth), q);
  const Eigen::Vector2d p_E = truth.X_DJ().translation_mm() - forward.p_DE_mm;
  return truth.X_EW().Inverse() * p_E;
}

TEST(Sensitivity, IsTheDerivativeOfTheExactChainInEveryParameter) {
  const CounterStream random(3, 0);
  for (std::uint64_t round = 0; round < 30; ++round) {
    MachineDescription machine = SampleMachine();
    for (std::size_t i = 0; i < kParameterCount - 4; ++i) {
      machine.parameters[static_cast<Eigen::Index>(i)] += 1e-3 * random.Normal(100 * round + i);
    }
    const ErrorChain chain(machine);
    const Eigen::Vector2d p_W(500.0 * random.Uniform(9000 + round), 400.0 * random.Uniform(9500 + round));
    const PlaceSensitivity place = SensitivityAt(chain, p_W);
    ASSERT_TRUE(place.valid);
    const Eigen::Vector2d q =
        kinematics::SolveInverse(chain.mechanism, chain.EffectorAt(p_W)).actuator_position_mm;
    for (std::size_t i = 0; i < kParameterCount - 2; ++i) {
      const auto k = static_cast<Eigen::Index>(i);
      constexpr double kStep = 1e-5;
      MachineDescription above = machine;
      MachineDescription below = machine;
      above.parameters[k] += kStep;
      below.parameters[k] -= kStep;
      const Eigen::Vector2d slope = (TruePlace(above, q) - TruePlace(below, q)) / (2.0 * kStep);
      EXPECT_LT((slope - place.J_p_parameters.col(k)).norm(), 1e-5 * (1.0 + slope.norm()))
          << ParameterName(static_cast<Parameter>(i));
    }
  }
}

TEST(Prediction, LinearAndMonteCarloAgree) {
  PredictionOptions options;
  options.draws = 3000;
  MachineDescription machine = SampleMachine();
  SetSigma(machine, Parameter::kBaseXMm, 0.05);  // one cause, fully correlated: linear is exact
  const auto one = Predict(machine, CirclePlan(250, 200, 100, 60), true, options);
  ASSERT_EQ(one.reason, PredictionReason::kPredicted);
  EXPECT_NEAR(one.predicted_95_mm, one.predicted_95_linear_mm, 0.06 * one.predicted_95_linear_mm);
  const auto many = Predict(UncertainMachine(), CirclePlan(250, 200, 100, 60), false, options);
  // Linear takes 95 % at each point by itself; a cut is bad where any of many causes is.
  EXPECT_NEAR(many.predicted_95_mm, many.predicted_95_linear_mm, 0.2 * many.predicted_95_linear_mm);
}

TEST(Prediction, BoundGrowsWithCovariance) {
  double before = 0.0;
  for (const double factor : {0.25, 1.0, 4.0, 16.0}) {
    MachineDescription machine = UncertainMachine();
    machine.covariance *= factor;
    const auto prediction = Predict(machine, CirclePlan(250, 200, 80, 60), true);
    EXPECT_GT(prediction.predicted_95_mm, before);
    EXPECT_GT(prediction.predicted_95_linear_mm, 0.9 * before);
    before = prediction.predicted_95_mm;
  }
}

TEST(Prediction, CompensationTakesTheElasticBiasAway) {
  MachineDescription machine = SampleMachine();
  machine.process.jet_lag_time_s = 0.0;
  const double a = 60.0 * 60.0 / 20.0;
  const auto bent = Predict(machine, CirclePlan(250, 200, 20, 60), false);
  const auto straight = Predict(machine, CirclePlan(250, 200, 20, 60), true);
  EXPECT_NEAR(bent.points.back().bias_mm, -8e-4 * a / (1.0 - 8e-4 * 9.0), 0.1 * 8e-4 * a);
  EXPECT_NEAR(straight.predicted_95_mm, 0.0, 1e-9);
}

TEST(Prediction, LagOnAnArcIsTheAnalyticInset) {
  MachineDescription machine = SampleMachine();
  machine.value(Parameter::kElasticLagS2) = 0.0;
  const auto prediction = Predict(machine, CirclePlan(250, 200, 20, 80, 0.0005), true);
  const double inset = ArcLagInsetMm(20.0, 80.0, 0.01);
  const PredictedPoint& middle = prediction.points[prediction.points.size() / 2];
  EXPECT_NEAR(middle.bias_mm, inset, 2e-3 * inset);  // counter-clockwise: inside is to the left
}

TEST(Prediction, QuasiStaticPointAgreesWithThePlayedPlanOnAnArc) {
  const MachineDescription machine = UncertainMachine();
  const auto prediction = Predict(machine, CirclePlan(250, 200, 100, 40), false);
  const PredictedPoint& played = prediction.points[prediction.points.size() * 3 / 4];
  const double angle = std::atan2(played.p_W_mm.y() - 200, played.p_W_mm.x() - 250);
  JetMotion motion{played.p_W_mm,
                   {-40 * std::sin(angle), 40 * std::cos(angle)},
                   {-16 * std::cos(angle), -16 * std::sin(angle)}};
  const ContourError at = ContourErrorAt(ErrorChain(machine), motion, false);
  ASSERT_TRUE(at.valid);
  EXPECT_NEAR(at.bias_mm, played.bias_mm, 1e-3);
  EXPECT_NEAR(at.sigma_mm, played.sigma_mm, 0.02 * played.sigma_mm);
  EXPECT_NEAR(at.bound_95_mm, played.bound_95_mm, 0.05 * played.bound_95_mm);
}

TEST(Prediction, TurningSheetAndProgramTogetherChangesNothing) {
  // The sheet lies turned by phi in the effector and the program is written turned back: the same motion of
  // the machine.
  MachineDescription machine = UncertainMachine();
  machine.covariance(Index(Parameter::kSheetThetaRad), Index(Parameter::kSheetThetaRad)) = 0.0;
  const auto before = Predict(machine, CirclePlan(250, 200, 60, 50), false);
  constexpr double kPhi = 0.7;
  const PlanarPose turn{0.0, 0.0, kPhi};
  MachineDescription turned = machine;
  turned.value(Parameter::kSheetThetaRad) += kPhi;
  auto samples = CirclePlan(250, 200, 60, 50);
  for (PlanSample& s : samples) {
    const auto back = [&turn](double& x, double& y) {
      const Eigen::Vector2d r = turn.rotation().transpose() * Eigen::Vector2d(x, y);
      x = r.x();
      y = r.y();
    };
    back(s.x_W_mm, s.y_W_mm);
    back(s.vx_W_mm_per_s, s.vy_W_mm_per_s);
    back(s.ax_W_mm_per_s2, s.ay_W_mm_per_s2);
  }
  const auto after = Predict(turned, samples, false);
  EXPECT_NEAR(after.predicted_95_mm, before.predicted_95_mm, 1e-6);
  EXPECT_NEAR(after.predicted_95_linear_mm, before.predicted_95_linear_mm, 1e-6);
}

TEST(Prediction, DrawsDoNotDependOnTheirOrder) {
  const auto samples = CirclePlan(250, 200, 60, 50);
  ContourModel model(UncertainMachine());
  std::uint32_t line = 0;
  ASSERT_EQ(BuildContourModel(samples, false, 300, model, line), PredictionReason::kPredicted);
  DrawSpace space(model);
  std::vector<double> forward;
  for (std::uint64_t d = 0; d < 20; ++d) {
    forward.push_back(DrawContour(model, 5, d, space));
  }
  DrawSpace other(model);
  for (std::uint64_t d = 20; d-- > 0;) {
    EXPECT_EQ(DrawContour(model, 5, d, other), forward[d]);
  }
  EXPECT_NE(forward[0], DrawContour(model, 6, 0, other));
}

TEST(Prediction, SharesSumToOneAndAreRanked) {
  const auto prediction = Predict(UncertainMachine(), CirclePlan(250, 200, 60, 50), false);
  double sum = 0.0;
  double before = INFINITY;
  for (const SourceShare& share : prediction.budget) {
    sum += share.share;
    EXPECT_LE(share.contribution_95_mm, before);
    before = share.contribution_95_mm;
  }
  EXPECT_NEAR(sum, 1.0, 1e-12);
  ASSERT_FALSE(prediction.worst.empty());
  for (const PredictedPoint& point : prediction.points) {
    EXPECT_LE(point.bound_95_mm, prediction.worst.front().bound_95_mm);
  }
}

TEST(Prediction, GaugeFreedomOfBaseAndSheetCostsNothing) {
  // Base and sheet shifted together along x: identification can never tell them apart, and no cut feels it.
  MachineDescription machine = SampleMachine();
  machine.value(Parameter::kSheetThetaRad) = 0.0;
  machine.process.jet_lag_time_s = 0.0;
  const auto b = Index(Parameter::kBaseXMm);
  const auto s = Index(Parameter::kSheetXMm);
  machine.covariance(b, b) = machine.covariance(s, s) = machine.covariance(b, s) = machine.covariance(s, b) =
      25.0;
  EXPECT_LT(Predict(machine, CirclePlan(250, 200, 60, 50), true).predicted_95_mm, 1e-6);
}

TEST(Prediction, RefusesWhatItCannotPredict) {
  auto samples = CirclePlan(250, 200, 60, 50);
  EXPECT_EQ(Predict(SampleMachine(), {}, false).reason, PredictionReason::kNoCutting);
  auto far = samples;
  for (PlanSample& s : far) {
    s.y_W_mm += 5000.0;
  }
  const auto unreachable = Predict(SampleMachine(), far, false);
  EXPECT_EQ(unreachable.reason, PredictionReason::kUnreachable);
  EXPECT_GE(unreachable.blame_line, 10u);
  samples[7].ax_W_mm_per_s2 = NAN;
  EXPECT_EQ(Predict(SampleMachine(), samples, false).reason, PredictionReason::kNotFinite);
  samples = CirclePlan(250, 200, 60, 50);
  samples[7].tau_s = 0.0;
  EXPECT_EQ(Predict(SampleMachine(), samples, false).reason, PredictionReason::kOutOfOrder);
}

TEST(FoldedNormal, QuantileHoldsItsProbability) {
  EXPECT_NEAR(FoldedNormalQuantile(0.0, 1.0, 0.95), 1.959963984540054, 1e-9);
  EXPECT_NEAR(FoldedNormalQuantile(100.0, 1.0, 0.95), 100.0 + 1.6448536269514722, 1e-9);
  EXPECT_DOUBLE_EQ(FoldedNormalQuantile(-0.3, 0.0, 0.95), 0.3);
  for (const double bias : {0.0, 0.1, 0.5, 1.0, 3.0}) {
    const double x = FoldedNormalQuantile(bias, 0.5, 0.95);
    const double inside = 0.5 * (std::erf((x - bias) / 0.5 / std::numbers::sqrt2) +
                                 std::erf((x + bias) / 0.5 / std::numbers::sqrt2));
    EXPECT_NEAR(inside, 0.95, 1e-10);
  }
}

TEST(ErrorMap, CoversTheSheetAndGrowsWithAcceleration) {
  ErrorMapOptions options{5, 4, 0.0, false};
  const auto still = MapErrors(UncertainMachine(), options);
  options.acceleration_mm_per_s2 = 500.0;
  const auto fast = MapErrors(UncertainMachine(), options);
  ASSERT_EQ(still.size(), 20u);
  EXPECT_EQ(still.back().p_W_mm, Eigen::Vector2d(500.0, 400.0));
  for (std::size_t i = 0; i < still.size(); ++i) {
    ASSERT_TRUE(still[i].valid);
    EXPECT_GT(still[i].sigma_mm, 0.0);
    EXPECT_DOUBLE_EQ(fast[i].mean_mm, 0.4);
    EXPECT_GT(fast[i].bound_95_mm, still[i].bound_95_mm);
  }
  const auto ranking = RankParameters(UncertainMachine(), options);
  ASSERT_EQ(ranking.size(), kParameterCount);
  EXPECT_GE(ranking[0].contribution_mm, ranking[1].contribution_mm);
}

TEST(JetLag, CornerLagIsHalfwayBetweenNothingAndTheTrail) {
  EXPECT_NEAR(CornerLagMm(0.0, 100.0, 0.01), 0.0, 1e-6);  // straight on: the front passes the place itself
  const double right_angle = CornerLagMm(std::numbers::pi / 2, 100.0, 0.01);
  CutFront front(0.01);
  front.Start({-50.0, 0.0});
  double nearest = INFINITY;
  for (int i = 1; i <= 20000; ++i) {
    const double s = -50.0 + 100.0 * 1e-4 * i;
    front.Advance(1e-4, s < 0.0 ? Eigen::Vector2d(s, 0.0) : Eigen::Vector2d(0.0, s));
    nearest = std::min(nearest, front.place().norm());
  }
  EXPECT_NEAR(right_angle, nearest, 1e-4);
}

}  // namespace
}  // namespace lambdajet::accuracy
