// The three small rules of the planner by themselves: how a corner is crossed, how tops of a profile are levelled, which limit
// is named. Each against a reckoning of its own: corners by driving the smoothing over one, tops by their closed form.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <random>
#include <vector>

#include "tests/laws/trajectory_cases.hpp"
#include "trajectory/core/feed/binding.hpp"
#include "trajectory/core/feed/corner_speed.hpp"
#include "trajectory/core/feed/level_tops.hpp"
#include "trajectory/core/feed/smoothing.hpp"

namespace lambdajet::trajectory {
namespace {

class FeedDice {
 public:
  explicit FeedDice(std::uint64_t seed) : engine_(seed) {}
  double Between(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(engine_);
  }
  double Logarithmic(double low, double high) { return low * std::pow(high / low, Between(0.0, 1.0)); }
  int Below(int n) { return std::uniform_int_distribution<int>(0, n - 1)(engine_); }

 private:
  std::mt19937_64 engine_;
};

// ---- corners

struct Corner {
  double acceleration = 0.0, jerk = 0.0, angle_rad = 0.0, deviation_mm = 0.0, feed_mm_per_s = 0.0;
  SmoothingFilter filter;

  static Corner Random(FeedDice& dice) {
    Corner c;
    c.acceleration = dice.Logarithmic(200.0, 5000.0);
    c.jerk = c.acceleration * dice.Logarithmic(8.0, 60.0);
    c.angle_rad = dice.Between(0.02, std::numbers::pi);
    c.deviation_mm = dice.Logarithmic(0.005, 0.3);
    c.feed_mm_per_s = dice.Logarithmic(2.0, 300.0);
    const double ramp_s2 = dice.Below(2) == 0 ? 0.0 : 4e-4;
    c.filter = SmoothingFilter::ForLimits(0.002, c.acceleration, c.jerk, ramp_s2);
    return c;
  }

