// The laws every plan obeys, on programs that are hard on a planner: spikes, blocks of a nanometre, rounding noise, feeds and
// modes that change on every line, contours along the border of reach.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "tests/laws/trajectory_cases.hpp"
#include "tests/laws/trajectory_hostile_programs.hpp"
#include "tests/laws/trajectory_plan_judges.hpp"
#include "trajectory/core/feed/sheet_motion.hpp"
#include "trajectory/core/idle_motion/jerk_limited_move.hpp"

namespace lambdajet::trajectory {
namespace {

class HostileLaws : public testing::TestWithParam<bool> {};

// LAMBDAJET_EACH_PROGRAM tells each: how long the plan is and how long planning took.
void TellEach(int seed, const char* kind, const PlannedProgram& planned, double of_stopping, double took_s) {
  if (std::getenv("LAMBDAJET_EACH_PROGRAM") != nullptr) {
    std::printf(
        "each %d %s %.4f s, %.4f s cutting, %.4f mm cut, %.4f of stopping everywhere, planned in %.4f s %s\n",
        seed, kind, planned.plan.duration_s, planned.cutting_time_s, planned.cutting_length_mm, of_stopping,
        took_s, planned.faults.empty() ? "planned" : std::string(planned.faults[0].reason).c_str());
  }
}

// How long the cuts take if every block begins and ends at rest, each as quick as the path's limits allow on a line or circle of
// its own, with what the smoothing adds to a stop, to an exact one, and to the begin of a cut.
double StoppingEverywhere_s(const MachineDescription& m, const std::string& text) {
  constexpr double kStop_s = 0.08, kExactStop_s = 0.25;
  const double a = m.path.acceleration_mm_per_s2, j = m.path.jerk_mm_per_s3;
  Eigen::Vector2d at = Eigen::Vector2d::Zero();
  double time_s = 0.0, stop_s = kStop_s;
  ReadOptions reading;
  reading.gcode.default_tolerance_mm = m.path.corner_tolerance_mm;
  for (const Operation& o : ReadPartProgram(text, reading).operations) {
    const Eigen::Vector2d to{o.x_W_mm, o.y_W_mm};
    const double radius = (at - Eigen::Vector2d(o.center_x_W_mm, o.center_y_W_mm)).norm();
    MoveLimits limits{std::min(o.feed_mm_per_s, m.path.feed_mm_per_s), a, j};
    double length = 0.0;
    if (o.kind == OperationKind::kPathTolerance) {
      stop_s = o.value == 0.0 ? kExactStop_s : kStop_s;
    } else if (o.kind == OperationKind::kFeedLine) {
      length = (to - at).norm();
    } else if (o.kind == OperationKind::kFeedArc) {
      length = radius * std::abs(o.sweep_rad);
      const double v = std::min(std::sqrt(0.5 * a * radius), std::cbrt(0.5 * j * radius * radius));
      limits.velocity_mm_per_s = std::min(limits.velocity_mm_per_s, v);
    }
    if (length > 0.0) {
      time_s += SolveMove({length, 0.0, 0.0}, limits).duration_s + stop_s;
    }
    time_s += o.kind == OperationKind::kTraverse ? kStop_s : 0.0;
    if (length > 0.0 || o.kind == OperationKind::kTraverse) {
      at = to;
    }
  }
  return time_s;
}

TEST_P(HostileLaws, HoldOnHostilePrograms) {
  const MachineDescription m = DemoLikeMachine();
  PlanOptions options;
  options.compensate = GetParam();
  Worst worst;
  double slowest = 0.0;
  const Seeds seeds = WantedSeeds({17, 32});
  for (int seed = seeds.first; seed <= seeds.last; ++seed) {
    HostileProgram program(static_cast<unsigned>(seed));
    SCOPED_TRACE(std::to_string(seed) + " " + program.kind_name());
    const std::string text = program.Make();
    const auto begin = std::chrono::steady_clock::now();
    const PlannedProgram planned = PlanPartProgram(text, m, options);
    const double of_stopping = planned.cutting_time_s / StoppingEverywhere_s(m, text);
    TellEach(seed, program.kind_name(), planned, of_stopping,
             std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
    EXPECT_TRUE(planned.faults.empty())
        << planned.faults[0].line << " " << planned.faults[0].reason << " " << planned.faults[0].message;
    if (planned.faults.empty()) {
      ExpectPlanLaws(m, text, planned, worst);
      slowest = std::max(slowest, of_stopping);
    }
  }
  std::printf("seeds %d to %d: ", seeds.first, seeds.last);
  if (!options.compensate) {  // else the predicted error slows, too
    EXPECT_LE(slowest, 1.2);
    tests::PrintFigure("hostile.of_stopping_everywhere", slowest);
  }
  Tell("hostile", static_cast<std::size_t>(seeds.last - seeds.first + 1), GetParam(), worst);
}

// Without a node of its own a short block is driven from one end's speed to the other's.
TEST(ShortBlockLaw, AFastBlockBetweenSlowEndsIsNotCrept) {
  const MachineDescription m = DemoLikeMachine();
  for (const double length_mm : {0.02, 0.05, 0.1, 0.19, 0.3, 0.6, 0.95, 2.4}) {
    for (const bool back_and_forth : {false, true}) {
      SCOPED_TRACE(std::to_string(length_mm) + (back_and_forth ? " mm spikes" : " mm between slow ones"));
      std::string text = "G21 G90 F6000\nG0 X300 Y200\nM3\nG1 X310\n";
      double x = 310.0;
      for (int i = 0; i < 40; ++i) {
        x += back_and_forth && i % 2 == 1 ? -0.95 * length_mm : length_mm;
        char line[60];
        std::snprintf(line, sizeof line, "G1 X%.6f F%d\n", x, back_and_forth || i % 2 == 0 ? 6000 : 20);
        text += line;
      }
      text += "F6000\nG1 X320\nM5\nM2\n";
      const PlannedProgram planned = PlanPartProgram(text, m, {});
      ASSERT_TRUE(planned.faults.empty()) << planned.faults[0].reason;
      EXPECT_LE(planned.cutting_time_s, StoppingEverywhere_s(m, text));
    }
  }
}

// A shop writes G64 P0.1 or P0.5 to go faster. Corners may cost a little more where a wider crossing was chosen and did not pay.
TEST(CornerLaw, AWiderPathToleranceIsHardlyEverSlower) {
  const MachineDescription m = DemoLikeMachine();
  std::vector<double> total_s;
  for (const char* p : {"0.02", "0.05", "0.1", "0.2", "0.5", "2"}) {
    total_s.push_back(0.0);
    for (const double degrees : {5.0, 20.0, 45.0, 90.0, 120.0, 135.0, 150.0, 168.0, 180.0}) {
      char text[200];
      std::snprintf(text, sizeof text,
                    "G21 G90 F6000\nG64 P%s\nG0 X300 Y200\nM3\nG1 X330\nG1 X%.6f Y%.6f\nM5\nM2\n", p,
                    330.0 + 20.0 * std::cos(degrees * std::numbers::pi / 180.0),
                    200.0 + 20.0 * std::sin(degrees * std::numbers::pi / 180.0));
      const PlannedProgram planned = PlanPartProgram(text, m, {});
      ASSERT_TRUE(planned.faults.empty()) << planned.faults[0].reason;
      total_s.back() += planned.cutting_time_s;
    }
    EXPECT_LE(total_s.back(), 1.025 * *std::min_element(total_s.begin(), total_s.end())) << "P" << p;
  }
}

// Along the border of what the mechanism reaches, and out to it and back.
class BorderProgram {
 public:
  BorderProgram(const MachineDescription& m, unsigned seed) : sheet_(m), random_(seed) {}

  std::string Make() {
    const double first = Between(0.05, 1.4), step = Between(2e-4, 4e-3);
    const double inside_mm = std::exp(Between(std::log(kNearest_mm), std::log(5.0)));
    std::string text = "G21 G90\n";
    for (int i = 0; i <= 60; ++i) {
      const double angle = first + step * i;
      const Eigen::Vector2d u(std::cos(angle), std::sin(angle));
      const double reach_mm = Reach(u);
      if (i % 20 == 10) {
        Go(text, kFrom + (reach_mm - 30.0) * u);
      }
      Go(text, kFrom + (reach_mm - inside_mm) * u);
      text += i == 0 ? "M3 P0.1\nG1 F6000\n" : "";
    }
    return text + "M5\nM2\n";
  }

 private:
  static constexpr double kNearest_mm = 0.05;
  const Eigen::Vector2d kFrom{400.0, 300.0};

  double Between(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }

  static void Go(std::string& text, const Eigen::Vector2d& p) {
    char line[64];
    std::snprintf(line, sizeof line, "%s X%.6f Y%.6f\n", text.size() < 10 ? "G0" : "G1", p.x(), p.y());
    text += line;
  }

  // To the first place along the ray that is not reached.
  double Reach(const Eigen::Vector2d& u) const {
    const auto reached = [&](double r) {
      return sheet_.Position(kFrom + r * u).reason == kinematics::Reason::kSolved;
    };
    double low = 0.0, high = 1.0;
    for (; reached(high) && high < 5000.0; high += 1.0) {
      low = high;
    }
    for (int i = 0; i < 40; ++i) {
      const double middle = 0.5 * (low + high);
      (reached(middle) ? low : high) = middle;
    }
    return low;
  }

  SheetMotion sheet_;
  std::mt19937 random_;
};

TEST_P(HostileLaws, HoldAlongTheBorderOfReach) {
  MachineDescription m = DemoLikeMachine();
  m.sheet_width_mm = m.sheet_height_mm = 6000.0;
  PlanOptions options;
  options.compensate = GetParam();
  Worst worst;
  for (const double margin_mm : {20.0, 1.0, 0.3}) {
    m.singular_margin_mm = margin_mm;
    for (const unsigned seed : {1u, 2u, 3u, 35u, 43u, 68u}) {
      SCOPED_TRACE(std::to_string(seed) + " with " + std::to_string(margin_mm) + " mm from singular");
      const std::string text = BorderProgram(m, seed).Make();
      const PlannedProgram planned = PlanPartProgram(text, m, options);
      TellEach(static_cast<int>(seed), "border", planned,
               planned.cutting_time_s / StoppingEverywhere_s(m, text), 0.0);
      EXPECT_TRUE(planned.faults.empty())
          << planned.faults[0].line << " " << planned.faults[0].reason << " " << planned.faults[0].message;
      if (planned.faults.empty()) {
        ExpectPlanLaws(m, text, planned, worst);
      }
    }
  }
  Tell("border", 18, GetParam(), worst);
}

// A plan that cuts across such an arc lies near its neighbours all the way.
TEST(ContourLaw, AnArcSmallerThanTheSmoothingIsLongIsNotCutAcross) {
  const MachineDescription m = DemoLikeMachine();
  for (const double radius_mm : {0.02, 0.03, 0.05, 0.1, 0.2}) {
    SCOPED_TRACE(radius_mm);
    char text[160];
    std::snprintf(text, sizeof text,
                  "G21 G90 F6000\nG0 X300 Y200\nM3\nG1 X320\nG3 X320 Y200 I0 J%.3f\nG1 X340\nM5\nM2\n",
                  radius_mm);
    const PlannedProgram planned = PlanPartProgram(text, m, {});
    ASSERT_TRUE(planned.faults.empty()) << planned.faults[0].reason;
    Worst worst;
    ExpectContour(m, text, planned, worst);
  }
}

// The tighter of two tolerances holds where they meet; beside the corner each block keeps its own.
TEST(ContourLaw, EachBlockKeepsItsOwnTolerance) {
  const MachineDescription m = DemoLikeMachine();
  for (const char* modes : {"G64 P0.002|G64 P1", "G64 P1|G64 P0.002", "G61|G64 P0.5", "G64 P0.5|G61"}) {
    SCOPED_TRACE(modes);
    const std::string both(modes), first = both.substr(0, both.find('|')),
                                   second = both.substr(both.find('|') + 1);
    const std::string text = "G21 G90 F3000\nG0 X300 Y200\nM3\n" + first + "\nG1 X320\n" + second +
                             "\nG1 Y220\n" + first + "\nG1 X319 Y200\nG1 X300\nM5\nM2\n";
    const PlannedProgram planned = PlanPartProgram(text, m, {});
    ASSERT_TRUE(planned.faults.empty()) << planned.faults[0].reason;
    Worst worst;
    ExpectContour(m, text, planned, worst);
  }
}

INSTANTIATE_TEST_SUITE_P(Elastic, HostileLaws, testing::Values(false, true));

}  // namespace
}  // namespace lambdajet::trajectory
