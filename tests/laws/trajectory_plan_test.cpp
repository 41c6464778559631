// The laws every plan obeys, on random programs: limits between samples, contour, continuity, gates, determinism.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <numbers>
#include <vector>

#include "kinematics/core/lambda_mechanism.hpp"
#include "tests/laws/trajectory_cases.hpp"
#include "tests/laws/trajectory_plan_judges.hpp"
#include "tests/support/demo_machine.hpp"
#include "tests/support/figure.hpp"
#include "trajectory/core/feed/binding.hpp"
#include "trajectory/core/feed/early_plan.hpp"
#include "trajectory/core/feed/plan_program.hpp"
#include "trajectory/core/idle_motion/jerk_limited_move.hpp"
#include "trajectory/core/part_program/read_program.hpp"

namespace lambdajet::trajectory {
namespace {

using tests::PrintFigure;

class PlanLaws : public testing::TestWithParam<bool> {};

void ExpectLaws(const MachineDescription& m, const std::string& text, bool compensate, Worst& worst) {
  PlanOptions options;
  options.compensate = compensate;
  const PlannedProgram planned = PlanPartProgram(text, m, options);
  ASSERT_TRUE(planned.faults.empty())
      << planned.faults[0].line << " " << planned.faults[0].reason << " " << planned.faults[0].message << "\n"
      << text;
  ExpectPlanLaws(m, text, planned, worst);
}

TEST_P(PlanLaws, HoldOnRandomPrograms) {
  const MachineDescription m = DemoLikeMachine();
  Worst worst;
  const Seeds seeds = WantedSeeds({1, 60});
  for (int seed = seeds.first; seed <= seeds.last; ++seed) {
    SCOPED_TRACE(seed);
    ExpectLaws(m, RandomProgram(static_cast<unsigned>(seed)).Make(), GetParam(), worst);
  }
  std::printf("seeds %d to %d: ", seeds.first, seeds.last);
  Tell("random", static_cast<std::size_t>(seeds.last - seeds.first + 1), GetParam(), worst);
}

// Every program shipped for the sheet's mechanism, on the machine that is shipped with them.
TEST_P(PlanLaws, HoldOnShippedPrograms) {
  const MachineDescription m = tests::DemoMachine();
  const std::string folder = std::string(std::getenv("LAMBDAJET_SOURCE_DIR")) + "/deploy/parts";
  Worst worst;
  std::size_t count = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    const std::string kind = entry.path().extension();
    if ((kind != ".ngc" && kind != ".cldata") || entry.path().stem() == "tilted_holes") {
      continue;  // the last is a hexapod's
    }
    SCOPED_TRACE(entry.path());
    std::ifstream file(entry.path());
    ExpectLaws(m, {std::istreambuf_iterator<char>(file), {}}, GetParam(), worst);
    ++count;
  }
  EXPECT_GE(count, 8u);
  Tell("shipped", count, GetParam(), worst);
}

INSTANTIATE_TEST_SUITE_P(Elastic, PlanLaws, testing::Values(false, true));

// A post for machines with Z lifts the tool; read as flat G-code its plan is that of the program without those words.
TEST(PlanLaws, FlatGcodeIsPlannedWithoutItsZ) {
  const MachineDescription m = DemoLikeMachine();
  const std::string lifted =
      "G21 G90 G43 H1\nG0 Z5\nG0 X100 Y100 Z5\nM3 P0.5\nG1 Z-3 F3000\nG1 X180 Z-3\nG2 X200 Y120 I0 "
      "J20\nM5\nG0 Z25\nM2\n";
  const std::string flat =
      "G21 G90\n\nG0 X100 Y100\nM3 P0.5\nG1 F3000\nG1 X180\nG2 X200 Y120 I0 J20\nM5\n\nM2\n";
  PlanOptions options;
  const PlannedProgram refused = PlanPartProgram(lifted, m, options);
  ASSERT_FALSE(refused.faults.empty());
  EXPECT_EQ(refused.faults[0].reason, "AXIS_NOT_DRIVEN");
  const PlannedProgram wanted = PlanPartProgram(flat, m, options);
  options.notation = ProgramNotation::kFlatGcode;
  const PlannedProgram planned = PlanPartProgram(lifted, m, options);
  ASSERT_TRUE(planned.faults.empty()) << planned.faults[0].reason << " " << planned.faults[0].message;
  ASSERT_TRUE(wanted.faults.empty());
  ASSERT_EQ(planned.plan.segments.size(), wanted.plan.segments.size());
  for (std::size_t i = 0; i < planned.plan.segments.size(); ++i) {
    ASSERT_EQ(planned.plan.segments[i].q_mm[0].c, wanted.plan.segments[i].q_mm[0].c);
    ASSERT_EQ(planned.plan.segments[i].q_mm[1].c, wanted.plan.segments[i].q_mm[1].c);
  }
}

// The idle move after the cut comes nearer to the last corner than the cut itself at first does. That it passes there is neither
// a corner that is held nor one that slowing the idle move would mend.
TEST(PlanLaws, AnIdleMoveThatComesByACornerIsNoCut) {
  const MachineDescription m = DemoLikeMachine();
  const std::string text =
      "G21 G90 G17 F3532\nG0 X540.598 Y490.1\nM3 P0.3\nG1 X539.0008 Y489.4040\nG1 X522.7597 Y487.0470\n"
      "G1 X522.4165 Y487.0889\nG1 X522.2451 Y487.1112\nG1 X522.5492 Y487.6213\nM5\n"
      "G0 X319.379 Y175.951\nM3 P0.3\nG1 X310 Y170\nM5\nM2\n";
  const PlannedProgram planned = PlanPartProgram(text, m, {});
  ASSERT_TRUE(planned.faults.empty()) << planned.faults[0].reason << " " << planned.faults[0].message;
  Worst worst;
  ExpectContour(m, text, planned, worst);
}

TEST(PlanLaws, SameInputsSamePlan) {
  const MachineDescription m = DemoLikeMachine();
  const std::string text = RandomProgram(5).Make();
  const PlannedProgram a = PlanPartProgram(text, m, {}), b = PlanPartProgram(text, m, {});
  ASSERT_FALSE(a.plan.segments.empty());
  ASSERT_EQ(a.plan.id, b.plan.id);
  ASSERT_EQ(a.plan.segments.size(), b.plan.segments.size());
  for (std::size_t i = 0; i < a.plan.segments.size(); ++i) {
    EXPECT_EQ(a.plan.segments[i].q_mm[0].c, b.plan.segments[i].q_mm[0].c);
    EXPECT_EQ(a.plan.segments[i].s_mm.c, b.plan.segments[i].s_mm.c);
  }
  PlanOptions other;
  other.compensate = true;
  EXPECT_NE(PlanPartProgram(text, m, other).plan.id, a.plan.id);
}

// G41 and G42 move the cut off the programmed contour by half the machine's kerf, to the tolerance of the path.
TEST(PlanLaws, ProgrammedKerfIsKept) {
  const MachineDescription m = DemoLikeMachine();
  const double half_mm = 0.5 * m.process.kerf_width_mm;
  // Clockwise from the left edge's middle: the outside is on the left.
  const std::string contour =
      "G1 Y180\nG1 X200\nG2 X220 Y160 I0 J-20\nG1 Y100\nG1 X100\nG1 Y141\nG40 G1 X92\nM5\nM2\n";
  for (const auto& [word, side] : {std::pair{"G41", 1.0}, std::pair{"G42", -1.0}}) {
    SCOPED_TRACE(word);
    const std::string text =
        std::string("G21 G90 F2400\nG0 X90 Y140\nM3 P0.6\n") + word + " G1 X100\n" + contour;
    const PlannedProgram plan = PlanPartProgram(text, m, {});
    ASSERT_TRUE(plan.faults.empty()) << plan.faults[0].reason << " " << plan.faults[0].message;
    int on_edges = 0;
    int on_arc = 0;
    for (const PlanSample& s : plan.samples) {
      const Eigen::Vector2d p(s.x_W_mm, s.y_W_mm);
      const Eigen::Vector2d arm = p - Eigen::Vector2d(200.0, 160.0);
      if (p.x() > 150.0 && p.x() < 199.0) {
        EXPECT_NEAR(p.y() > 140.0 ? p.y() - 180.0 : 100.0 - p.y(), half_mm * side,
                    m.path.corner_tolerance_mm);
        ++on_edges;
      } else if (arm.x() > 1.0 && arm.y() > 1.0) {
        EXPECT_NEAR(arm.norm() - 20.0, half_mm * side, m.path.corner_tolerance_mm);
        ++on_arc;
      }
    }
    EXPECT_GT(on_edges, 300);
    EXPECT_GT(on_arc, 50);
  }
}

// Against a speed that no plan can exceed; 1 ms knots, as the loop that plays them.
TEST(FeedLaw, ShortBlocksHoldTheFeed) {
  const MachineDescription m = DemoLikeMachine();
  PlanOptions options;
  options.knot_s = 0.001;
  const double circle = MeanSpeed(PlanPartProgram(CircleOfShortBlocks(20000, 20, 0.02, 6000), m, options)) /
                        FastestMeanSpeed(m, 100.0, 20.0, {{400, 300}});
  const double eight = MeanSpeed(PlanPartProgram(FigureEight(20000, 20, 0.02, 6000), m, options)) /
                       FastestMeanSpeed(m, 100.0, 20.0, {{420, 300}, {380, 300}});
  std::printf("feed held in 0.02 mm blocks: circle %.2f %%, figure-eight %.2f %% of the bound\n",
              100 * circle, 100 * eight);
  PrintFigure("feed.circle_share", circle);
  PrintFigure("feed.eight_share", eight);
  EXPECT_GE(circle, 0.95);
  EXPECT_GE(eight, 0.95);
  EXPECT_LE(circle, 1.0 + 1e-4);
  EXPECT_LE(eight, 1.0 + 1e-4);
}

// Of places a fixed time apart, how many lie more than a micrometre from both ends.
std::ptrdiff_t BetweenEnds(const std::vector<double>& ways_mm, double length_mm) {
  return std::count_if(ways_mm.begin(), ways_mm.end(),
                       [length_mm](double way) { return way > 1e-3 && way < length_mm - 1e-3; });
}

// An idle move from rest to rest, its smoothing included, against the quickest move that the path's velocity, acceleration and
// jerk limits allow.
TEST(IdleLaw, MovesFromRestAreNearTheQuickest) {
  const MachineDescription m = DemoLikeMachine();
  const MoveLimits limits{m.path.rapid_mm_per_s, m.path.acceleration_mm_per_s2, m.path.jerk_mm_per_s3};
  double worst = 0.0;
  for (const double length_mm : {10.0, 20.0, 50.0, 100.0, 200.0, 400.0}) {
    SCOPED_TRACE(length_mm);
    char text[128];
    std::snprintf(text, sizeof text, "G0 X200 Y300\nG4 P0.1\nG0 X%g Y300\nG4 P0.1\nM2\n", 200.0 + length_mm);
    const PlannedProgram planned = PlanPartProgram(text, m, {});
    ASSERT_TRUE(planned.faults.empty()) << planned.faults[0].message;
    std::vector<double> ways_mm;  // a tenth of a millisecond apart
    for (const Segment& s : planned.plan.segments) {
      for (int k = 0; k < static_cast<int>(std::lround(1e4 * s.duration_s)); ++k) {
        ways_mm.push_back(s.s_mm.value(1e-4 * k));
      }
    }
    const JerkLimitedMove quickest = SolveMove({length_mm, 0.0, 0.0}, limits);
    std::vector<double> quickest_mm;
    for (int k = 0; 1e-4 * k < quickest.duration_s; ++k) {
      quickest_mm.push_back(quickest.At(1e-4 * k).way_mm);
    }
    const double ratio = static_cast<double>(BetweenEnds(ways_mm, length_mm)) /
                         static_cast<double>(BetweenEnds(quickest_mm, length_mm));
    EXPECT_GE(ratio, 1.0 - 1e-3);
    EXPECT_LE(ratio, 1.06);
    worst = std::max(worst, ratio);
  }
  PrintFigure("idle.from_rest_ratio", worst);
}

// With jerk made inactive: from rest to rest at v under a, no plan is quicker than length / v + v / a, more at corners, which
// may be rounded by a circle that leaves them by the tolerance.
TEST(FeedLaw, NearTheQuickestThatSpeedAndAccelerationAllow) {
  MachineDescription m = DemoLikeMachine();
  m.path.jerk_mm_per_s3 = 1e9;
  m.actuators[0].jerk_mm_per_s3 = m.actuators[1].jerk_mm_per_s3 = 1e12;
  PlanOptions options;
  options.knot_s = 0.0005;
  const double a = m.path.acceleration_mm_per_s2, v = 100.0;
  const double corner = std::sqrt(a * m.path.corner_tolerance_mm / (std::sqrt(2.0) - 1.0));
  const std::string head = "G21 G90\nG0 X300 Y200\nG1 F6000\n";
  struct Case {
    const char* name;
    std::string text;
    double bound_s;
  };
  double worst = 0.0;
  for (const Case& c : {Case{"line", head + "G1 X700\nM2\n", 400 / v + v / a},
                        Case{"circle R20, five times", head + "G3 X300 Y200 I0 J20 P5\nM2\n",
                             5 * 40 * std::numbers::pi / v + v / a},
                        Case{"square", head + "G1 X500\nG1 Y400\nG1 X300\nG1 Y200\nM2\n",
                             800 / v + v / a + 3 * (v - corner) * (v - corner) / (v * a)}}) {
    const PlannedProgram planned = PlanPartProgram(c.text, m, options);
    ASSERT_TRUE(planned.faults.empty()) << c.name;
    const double ratio = planned.plan.duration_s / c.bound_s;
    std::printf("%s, jerk inactive: %.4f s, at least %.4f s, ratio %.4f\n", c.name, planned.plan.duration_s,
                c.bound_s, ratio);
    EXPECT_LE(ratio, 1.03);
    EXPECT_GE(ratio, 1.0);
    worst = std::max(worst, ratio);
  }
  PrintFigure("bound.ratio", worst);
}

TEST(ElasticLaw, FeedForwardMakesTheSheetFollow) {
  const ElasticFigures figures = MeasureFeedForward();
  std::printf("elastic error %.4f mm rms; removed %.2f %%, with stiffness 10 %% wrong %.2f %%\n",
              figures.untreated_mm, 100 * figures.removed_exact, 100 * figures.removed_wrong);
  PrintFigure("elastic.removed_exact", figures.removed_exact);
  PrintFigure("elastic.removed_wrong_stiffness", figures.removed_wrong);
  EXPECT_GE(figures.removed_exact, 0.95);
  EXPECT_GE(figures.removed_wrong, 0.80);
}

double ShareOf(FeedLimit limit, const LimitShares& shares) {
  switch (limit) {
    case FeedLimit::kCurvature:
    case FeedLimit::kPathAcceleration:
      return shares.path_acceleration;
    case FeedLimit::kPathJerk:
      return shares.path_jerk;
    case FeedLimit::kActuator1Velocity:
      return shares.velocity[0];
    case FeedLimit::kActuator2Velocity:
      return shares.velocity[1];
    case FeedLimit::kActuator1Acceleration:
      return shares.acceleration[0];
    case FeedLimit::kActuator2Acceleration:
      return shares.acceleration[1];
    case FeedLimit::kActuatorJerk:
      return std::max(shares.jerk[0], shares.jerk[1]);
    default:
      return -1.0;
  }
}

// What is played within a millisecond of a path length, sampled at 10 kHz.
class Played {
 public:
  Played(const MachineDescription& m, const Plan& plan) : m_(m), jet_(m), plan_(plan) {}

