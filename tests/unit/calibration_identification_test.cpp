// Examples of identification and verification, the bad input above all.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "calibration/core/chi_square.hpp"
#include "calibration/core/identification.hpp"
#include "calibration/core/verification.hpp"
#include "calibration/core/version.hpp"
#include "tests/support/simulated_looks.hpp"

namespace lambdajet::calibration {
namespace {

using support::LookSimulator;
using support::PaperSizedMachine;
using testing::AnyOf;
using testing::Contains;
using testing::HasSubstr;

class Bench : public testing::Test {
 protected:
  Bench() : machine_(PaperSizedMachine()), simulator_(machine_, 42) { simulator_.DrawTruth(); }

  double WorstMiss(const Identification& found) const {
    double worst = 0.0;
    for (const PlaceAccuracy& place : found.places) {
      worst = std::max(worst, JetMiss(machine_, found.parameters, simulator_.truth(), place.p_W_mm)->norm());
    }
    return worst;
  }
  std::vector<Measurement> Stills(const std::vector<int>& marks) {
    std::vector<Measurement> run;
    for (const int mark : marks) {
      run.push_back(simulator_.Still(mark));
    }
    return run;
  }

  MachineDescription machine_;
  LookSimulator simulator_;
};

using IdentificationOf = Bench;

TEST_F(IdentificationOf, AGoodRunPredictsLooksItHasNotSeen) {
  const auto found = Identify(machine_, simulator_.MeasuringRun());
  ASSERT_EQ(found.reason, IdentificationReason::kIdentified) << found.explanation;
  EXPECT_EQ(found.held_out, 23u);
  EXPECT_GT(found.hold_out_before_mm, 0.1);
  EXPECT_LT(found.hold_out_after_mm, 0.02);
  EXPECT_LT(found.rms_after_mm, 0.02);
  EXPECT_LT(WorstMiss(found), 0.04);
  EXPECT_EQ(found.covariance_inflation, 1.0);
  EXPECT_THAT(found.observability.gauges, Contains(HasSubstr("base_x_mm and sheet_x_mm moving together")));
  EXPECT_THAT(found.observability.gauges,
              Contains(HasSubstr("base_theta_rad and sheet_theta_rad turning together")));
  EXPECT_TRUE(found.covariance.isApprox(found.covariance.transpose(), 0.0));
}

TEST_F(IdentificationOf, FewerReadingsThanParametersIsTooFew) {
  const auto found = Identify(machine_, Stills({1, 2, 3, 4, 5, 6, 7, 8, 9}));
  EXPECT_EQ(found.reason, IdentificationReason::kTooFew);
  EXPECT_THAT(found.explanation, HasSubstr("9 usable looks give 18 readings for 19 parameters"));
  EXPECT_EQ(Identify(machine_, {}).reason, IdentificationReason::kTooFew);
}

TEST_F(IdentificationOf, RepeatedDeliveriesCountOnce) {
  auto run = Stills({1, 2, 3, 4, 5});
  const auto once = run;
  for (int copy = 0; copy < 3; ++copy) {
    run.insert(run.end(), once.begin(), once.end());
  }
  const auto found = Identify(machine_, run);
  EXPECT_EQ(found.reason, IdentificationReason::kTooFew);
  ASSERT_EQ(found.refused.size(), 15u);
  EXPECT_EQ(LookRefusalName(found.refused.front().refusal), "DUPLICATE");
}

TEST_F(IdentificationOf, LooksInOnePlaceAreNotObservable) {
  const auto found = Identify(machine_, Stills(std::vector<int>(14, 7)));
  EXPECT_EQ(found.reason, IdentificationReason::kNotObservable);
  EXPECT_THAT(found.explanation, AnyOf(HasSubstr("theta"), HasSubstr("_mm"))) << found.explanation;
}

TEST_F(IdentificationOf, MarksWithoutATrialHoleLeaveTheJetOffsetUnknown) {
  std::vector<int> marks;
  for (const SheetMark& mark : machine_.marks) {
    marks.push_back(mark.id);
  }
  const auto found = Identify(machine_, Stills(marks));
  EXPECT_EQ(found.reason, IdentificationReason::kNotObservable);
  EXPECT_THAT(found.observability.gauges, Contains(HasSubstr("without a look at a pierced hole")));
  EXPECT_THAT(found.observability.gauges, Contains(HasSubstr("elastic_lag_s2")));
  EXPECT_FALSE(found.elasticity_identified);
}

TEST_F(IdentificationOf, MarksInOneLineSayHowLittleTheyTellBesideIt) {
  auto run = Stills({1, 2, 3, 4, 5, 1, 2, 3, 4, 5, 1, 3, 5});
  run.push_back(simulator_.Hole(1, {260.0, 8.0}));
  run.push_back(simulator_.Hole(2, {270.0, 8.0}));
  const auto line = Identify(machine_, run);
  LookSimulator again(machine_, 42);
  again.DrawTruth();
  const auto whole = Identify(machine_, again.MeasuringRun());
  EXPECT_GT(line.worst_place_mm, 3.0 * whole.worst_place_mm);
  EXPECT_GT(line.observability.weak.size(), whole.observability.weak.size());
}

TEST_F(IdentificationOf, NamesGrossErrorsAndIsNotBentByThem) {
  auto run = simulator_.MeasuringRun();
  run[3].p_C_mm.x() += 0.5;  // 100 times the camera's sigma
  run[11].p_C_mm.y() -= 5.0;
  run[40].p_C_mm += Eigen::Vector2d(0.6, -0.6);  // a tracking picture
  const auto found = Identify(machine_, run);
  ASSERT_EQ(found.reason, IdentificationReason::kIdentified) << found.explanation;
  std::vector<std::size_t> outliers;
  for (const LookResidual& r : found.residuals) {
    if (r.outlier) {
      outliers.push_back(r.index);
    }
  }
  EXPECT_THAT(outliers, testing::UnorderedElementsAre(3u, 11u, 40u));
  EXPECT_LT(WorstMiss(found), 0.04);
}

TEST_F(IdentificationOf, AMarkWronglyDrawnIsNamed) {
  auto run = simulator_.MeasuringRun();
  for (SheetMark& mark : machine_.marks) {
    mark.x_W_mm += mark.id == 5 ? 1.0 : 0.0;
  }
  const auto found = Identify(machine_, run);
  ASSERT_EQ(found.reason, IdentificationReason::kIdentified) << found.explanation;
  for (const LookResidual& r : found.residuals) {
    EXPECT_EQ(r.outlier, r.mark == 5) << r.mark;
  }
}

TEST_F(IdentificationOf, HalfOfTheLooksWrongDoesNotPassAsAFit) {
  auto run = simulator_.MeasuringRun();
  for (std::size_t i = 0; i < run.size(); i += 2) {
    run[i].p_C_mm += 50.0 * Eigen::Vector2d(simulator_.Normal(), simulator_.Normal());
  }
  EXPECT_EQ(Identify(machine_, run).reason, IdentificationReason::kNotConverged);
}

TEST_F(IdentificationOf, WhatIsNotALookIsRefusedWithItsReason) {
  auto run = simulator_.MeasuringRun();
  const std::size_t good = run.size();
  for (int i = 0; i < 5; ++i) {
    run.push_back(run[static_cast<std::size_t>(i)]);
    run.back().exposure_ns += 1;
  }
  run[good].p_C_mm.x() = std::numeric_limits<double>::quiet_NaN();
  run[good + 1].actuator_position_mm.y() = std::numeric_limits<double>::infinity();
  run[good + 2].mark = 777;
  run[good + 3].seen = false;
  run[good + 4].actuator_position_mm = {0.0, 1e6};
  run.push_back(run[100]);  // one tracking picture on its own
  run.back().exposure_ns += 3600000000000;
  const auto found = Identify(machine_, run);
  ASSERT_EQ(found.reason, IdentificationReason::kIdentified) << found.explanation;
  std::vector<std::string> reasons(6);
  for (const RefusedLook& refused : found.refused) {
    ASSERT_GE(refused.index, good);
    reasons[refused.index - good] = LookRefusalName(refused.refusal);
  }
  EXPECT_THAT(reasons, testing::ElementsAre("NOT_FINITE", "NOT_FINITE", "UNKNOWN_MARK", "NOT_SEEN",
                                            "OUT_OF_REACH", "SPARSE_TRACKING"));
}

TEST_F(IdentificationOf, AllZerosAreNoFit) {
  std::vector<Measurement> run(30);
  for (std::size_t i = 0; i < run.size(); ++i) {
    run[i].mark = 1 + static_cast<int>(i) % 20;
    run[i].exposure_ns = static_cast<std::int64_t>(i);
  }
  EXPECT_EQ(Identify(machine_, run).reason, IdentificationReason::kTooFew);
}

TEST_F(IdentificationOf, CanBeCancelled) {
  IdentificationOptions options;
  int calls = 0;
  options.watch = [&calls](double, const char*) { return ++calls < 5; };
  EXPECT_EQ(Identify(machine_, simulator_.MeasuringRun(), options).reason, IdentificationReason::kCancelled);
  EXPECT_EQ(calls, 5);
}

TEST_F(IdentificationOf, NoiseBeyondTheSigmasInflatesTheCovariance) {
  auto run = simulator_.MeasuringRun();
  for (Measurement& look : run) {
    look.p_C_mm += 0.015 * Eigen::Vector2d(simulator_.Normal(), simulator_.Normal());
  }
  const auto found = Identify(machine_, run);
  ASSERT_EQ(found.reason, IdentificationReason::kIdentified) << found.explanation;
  EXPECT_GT(found.tracking_noise_ratio, 4.0);
  EXPECT_LT(found.p_value, 1e-3);
  EXPECT_GT(found.covariance_inflation, 1.1);
}

TEST_F(IdentificationOf, AKnownParameterStaysAsItIs) {
  const int lag = At(Parameter::kElasticLagS2);
  machine_.covariance(lag, lag) = 0.0;
  const auto found = Identify(machine_, Stills({1, 5, 8, 13, 16, 20, 3, 11, 18, 10}));
  EXPECT_EQ(found.parameters[lag], machine_.parameters[lag]);
  EXPECT_EQ(found.covariance(lag, lag), 0.0);
}

using VerificationOf = Bench;

TEST_F(VerificationOf, TheBaseAsSetUpIsUncertain) {
  LookSimulator as_designed(machine_, 1);
  const auto found =
      VerifyBase(machine_, {as_designed.Still(1), as_designed.Still(5), as_designed.Still(18)});
  EXPECT_EQ(found.verdict, Verdict::kUncertain) << found.explanation;
}

TEST_F(VerificationOf, OneLookIsTooFewAndHolesDoNotCount) {
  EXPECT_EQ(VerifyBase(machine_, {simulator_.Still(1), simulator_.Hole(1, {260.0, 8.0})}).verdict,
            Verdict::kTooFew);
}

TEST_F(VerificationOf, ABentMarkIsNotTakenForAMovedBase) {
  machine_.covariance *= 1e-6;
  LookSimulator known(machine_, 2);
  auto looks = std::vector<Measurement>{known.Still(1), known.Still(5), known.Still(16), known.Still(20)};
  EXPECT_EQ(VerifyBase(machine_, looks).verdict, Verdict::kPass);
  looks[1].p_C_mm.x() += 0.1;
  const auto found = VerifyBase(machine_, looks);
  EXPECT_LT(found.remainder_p_value, 1e-3);
}

TEST(ChiSquare, HasTheTablesValues) {
  EXPECT_NEAR(ChiSquareUpperTail(3.841458820694124, 1), 0.05, 1e-12);
  EXPECT_NEAR(ChiSquareUpperTail(23.209251158954356, 10), 0.01, 1e-12);
  EXPECT_NEAR(ChiSquareUpperTail(11.829158, 2), 0.0027, 1e-6);
  EXPECT_EQ(ChiSquareUpperTail(0.0, 3), 1.0);
}

TEST(Version, ComparesAndRollsBackToItsParent) {
  const MachineDescription machine = PaperSizedMachine();
  Version first{0, 0, "crew", 1, 0, 0, "", machine.parameters, machine.covariance};
  Version second = first;
  second.number = 3;
  second.parameters[At(Parameter::kBaseXMm)] += 0.1;
  const auto changes = Compare(first, second);
  ASSERT_EQ(changes.size(), kParameterCount);
  EXPECT_NEAR(changes[9].after - changes[9].before, 0.1, 1e-12);
  EXPECT_EQ(ParameterUnit(Parameter::kElasticLagS2), "s2");
  const Drift drift = DriftBetween(machine, first, second);
  EXPECT_NEAR(drift.mean_mm, 0.1, 1e-6);
  EXPECT_NEAR(drift.largest_mm, 0.1, 1e-6);
  EXPECT_EQ(RollBackTarget({first, second}, 3), 0u);
  EXPECT_EQ(RollBackTarget({first, second}, 0), std::nullopt);
  EXPECT_EQ(RollBackTarget({second}, 3), std::nullopt);
}

}  // namespace
}  // namespace lambdajet::calibration