  CornerRule Rule() const { return {filter, filter.kink_deviation_s(), acceleration, jerk}; }
  CornerRule::Crossing Cross() const { return Rule().Cross(angle_rad, deviation_mm, feed_mm_per_s); }
};

double HoldTime(const CornerRule::Crossing& c) { return 2.0 * c.hold_mm / c.speed_mm_per_s; }

// Against crossing at full speed, by braking and speeding up at full acceleration.
double LostTime(const Corner& corner, const CornerRule::Crossing& c) {
  const double apart = corner.feed_mm_per_s - c.speed_mm_per_s;
  return apart / corner.feed_mm_per_s * (HoldTime(c) + apart / corner.acceleration);
}

struct Driven {
  double off_mm = 1e9;  // of the corner itself, which is what is left the furthest
  double acceleration = 0.0, jerk = 0.0;
};

// Brakes towards the corner, holds its speed about it, speeds up behind it, all smoothed as the planner does.
Driven Drive(const Corner& corner, const CornerRule::Crossing& crossing) {
  const Eigen::Vector2d before(1.0, 0.0), behind(std::cos(corner.angle_rad), std::sin(corner.angle_rad));
  const double v = crossing.speed_mm_per_s, hold = HoldTime(crossing);
  const int half = 6 * corner.filter.reach() + 12;
  std::vector<PathSample> samples;
  for (int i = -half; i <= half; ++i) {
    const double t = i * corner.filter.knot_s, beyond = std::max(0.0, std::abs(t) - 0.5 * hold);
    const double way = v * std::abs(t) + 0.5 * corner.acceleration * beyond * beyond;
    const Eigen::Vector2d p = way * (t < 0.0 ? Eigen::Vector2d(-before) : behind);
    samples.emplace_back(p.x(), p.y(), t < 0.0 ? -way : way);
  }
  const std::vector<PathSample> control = Smooth(corner.filter, samples);
  Driven driven;
  for (int i = -2 * corner.filter.reach(); i <= 2 * corner.filter.reach(); ++i) {
    const KnotState k = EvaluateKnot(control, static_cast<std::size_t>(half + i), corner.filter.knot_s);
    driven.off_mm = std::min(driven.off_mm, k.r.head<2>().norm());
    driven.acceleration = std::max(driven.acceleration, k.second.head<2>().norm());
    driven.jerk = std::max(driven.jerk, k.third.head<2>().norm());
  }
  return driven;
}

TEST(CornerRule, StaysWithinFeedAndHoldsNoLongerThanTheSmoothing) {
  FeedDice dice(1);
  for (int i = 0; i < 500; ++i) {
    const Corner corner = Corner::Random(dice);
    const CornerRule::Crossing c = corner.Cross();
    ASSERT_GT(c.speed_mm_per_s, 0.0);
    ASSERT_LE(c.speed_mm_per_s, corner.feed_mm_per_s);
    ASSERT_GE(c.hold_mm, 0.0);
    ASSERT_LE(HoldTime(c), 2.0 * corner.filter.half_support_s() * (1 + 1e-12));
  }
}

TEST(CornerRule, CornersDrivenByItKeepTheTolerance) {
  FeedDice dice(2);
  double off = 0.0, least_by_tolerance = 1.0;
  int by_tolerance = 0;
  for (int i = 0; i < 400; ++i) {
    const Corner corner = Corner::Random(dice);
    const CornerRule::Crossing c = corner.Cross();
    if (c.speed_mm_per_s <= 0.3) {
      continue;  // the least speed: no rule
    }
    const double share = Drive(corner, c).off_mm / corner.deviation_mm;
    off = std::max(off, share);
    least_by_tolerance = std::min(least_by_tolerance, c.tolerance ? share : 1.0);
    by_tolerance += c.tolerance ? 1 : 0;
  }
  std::printf("corners driven use %.6f of the tolerance at most, %.6f at least where it is what binds (%d)\n",
              off, least_by_tolerance, by_tolerance);
  EXPECT_LE(off, 1.0 + 1e-6);
  EXPECT_GE(least_by_tolerance, 0.99);
  EXPECT_GE(by_tolerance, 50);
}

// At the tolerances of a water jet; where a corner may be left by much more, the rule leaves jerk to the planner's measuring.
TEST(CornerRule, CornersDrivenByItKeepTheAcceleration) {
  FeedDice dice(8);
  double acceleration = 0.0, jerk = 0.0;
  for (int i = 0; i < 400; ++i) {
    Corner corner = Corner::Random(dice);
    corner.acceleration = 1050.0;
    corner.jerk = 20000.0;
    corner.filter = SmoothingFilter::ForLimits(0.002, corner.acceleration, corner.jerk, 0.0);
    corner.deviation_mm = 0.02;
    const CornerRule::Crossing c = corner.Cross();
    if (c.speed_mm_per_s > 0.3) {
      const Driven driven = Drive(corner, c);
      acceleration = std::max(acceleration, driven.acceleration / corner.acceleration);
      jerk = std::max(jerk, driven.jerk / corner.jerk);
    }
  }
  std::printf("corners driven use %.4f of the acceleration, %.4f of the jerk\n", acceleration, jerk);
  EXPECT_LE(acceleration, 1.0 + 1e-6);
  // The rule bounds the jerk of turning the acceleration; that of the kink adds to it, and the planner slows where it measures
  // too much.
  EXPECT_LE(jerk, 1.4);
}

TEST(CornerRule, MoreToleranceNeverCostsTime) {
  FeedDice dice(3);
  for (int i = 0; i < 200; ++i) {
    Corner corner = Corner::Random(dice);
    const CornerRule rule = corner.Rule();
    double last = 1e300;
    for (corner.deviation_mm = 0.001; corner.deviation_mm < 2.0; corner.deviation_mm *= 1.5) {
      const double lost =
          LostTime(corner, rule.Cross(corner.angle_rad, corner.deviation_mm, corner.feed_mm_per_s));
      ASSERT_LE(lost, last * (1 + 1e-12) + 1e-15) << corner.deviation_mm;
      last = lost;
    }
  }
}

TEST(CornerRule, LimitingCases) {
  FeedDice dice(4);
  for (int i = 0; i < 200; ++i) {
    const Corner corner = Corner::Random(dice);
    const CornerRule rule = corner.Rule();
    const CornerRule::Crossing straight = rule.Cross(1e-7, corner.deviation_mm, corner.feed_mm_per_s);
    EXPECT_EQ(straight.speed_mm_per_s, corner.feed_mm_per_s) << "no corner";
    EXPECT_FALSE(straight.tolerance);
    EXPECT_TRUE(rule.Cross(corner.angle_rad, 0.0, corner.feed_mm_per_s).tolerance);
    EXPECT_LE(rule.Cross(corner.angle_rad, 0.0, corner.feed_mm_per_s).speed_mm_per_s, 0.3) << "no tolerance";
    const CornerRule::Crossing any = rule.Cross(corner.angle_rad, 1e9, corner.feed_mm_per_s);
    EXPECT_FALSE(any.tolerance) << "all the tolerance there is";
    // Turning back within T1 needs the whole change of velocity at the limit of acceleration.
    EXPECT_LE(rule.Cross(std::numbers::pi, 1e9, 1e9).speed_mm_per_s,
              0.5 * corner.acceleration * corner.filter.first_s);
    // A feed slower than any corner needs is kept, however slow.
    EXPECT_EQ(rule.Cross(corner.angle_rad, 1e9, 0.01).speed_mm_per_s, 0.01);
  }
}

// ---- tops

std::vector<ProfileNode> Nodes(const std::vector<double>& at_mm, const std::vector<double>& x) {
  std::vector<ProfileNode> nodes(at_mm.size());
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    nodes[i].offset_mm = at_mm[i];
    nodes[i].x = x[i];
  }
  return nodes;
}

// Between bounds of acceleration, as a solved profile is; places drawn, too.
std::vector<ProfileNode> RandomProfile(FeedDice& dice, double acceleration) {
  std::vector<double> at{0.0}, x{dice.Between(0.0, 900.0)};
  double u = acceleration;
  for (int i = 0; i < 300; ++i) {
    if (dice.Below(12) == 0) {
      u = dice.Below(4) == 0 ? 0.0 : acceleration * dice.Between(-1.0, 1.0);
    }
    const double step = dice.Logarithmic(0.005, 0.2);
    at.push_back(at.back() + step);
    x.push_back(std::clamp(x.back() + 2.0 * u * step, 0.0, 1e4));
  }
  return Nodes(at, x);
}

TEST(LevelTops, OnlyLowersAndSaysWhy) {
  FeedDice dice(5);
  int lowered = 0;
  for (int i = 0; i < 300; ++i) {
    const double acceleration = dice.Logarithmic(300.0, 3000.0), level_s = dice.Logarithmic(0.005, 0.1);
    const std::vector<ProfileNode> before = RandomProfile(dice, acceleration);
    std::vector<ProfileNode> after = before;
    LevelTops(after, level_s, acceleration);
    EXPECT_EQ(after.front().x, before.front().x);
    EXPECT_EQ(after.back().x, before.back().x);
    for (std::size_t k = 0; k < after.size(); ++k) {
      ASSERT_LE(after[k].x, before[k].x);
      ASSERT_GE(after[k].x, 0.0);
      ASSERT_EQ(after[k].binding, after[k].x < before[k].x ? FeedLimit::kPathJerk : before[k].binding);
      lowered += after[k].x < before[k].x ? 1 : 0;
    }
    std::vector<ProfileNode> longer = before;
    LevelTops(longer, 0.0, acceleration);
    for (std::size_t k = 0; k < before.size(); ++k) {
      ASSERT_EQ(longer[k].x, before[k].x) << "a level of no length";
    }
  }
  EXPECT_GT(lowered, 1000);
}

TEST(LevelTops, ATopOfFullAccelerationLastsAsLongAsAsked) {
  FeedDice dice(6);
  for (int i = 0; i < 200; ++i) {
    const double a = dice.Logarithmic(200.0, 5000.0), level_s = dice.Logarithmic(0.005, 0.1);
    const double v0 = a * level_s * dice.Between(1.0, 5.0), reach_mm = 0.5 * v0 * v0 / a;
    std::vector<double> at, x;
    constexpr int kHalf = 2000;
    for (int k = -kHalf; k <= kHalf; ++k) {
      at.push_back(reach_mm * k / kHalf);
      x.push_back(v0 * v0 - 2.0 * a * std::abs(at.back()));
    }
    std::vector<ProfileNode> nodes = Nodes(at, x);
    LevelTops(nodes, level_s, a);
    // Level at v for T: (v0^2 - v^2) / a = v T.
    const double v = 0.5 * (std::sqrt(a * a * level_s * level_s + 4.0 * v0 * v0) - a * level_s);
    double top = 0.0;
    for (const ProfileNode& n : nodes) {
      top = std::max(top, n.x);
    }
    EXPECT_NEAR(std::sqrt(top), v, 1e-6 * v0);
    std::vector<ProfileNode> again = nodes;
    LevelTops(again, level_s * (1 - 1e-3), a);
    for (std::size_t k = 0; k < nodes.size(); ++k) {
      ASSERT_NEAR(again[k].x, nodes[k].x, 1e-4 * v0 * v0) << "levelled already";
    }
  }
}

TEST(LevelTops, LeavesGentleTopsAndValleys) {
  const std::vector<double> at{0, 1, 2, 3, 4};
  for (const std::vector<double>& x :
       {std::vector<double>{0, 400, 800, 400, 0}, std::vector<double>{800, 400, 0, 400, 800},
        std::vector<double>{0, 400, 800, 1200, 1600}, std::vector<double>{0, 400, 400, 400, 0}}) {
    std::vector<ProfileNode> nodes = Nodes(at, x);
    LevelTops(nodes, 0.01, 401.0);  // jumps of acceleration of 400 at most
    for (std::size_t k = 0; k < x.size(); ++k) {
      EXPECT_EQ(nodes[k].x, x[k]);
    }
  }
  std::vector<ProfileNode> two = Nodes({0, 1}, {0, 0}), none;
  LevelTops(two, 0.1, 1.0);
  LevelTops(none, 0.1, 1.0);
  EXPECT_EQ(two[1].x, 0.0);
}

// ---- which limit is named

constexpr FeedLimit kSome[] = {FeedLimit::kPathJerk, FeedLimit::kCurvature, FeedLimit::kCorner,
                               FeedLimit::kActuator1Acceleration};

TEST(FeedMoment, TakesTheLimitThatIsNearestToBeingReached) {
  FeedMoment moment;
  moment.Offer(FeedLimit::kPathJerk, 0.5);
  EXPECT_EQ(moment.limit, FeedLimit::kPathJerk);
  moment.Offer(FeedLimit::kCurvature, 0.4);
  EXPECT_EQ(moment.limit, FeedLimit::kPathJerk);
  moment.Offer(FeedLimit::kCorner, 0.5);
  EXPECT_EQ(moment.limit, FeedLimit::kPathJerk) << "as near: the first";
  moment.Offer(FeedLimit::kCorner, 0.94);
  EXPECT_EQ(moment.limit, FeedLimit::kCorner);
  EXPECT_EQ(moment.reached_share, 0.94);
}

std::vector<FeedMoment> RandomMoments(FeedDice& dice, int count) {
  std::vector<FeedMoment> moments;
  FeedMoment m;
  for (int i = 0; i < count; ++i) {
    if (i == 0 || dice.Below(4) == 0) {
      m.limit = kSome[dice.Below(4)];
      m.reached_share = dice.Below(2) == 0 ? kLimitReached : dice.Between(0.2, 0.89);
    }
    m.s_mm += dice.Between(0.0, 0.5);
    m.speed_mm_per_s = dice.Between(1.0, 90.0);
    m.programmed_mm_per_s = 100.0;
    m.line = static_cast<std::uint32_t>(i + 1);
    moments.push_back(m);
  }
  return moments;
}

TEST(BindingReport, StretchesFollowOneAnotherAndTellWhatHappenedInThem) {
  FeedDice dice(7);
  for (int round = 0; round < 500; ++round) {
    const std::vector<FeedMoment> moments = RandomMoments(dice, 1 + dice.Below(60));
    const double end_mm = moments.back().s_mm + 0.25;
    std::vector<SlowStretch> slow;
    BindingReport report(static_cast<std::size_t>(dice.Below(8)), slow);
    for (const FeedMoment& m : moments) {
      report.Take(m);
    }
    report.Close(end_mm);
    report.Close(end_mm);  // nothing more to tell
    ASSERT_FALSE(slow.empty());
    EXPECT_EQ(slow.front().from_s_mm, moments.front().s_mm);
    EXPECT_EQ(slow.back().to_s_mm, end_mm);
    for (std::size_t i = 0; i < slow.size(); ++i) {
      const SlowStretch& s = slow[i];
      ASSERT_TRUE(i == 0 || s.from_s_mm == slow[i - 1].to_s_mm) << "a gap, or told twice";
      ASSERT_TRUE(i == 0 || s.limit != slow[i - 1].limit || s.nearest != slow[i - 1].nearest);
      double lowest = 1e300, share = 0.0;
      for (const FeedMoment& m : moments) {
        if (m.s_mm >= s.from_s_mm && m.s_mm < s.to_s_mm) {
          lowest = std::min(lowest, m.speed_mm_per_s);
          share = std::max(share, m.limit == s.nearest ? m.reached_share : 0.0);
        }
      }
      ASSERT_LE(s.lowest_mm_per_s, lowest);
      ASSERT_GE(s.reached_share, share);
      ASSERT_EQ(s.limit == FeedLimit::kSmoothing, s.reached_share < kLimitReached);
      ASSERT_GE(s.share, 0.0);
      ASSERT_LE(s.share, 1.0 + 1e-12);
      ASSERT_LE(s.from_s_mm, s.at_s_mm);
      ASSERT_LE(s.at_s_mm, s.to_s_mm);
    }
  }
}

TEST(BindingReport, LimitingCases) {
  std::vector<SlowStretch> slow;
  BindingReport nothing(3, slow);
  nothing.Close(1.0);
  EXPECT_TRUE(slow.empty());

  // Curvature, five moments of smoothing, jerk: each is tied to the nearer one, and the middle one only as far as the smoothing reaches.
  const auto told = [](std::size_t reach_moments) {
    std::vector<SlowStretch> all;
    BindingReport report(reach_moments, all);
    for (int i = 0; i < 15; ++i) {
      FeedMoment m{
          static_cast<double>(i), 50.0, 100.0, 7, i < 5 ? FeedLimit::kCurvature : FeedLimit::kPathJerk, 1.0};
      m.reached_share = i >= 5 && i < 10 ? 0.6 : 1.0;
      report.Take(m);
    }
    report.Close(15.0);
    return all;
  };
  const std::vector<SlowStretch> tied = told(3), apart = told(2);
  ASSERT_EQ(tied.size(), 2u);
  EXPECT_EQ(tied[0].limit, FeedLimit::kCurvature);
  EXPECT_EQ(tied[0].to_s_mm, 8.0);
  EXPECT_NEAR(tied[0].share, 5.0 / 8.0, 1e-12);
  EXPECT_EQ(tied[1].limit, FeedLimit::kPathJerk);
  ASSERT_EQ(apart.size(), 3u);
  EXPECT_EQ(apart[1].limit, FeedLimit::kSmoothing);
  EXPECT_EQ(apart[1].nearest, FeedLimit::kPathJerk);
  EXPECT_EQ(apart[1].reached_share, 0.6);
  EXPECT_EQ(apart[1].from_s_mm, 7.0);
  EXPECT_EQ(apart[1].to_s_mm, 8.0);
}

// ---- singular places within a cut

// Both ends of the cut can be held; the lambda mechanism is singular with the jet on its rail, and where its main link stands
// square to it.
TEST(ReachFault, ASingularPlaceWithinACutIsRefusedThere) {
  struct Case {
    const char* text;
    double x, y, i, j;  // the arc's begin and centre from it
    double sheet_y_mm;
  };
  for (const Case& c :
       {Case{"G0 X100 Y860\nM3\nG2 X300 Y860 I100 J-151.666667 F1200\nM5\nM2\n", 100, 860, 100, -151.666667,
             100.1},
        Case{"G0 X100 Y35\nM3\nG3 X300 Y35 I100 J235 F1200\nM5\nM2\n", 100, 35, 100, 235, -199.9}}) {
    MachineDescription machine = DemoLikeMachine();
    machine.sheet_height_mm = 950.0;  // over the rail
    machine.value(Parameter::kSheetYMm) = c.sheet_y_mm;
    const auto mechanism = kinematics::LambdaMechanism::FromDescription(machine);
    const auto reason_at = [&](double x, double y) {
      return kinematics::SolveInverse(
                 mechanism, machine.X_DJ().translation_mm() - machine.X_EW() * Eigen::Vector2d(x, y))
          .reason;
    };
    SCOPED_TRACE(c.text);
    ASSERT_EQ(reason_at(100, c.y), kinematics::Reason::kSolved);
    ASSERT_EQ(reason_at(300, c.y), kinematics::Reason::kSolved);
    const PlannedProgram planned = PlanPartProgram(c.text, machine, {});
    ASSERT_FALSE(planned.faults.empty());
    EXPECT_TRUE(planned.plan.segments.empty());
    EXPECT_EQ(planned.faults[0].line, 3u);
    EXPECT_EQ(planned.faults[0].reason, "SINGULAR") << planned.faults[0].message;
    double x = 0.0, y = 0.0;
    const std::size_t at = planned.faults[0].message.find("at X");
    ASSERT_NE(at, std::string::npos) << planned.faults[0].message;
    ASSERT_EQ(std::sscanf(planned.faults[0].message.c_str() + at, "at X%lf Y%lf", &x, &y), 2);
    EXPECT_EQ(reason_at(x, y), kinematics::Reason::kSingular);
    EXPECT_NEAR(std::hypot(x - c.x - c.i, y - c.y - c.j), std::hypot(c.i, c.j), 0.01) << "not on the arc";
    // It is the first such place, to the grid's millimetre or so.
    double nearest_x = 100.0;
    for (; nearest_x < 300.0; nearest_x += 0.05) {
      const double up = std::sqrt(c.i * c.i + c.j * c.j - std::pow(nearest_x - c.x - c.i, 2));
      if (reason_at(nearest_x, c.y + c.j + (c.j < 0.0 ? up : -up)) != kinematics::Reason::kSolved) {
        break;
      }
    }
    EXPECT_NEAR(x, nearest_x, 2.0);
    EXPECT_EQ(AdmitPartProgram(c.text, machine, {}).faults.at(0).reason, "SINGULAR");
  }
}

}  // namespace
}  // namespace lambdajet::trajectory
