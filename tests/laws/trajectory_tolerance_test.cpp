// Laws of feed from tolerance: what is promised is held by an independent look at the plan, nothing could be faster by a whole
// step, a wider tolerance does not cost time, and what cannot be held is refused where and why.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <tuple>
#include <vector>

#include "tests/laws/trajectory_cases.hpp"
#include "tests/laws/trajectory_hostile_programs.hpp"
#include "tests/laws/trajectory_plan_judges.hpp"
#include "trajectory/core/tolerance/judged_contour.hpp"
#include "trajectory/core/tolerance/plan_to_tolerance.hpp"

namespace lambdajet::trajectory {
namespace {

void SetSigma(MachineDescription& machine, Parameter parameter, double sigma) {
  const auto i = static_cast<Eigen::Index>(parameter);
  machine.covariance(i, i) = sigma * sigma;
}

// Identified, with everything uncertain that the prediction knows.
MachineDescription IdentifiedMachine() {
  MachineDescription m = DemoLikeMachine();
  m.uncertainties.straightness_mm = 0.003;
  m.uncertainties.backlash_mm = 0.005;
  m.uncertainties.following_mm = 0.01;
  m.uncertainties.jet_wander_mm = 0.01;
  m.uncertainties.jet_lag_relative = 0.3;
  m.covariance.setZero();
  SetSigma(m, Parameter::kElasticLagS2, 2e-5);
  SetSigma(m, Parameter::kDampingTimeS, 2e-4);
  SetSigma(m, Parameter::kBaseXMm, 0.005);
  SetSigma(m, Parameter::kBaseYMm, 0.005);
  return m;
}

PlanOptions Holding(double tolerance_mm, bool compensate) {
  PlanOptions options;
  options.compensate = compensate;
  options.hold = {{tolerance_mm}};
  return options;
}

JudgedContour JudgeAgain(const std::string& program, const MachineDescription& machine, PlanOptions options,
                         const Pace& pace, PlannedProgram& planned) {
  std::vector<ProgramFault> faults;
  options.tolerance_mm = 10.0;
  options.sample_s = kJudgedEvery_s;
  options.pace = std::make_shared<const Pace>(pace);
  const ProgramPath path = LayOutProgram(program, machine, options, faults);
  planned = PlanLaidOutProgram(path, machine, options);
  return JudgeContour(machine, path, planned, options.hold, {});
}

std::string FirstFault(const TolerancePlan& plan) {
  return plan.planned.faults.empty() ? "" : plan.planned.faults.front().message;
}

TEST(FeedFromTolerance, HoldsWhatItPromisesAndLeavesNoWholeStep) {
  const MachineDescription machine = IdentifiedMachine();
  int slowed = 0, broke = 0;
  for (const unsigned seed : {2u, 4u}) {
    const std::string program = RandomProgram(seed).Make();
    for (const auto& [tolerance, compensate] : {std::pair(0.2, false), {0.1, false}, {0.05, true}}) {
      const PlanOptions options = Holding(tolerance, compensate);
      const TolerancePlan answer = PlanToTolerance(program, machine, options);
      ASSERT_TRUE(answer.planned.faults.empty()) << seed << ": " << FirstFault(answer);
      for (const HeldTolerance& held : answer.report.held) {
        EXPECT_LE(held.predicted_95_mm, tolerance);
        EXPECT_LE(held.worst_mm, tolerance);
        EXPECT_GE(held.margin_mm, 0.0);
      }
      PlannedProgram planned;
      const JudgedContour judged = JudgeAgain(program, machine, options, answer.report.pace, planned);
      EXPECT_TRUE(judged.holds);
      EXPECT_EQ(planned.plan.duration_s, answer.planned.plan.duration_s);
      // 5 % more of every pace breaks something, unless there is nothing left to raise.
      Pace raised = answer.report.pace;
      bool could = false;
      for (std::vector<double>* of : {&raised.cells, &raised.idle}) {
        for (double& p : *of) {
          could = could || p < 1.0;
          p = std::min(1.0, 1.05 * p);
        }
      }
      JudgedContour broken = JudgeAgain(program, machine, options, raised, planned);
      bool beyond = !broken.holds;
      PredictGroups(machine, planned, broken, {});
      for (const JudgedGroup& group : broken.groups) {
        beyond = beyond || group.predicted_95_mm > group.tolerance_mm;
      }
      const bool other_limits = planned.plan.duration_s > 0.995 * answer.planned.plan.duration_s;
      bool hardly_anything_left =
          false;  // where most of the error does not depend on the feed, 5 % of it is less than that
      for (const HeldTolerance& held : answer.report.held) {
        hardly_anything_left = hardly_anything_left || held.margin_mm < 0.04 * tolerance;
      }
      EXPECT_TRUE(beyond || !could || other_limits || hardly_anything_left) << seed << " at " << tolerance;
      broke += beyond ? 1 : 0;
      slowed += could ? 1 : 0;
    }
  }
  EXPECT_GE(slowed, 3);
  EXPECT_GE(broke, slowed - 2);
}

TEST(FeedFromTolerance, AWiderToleranceDoesNotCostTime) {
  const MachineDescription machine = IdentifiedMachine();
  constexpr double kSearchIsNearest = 1.02;  // the search is local: it may miss the fastest pace by this much
  for (const unsigned seed : {2u, 3u}) {
    const std::string program = RandomProgram(seed).Make();
    double tighter_s = INFINITY;
    for (const double tolerance : {0.06, 0.09, 0.14, 0.21, 0.32}) {
      const TolerancePlan answer = PlanToTolerance(program, machine, Holding(tolerance, false));
      ASSERT_TRUE(answer.planned.faults.empty()) << FirstFault(answer);
      EXPECT_LE(answer.planned.plan.duration_s, kSearchIsNearest * tighter_s) << seed << " at " << tolerance;
      tighter_s = answer.planned.plan.duration_s;
    }
  }
}

TEST(FeedFromTolerance, SlowsOnlyTheLinesItIsAskedFor) {
  const MachineDescription machine = IdentifiedMachine();
  const std::string program =
      "G21 G90\nG0 X200 Y200\nM3\nG1 X260 F3600\nG3 X260 Y230 I0 J15\nG1 X200\nM5\n"
      "G0 X400 Y200\nM3\nG1 X460 F3600\nG3 X460 Y230 I0 J15\nG1 X400\nM5\nM2\n";
  PlanOptions options;
  options.hold = {{0.08, 10, 12, 0}};
  const TolerancePlan lines = PlanToTolerance(program, machine, options);
  ASSERT_TRUE(lines.planned.faults.empty()) << FirstFault(lines);
  ASSERT_EQ(lines.report.held.size(), 1u);
  EXPECT_EQ(lines.report.held[0].contour, 2u);
  EXPECT_LE(lines.report.held[0].predicted_95_mm, 0.08);
  options.hold = {{0.08, 0, 0, 2}};
  const TolerancePlan contour = PlanToTolerance(program, machine, options);
  ASSERT_TRUE(contour.planned.faults.empty()) << FirstFault(contour);
  const PlannedProgram free = PlanPartProgram(program, machine, {});
  const auto reach = [](const PlannedProgram& planned, std::uint32_t line) {
    for (const PlanSample& sample : planned.samples) {
      if (sample.source_line >= line) {
        return sample.tau_s;
      }
    }
    return 0.0;
  };
  // The first contour runs as without a tolerance, the second takes longer.
  EXPECT_NEAR(reach(contour.planned, 7), reach(free, 7), 0.05);
  EXPECT_GT(contour.planned.plan.duration_s - reach(contour.planned, 9),
            free.plan.duration_s - reach(free, 9) + 0.1);
  const TolerancePlan whole = PlanToTolerance(program, machine, Holding(0.08, false));
  EXPECT_GT(whole.planned.plan.duration_s, lines.planned.plan.duration_s);
}

TEST(FeedFromTolerance, SaysWhereAndWhyItCannotBeHeld) {
  MachineDescription machine = IdentifiedMachine();
  SetSigma(machine, Parameter::kBaseXMm, 0.3);
  SetSigma(machine, Parameter::kBaseYMm, 0.3);
  const std::string program = "G21 G90\nG0 X200 Y200\nM3\nG1 X260 F3600\nG1 Y260\nM5\nM2\n";
  const TolerancePlan refused = PlanToTolerance(program, machine, Holding(0.1, true));
  ASSERT_EQ(refused.planned.faults.size(), 1u);
  ASSERT_EQ(refused.report.blame.size(), 1u);
  const ToleranceBlame& blame = refused.report.blame[0];
  EXPECT_EQ(refused.planned.faults[0].reason, "TOLERANCE_NOT_REACHED");
  EXPECT_EQ(refused.planned.faults[0].line, blame.line);
  EXPECT_TRUE(blame.line == 4 || blame.line == 5);
  EXPECT_EQ(blame.source, accuracy::Source::kBase);
  EXPECT_EQ(blame.remedy, "IDENTIFY");
  EXPECT_NEAR(blame.predicted_mm, 1.96 * 0.3, 0.02);
  EXPECT_LT(blame.with_remedy_mm, 0.1);
  EXPECT_TRUE(refused.planned.plan.segments.empty());
  // What is just above what is left at creeping speed is no longer refused for that.
  const TolerancePlan wide = PlanToTolerance(program, machine, Holding(1.6 * blame.predicted_mm, true));
  EXPECT_TRUE(wide.planned.faults.empty()) << FirstFault(wide);
}

TEST(FeedFromTolerance, IsTheSameBitByBitAndResumes) {
  const MachineDescription machine = IdentifiedMachine();
  const std::string program = RandomProgram(3).Make();
  PlanOptions options = Holding(0.1, false);
  const TolerancePlan once = PlanToTolerance(program, machine, options);
  const TolerancePlan again = PlanToTolerance(program, machine, options);
  EXPECT_EQ(once.planned.plan.id, again.planned.plan.id);
  EXPECT_EQ(once.report.pace.cells, again.report.pace.cells);
  EXPECT_EQ(once.planned.plan.duration_s, again.planned.plan.duration_s);
  options.start_from_s_mm = 0.5 * once.planned.plan.length_mm;
  const TolerancePlan rest = PlanToTolerance(program, machine, options);
  ASSERT_TRUE(rest.planned.faults.empty()) << FirstFault(rest);
  EXPECT_LT(rest.planned.plan.duration_s, once.planned.plan.duration_s);
  EXPECT_NE(rest.planned.plan.id, once.planned.plan.id);
}

// Asked all the time while the work goes on, so that the count of questions stands for time, if roughly: drawing asks oftener
// than planning.
TEST(FeedFromTolerance, ProgressGrowsEvenlyAndEndsAtOne) {
  const MachineDescription machine = IdentifiedMachine();
  for (const unsigned seed : {2u, 5u}) {
    const std::string program = RandomProgram(seed).Make();
    for (const auto& [tolerance, compensate, resume] :
         {std::tuple(0.2, false, false), {0.1, false, true}, {0.06, false, false}, {0.05, true, false}}) {
      PlanOptions options = Holding(tolerance, compensate);
      if (resume) {
        options.start_from_s_mm = 10.0;
      }
      std::vector<double> told;
      const TolerancePlan answer = PlanToTolerance(program, machine, options, [&told](double ratio) {
        told.push_back(ratio);
        return true;
      });
      ASSERT_TRUE(answer.planned.faults.empty()) << FirstFault(answer);
      EXPECT_TRUE(std::is_sorted(told.begin(), told.end()));
      EXPECT_EQ(told.back(), 1.0);
      EXPECT_GE(told.front(), 0.0);
      const auto count = static_cast<double>(told.size());
      double stands = 0.0, longest = 0.0, jump = told.front(), off = 0.0;
      for (std::size_t i = 1; i < told.size(); ++i) {
        stands = told[i] == told[i - 1] ? stands + 1.0 : 0.0;
        longest = std::max(longest, stands / count);
        jump = std::max(jump, told[i] - told[i - 1]);
        off = std::max(off, std::abs(told[i] - static_cast<double>(i) / count));
      }
      EXPECT_LE(longest, 1.0 / 3.0);
      EXPECT_LE(jump, 1.0 / 3.0);
      EXPECT_LE(off, 0.5);
    }
  }
}

PlannedProgram SampledAgain(const std::string& program, const MachineDescription& machine,
                            PlanOptions options, const Pace& pace) {
  std::vector<ProgramFault> faults;
  options.sample_s = 0.001;
  options.tolerance_mm = 10.0;
  options.pace = std::make_shared<const Pace>(pace);
  const ProgramPath path = LayOutProgram(program, machine, options, faults);
  return PlanLaidOutProgram(path, machine, options);
}

// How far the plan is from the programmed cuts, in mm, by the judges' own search; a cut that does not move is no feature, so all
// of them are looked at.
class ProgrammedContour {
 public:
  ProgrammedContour(const MachineDescription& machine, const std::string& program, const Plan& plan) {
    const ProgrammedCuts programmed(machine, program, plan);
    for (const Polyline& cut : programmed.cuts()) {
      cuts_.emplace_back();
      for (const Polyline::Point& point : cut.points()) {
        cuts_.back().Add(point.p, point.s, 1.0);
      }
    }
  }
  double Distance_mm(const Eigen::Vector2d& p, double s_mm) const {
    double nearest = INFINITY;
    for (const Polyline& cut : cuts_) {
      nearest = std::min(nearest, cut.Share(p, s_mm));
    }
    return nearest;
  }