  LimitShares About(double s_mm) {
    LimitShares shares;
    while (segment_ > 0 && plan_.segments[segment_].s_mm.value(0.0) > s_mm) {
      --segment_;
    }
    while (segment_ + 1 < plan_.segments.size() && plan_.segments[segment_ + 1].s_mm.value(0.0) <= s_mm) {
      ++segment_;
    }
    const Segment& s = plan_.segments[segment_];
    double t = 0.0;
    while (t < s.duration_s && s.s_mm.value(t) < s_mm) {
      t += 1e-4;
    }
    for (double at = std::max(0.0, t - 1e-3); at < std::min(s.duration_s, t + 1e-3); at += 1e-4) {
      shares.TakeAt(m_, jet_, s, at);
    }
    return shares;
  }

 private:
  const MachineDescription& m_;
  Jet jet_;
  const Plan& plan_;
  std::size_t segment_ = 0;
};

// Where a plan says that a limit of motion slows it, what is played uses as much of that limit at the place it names as it says,
// within 1 %, nine tenths at least; where it says that the smoothing keeps it below all, as much of the nearest as it says.
TEST(BindingLaw, WhatIsNamedIsReachedWhereItIsNamed) {
  MachineDescription tight = DemoLikeMachine();
  tight.machine_id = "tight";
  tight.actuators[0].velocity_mm_per_s = tight.actuators[1].velocity_mm_per_s = 70.0;
  tight.actuators[0].acceleration_mm_per_s2 = tight.actuators[1].acceleration_mm_per_s2 = 700.0;
  tight.actuators[1].jerk_mm_per_s3 = 12000.0;
  std::array<std::size_t, kFeedLimitCount> named{};
  std::array<double, kFeedLimitCount> length_mm{};
  double worst_off = 0.0;
  std::size_t checked = 0;
  for (const MachineDescription& m : {DemoLikeMachine(), tight}) {
    for (unsigned seed = 1; seed <= 40; ++seed) {
      SCOPED_TRACE(m.machine_id + " " + std::to_string(seed));
      const PlannedProgram planned = PlanPartProgram(RandomProgram(seed).Make(), m, {});
      ASSERT_TRUE(planned.faults.empty());
      Played played(m, planned.plan);
      double told_mm = 0.0, cut_mm = 0.0, last_mm = 0.0;
      for (const SlowStretch& slow : planned.slow) {
        ASSERT_GE(slow.from_s_mm, last_mm - 1e-9);
        ASSERT_GE(slow.at_s_mm, slow.from_s_mm);
        ASSERT_LE(slow.at_s_mm, slow.to_s_mm);
        last_mm = slow.to_s_mm;
        ++named[static_cast<std::size_t>(slow.limit)];
        length_mm[static_cast<std::size_t>(slow.limit)] += slow.to_s_mm - slow.from_s_mm;
        const double share = ShareOf(slow.nearest, played.About(slow.at_s_mm));
        if (share < 0.0) {
          continue;  // tolerances: held by the laws of the contour
        }
        ++checked;
        const bool reached = slow.limit != FeedLimit::kSmoothing;
        EXPECT_GE(share, slow.reached_share - (reached ? 0.01 : 0.02))
            << FeedLimitName(slow.nearest) << " at " << slow.at_s_mm;
        worst_off = std::max(worst_off, slow.reached_share - share);
        EXPECT_TRUE(!reached || share >= kLimitReached - 0.01)
            << share << " of " << FeedLimitName(slow.limit) << " at " << slow.at_s_mm << " line "
            << slow.line;
        EXPECT_EQ(reached, slow.reached_share >= kLimitReached);
      }
      for (const BindingLength& b : planned.binding) {
        cut_mm += b.length_mm;
        told_mm += b.limit == FeedLimit::kFeed ? 0.0 : b.length_mm;
      }
      EXPECT_NEAR(cut_mm, planned.cutting_length_mm, 0.5);  // that one is counted in samples
      EXPECT_LE(told_mm, cut_mm + 1e-9);
    }
  }
  for (std::size_t i = 0; i < kFeedLimitCount; ++i) {
    if (named[i] > 0) {
      std::printf("%s binds in %zu slow stretches, %.0f mm\n",
                  std::string(FeedLimitName(static_cast<FeedLimit>(i))).c_str(), named[i], length_mm[i]);
    }
  }
  std::printf("of %zu stretches each reaches what it says, at worst %.4f of the limit less\n", checked,
              worst_off);
  EXPECT_GE(named[static_cast<std::size_t>(FeedLimit::kPathJerk)], 50u);
}

bool Same(const Segment& a, const Segment& b) {
  return a.index == b.index && a.start_s == b.start_s && a.duration_s == b.duration_s &&
         a.gate_at_end == b.gate_at_end && a.q_mm[0].c == b.q_mm[0].c && a.q_mm[1].c == b.q_mm[1].c &&
         a.lead_mm[0].c == b.lead_mm[0].c && a.lead_mm[1].c == b.lead_mm[1].c && a.s_mm.c == b.s_mm.c;
}

// What goes out while the rest is still unread is the whole plan's, bit by bit.
TEST(EarlyLaw, EarlySegmentsAreTheWholePlans) {
  const MachineDescription m = DemoLikeMachine();
  std::string many;
  for (unsigned seed = 1; seed <= 30; ++seed) {
    const std::string one = RandomProgram(seed).Make();
    many += one.substr(0, one.rfind("M2"));
  }
  many += "M2\n";
  PlanOptions options;
  for (const bool compensate : {false, true}) {
    options.compensate = compensate;
    for (const std::string& text : {many, FigureEight(40000, 20, 0.02, 6000)}) {
      const PlannedProgram whole = PlanPartProgram(text, m, options);
      ASSERT_TRUE(whole.faults.empty());
      std::vector<std::size_t> given;
      std::size_t different = 0, n = 0;
      const PlannedProgram early = PlanWithEarlySegments(
          text, m, options,
          [&](std::span<const Segment> segments) {
            for (const Segment& s : segments) {
              different += n >= whole.plan.segments.size() || !Same(s, whole.plan.segments[n]) ? 1 : 0;
              ++n;
            }
            given.push_back(n);
            return true;
          },
          {.first_lines = 1000, .growth = 2});
      ASSERT_TRUE(early.faults.empty()) << early.faults[0].reason;
      EXPECT_EQ(different, 0u);
      EXPECT_EQ(n, whole.plan.segments.size());
      EXPECT_EQ(early.plan.id, whole.plan.id);
      ASSERT_GE(given.size(), 2u);
      EXPECT_LE(given[0], whole.plan.segments.size() / 2);
    }
  }
}

TEST(EarlyLaw, ASinkThatHasEnoughEndsPlanning) {
  const PlannedProgram planned =
      PlanWithEarlySegments(FigureEight(5000, 20, 0.02, 6000), DemoLikeMachine(), {},
                            [](std::span<const Segment>) { return false; }, {.first_lines = 1000});
  ASSERT_EQ(planned.faults.size(), 1u);
  EXPECT_EQ(planned.faults[0].reason, "CANCELLED");
  EXPECT_TRUE(planned.plan.segments.empty());
}

// Also inside one unbroken run.
TEST(EarlyLaw, PlanningIsCancelledWithinAStretch) {
  int asked = 0;
  const PlannedProgram planned = PlanPartProgram(FigureEight(200000, 20, 0.02, 6000), DemoLikeMachine(), {},
                                                 [&asked](double) { return ++asked < 2; });
  ASSERT_FALSE(planned.faults.empty());
  EXPECT_EQ(planned.faults[0].reason, "CANCELLED");
  EXPECT_TRUE(planned.plan.segments.empty());
  EXPECT_LE(asked, 3);
}

// Resume backs up by the overlap, pierces there, and meets every later event and gate where the whole plan has it.
TEST(PlanLaws, ResumesOnTheSamePathLength) {
  const MachineDescription m = DemoLikeMachine();
  for (unsigned seed = 1; seed <= 10; ++seed) {
    SCOPED_TRACE(seed);
    const std::string text = RandomProgram(seed).Make();
    const PlannedProgram whole = PlanPartProgram(text, m, {});
    ASSERT_TRUE(whole.faults.empty());
    PlanOptions options;
    options.start_from_s_mm = 0.5 * whole.plan.length_mm;
    const PlannedProgram rest = PlanPartProgram(text, m, options);
    ASSERT_TRUE(rest.faults.empty());
    EXPECT_NE(rest.plan.id, whole.plan.id);
    EXPECT_NEAR(rest.plan.length_mm, whole.plan.length_mm, 1e-6);
    const double begin_s_mm = rest.plan.segments.front().s_mm.value(0.0);
    ASSERT_FALSE(rest.plan.gates.empty());
    EXPECT_EQ(rest.plan.gates.front().kind, GateKind::kPierce);
    EXPECT_NEAR(rest.plan.gates.front().s_mm, begin_s_mm, 1e-9);
    EXPECT_GE(begin_s_mm, *options.start_from_s_mm - options.overlap_mm - 1e-9);
    const std::size_t events_gone = whole.plan.events.size() - rest.plan.events.size();
    for (std::size_t i = 0; i < rest.plan.events.size(); ++i) {
      EXPECT_EQ(rest.plan.events[i].action, whole.plan.events[events_gone + i].action);
      EXPECT_NEAR(rest.plan.events[i].s_mm, whole.plan.events[events_gone + i].s_mm, 1e-6);
    }
    EXPECT_NEAR(rest.samples.back().x_W_mm, whole.samples.back().x_W_mm, 1e-9);
    ExpectClosedGates(rest.plan);
    ExpectContinuity(rest.plan);
  }
  PlanOptions beyond;
  beyond.start_from_s_mm = 1e6;
  const PlannedProgram nothing = PlanPartProgram(RandomProgram(1).Make(), m, beyond);
  ASSERT_EQ(nothing.faults.size(), 1u);
  EXPECT_EQ(nothing.faults[0].reason, "START_BEYOND_END");
}

}  // namespace
}  // namespace lambdajet::trajectory