 private:
  std::vector<Polyline> cuts_;
};

// The largest 95 % bound, in shares of the tolerance, at every millisecond of the answer: a look that has neither the search's
// places nor its samples.
double WorstShareSeenClosely(const std::string& program, const MachineDescription& machine,
                             const PlanOptions& options, const TolerancePlan& answer) {
  const PlannedProgram planned = SampledAgain(program, machine, options, answer.report.pace);
  EXPECT_EQ(planned.plan.duration_s, answer.planned.plan.duration_s);
  accuracy::ContourModel model(machine);
  std::uint32_t line = 0;
  EXPECT_EQ(accuracy::BuildContourModel(SamplesWithGates(machine, planned), options.compensate, 1, model,
                                        line, 5e-4),
            accuracy::PredictionReason::kPredicted);
  const accuracy::PointErrors errors = accuracy::PropagateLinearly(model);
  const ProgrammedContour contour(machine, program, planned.plan);
  double worst_mm = 0.0;
  for (std::size_t k = 0; k < model.points.size(); ++k) {
    double bias = 0.0, variance = 0.0;
    for (std::size_t s = 0; s < accuracy::kSourceCount; ++s) {
      bias += errors.bias_mm[k][s];
      variance += errors.variance_mm2[k][s];
    }
    const accuracy::ContourModel::Point& point = model.points[k];
    const double bound = accuracy::FoldedNormalQuantile(bias, std::sqrt(std::max(0.0, variance)), 0.95);
    worst_mm =
        std::max(worst_mm, bound + contour.Distance_mm(point.p_W_mm, planned.samples[point.sample].s_mm));
  }
  EXPECT_GT(worst_mm, 0.0);
  return worst_mm / options.hold[0].tolerance_mm;
}

void ExpectBlame(const TolerancePlan& refused, double tolerance_mm) {
  EXPECT_EQ(refused.planned.faults[0].reason, "TOLERANCE_NOT_REACHED");
  ASSERT_EQ(refused.report.blame.size(), 1u);
  EXPECT_GT(refused.report.blame[0].predicted_mm, tolerance_mm);
  EXPECT_GT(refused.report.blame[0].line, 0u);
  EXPECT_EQ(refused.planned.faults[0].line, refused.report.blame[0].line);
}

// LAMBDAJET_EACH_PROGRAM tells each.
void TellEach(int seed, const char* kind, double tolerance_mm, const TolerancePlan& answer, double seen) {
  if (std::getenv("LAMBDAJET_EACH_PROGRAM") != nullptr) {
    std::printf("each %d %s %g mm: %.4f s of %.4f s, %d plans, seen %.4f %s\n", seed, kind, tolerance_mm,
                answer.planned.plan.duration_s, answer.report.fastest_s, answer.report.plans, seen,
                FirstFault(answer).c_str());
  }
}

// Of the tolerance, between the places that the search looks at.
constexpr double kBetweenPlaces = 1.01;

TEST(FeedFromTolerance, HoldsEverywhereOnHostilePrograms) {
  const MachineDescription machine = IdentifiedMachine();
  Worst worst;
  double most_seen = 0.0;
  std::size_t held = 0, refused = 0;
  const Seeds seeds = WantedSeeds({14, 16});
  for (int seed = seeds.first; seed <= seeds.last; ++seed) {
    HostileProgram hostile(static_cast<unsigned>(seed));
    const std::string program = hostile.Make();
    double tighter_s = INFINITY;
    for (const double tolerance : {0.01, 0.06, 0.12}) {
      SCOPED_TRACE(std::to_string(seed) + " " + hostile.kind_name() + " at " + std::to_string(tolerance));
      const PlanOptions options = Holding(tolerance, seed % 2 == 1);
      const TolerancePlan answer = PlanToTolerance(program, machine, options);
      const bool planned = answer.planned.faults.empty();
      const double seen = planned ? WorstShareSeenClosely(program, machine, options, answer) : 0.0;
      TellEach(seed, hostile.kind_name(), tolerance, answer, seen);
      ++(planned ? held : refused);
      if (!planned) {
        EXPECT_TRUE(std::isinf(tighter_s)) << "a tighter one is held: " << FirstFault(answer);
        ExpectBlame(answer, tolerance);
        continue;
      }
      EXPECT_LE(seen, kBetweenPlaces);
      most_seen = std::max(most_seen, seen);
      ExpectPlanLaws(machine, program, answer.planned, worst);
      EXPECT_LE(answer.planned.plan.duration_s, 1.02 * tighter_s);
      tighter_s = answer.planned.plan.duration_s;
    }
  }
  EXPECT_GT(held, 0u);
  EXPECT_GT(refused, 0u);
  tests::PrintFigure("to_tolerance.seen_closely", most_seen);
  Tell("to_tolerance", held, false, worst);
}

// What is cut lies on the contour to the last, and yet the tip is missing.
TEST(FeedFromTolerance, CutsTheTipOfASpikeThoughThePathMayMissIt) {
  const MachineDescription machine = IdentifiedMachine();
  const char* kSpike =
      "G21 G90 F6000\nG64 P%s\nG0 X300 Y200\nM3\nG1 X330\nG1 X300.5 Y200.2\nG1 X310 Y215\nM5\nM2\n";
  const auto with = [&](const char* p) {
    char text[200];
    std::snprintf(text, sizeof text, kSpike, p);
    return std::string(text);
  };
  for (const auto& [p, tolerance] : {std::pair{"0.05", 0.05}, {"0.1", 0.1}}) {
    SCOPED_TRACE(p);
    const TolerancePlan answer = PlanToTolerance(with("0.2"), machine, Holding(tolerance, true));
    ASSERT_TRUE(answer.planned.faults.empty()) << FirstFault(answer);
    Worst worst;
    ExpectContour(machine, with(p), answer.planned, worst);
  }
}

TEST(FeedFromTolerance, RefusesWishesThatMeanNothing) {
  const MachineDescription machine = IdentifiedMachine();
  for (const ToleranceWish& wish : {ToleranceWish{0.0}, {-1.0}, {std::nan("")}, {11.0}, {0.1, 5, 3, 0}}) {
    PlanOptions options;
    options.hold = {wish};
    const TolerancePlan plan = PlanToTolerance("G0 X10 Y10\nM2\n", machine, options);
    ASSERT_EQ(plan.planned.faults.size(), 1u);
    EXPECT_EQ(plan.planned.faults[0].reason, "OPTION_OUT_OF_RANGE");
  }
}

}  // namespace
}  // namespace lambdajet::trajectory
