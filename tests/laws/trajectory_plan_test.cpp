// The laws every plan obeys, on random programs: limits between samples, contour, continuity, gates, determinism.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "kinematics/core/lambda_mechanism.hpp"
#include "tests/laws/trajectory_cases.hpp"
#include "trajectory/core/feed/plan_program.hpp"
#include "trajectory/core/feed/program_path.hpp"
#include "trajectory/core/part_program/gcode_reader.hpp"

namespace lambdajet::trajectory {
namespace {

constexpr double kRelative = 1e-6;

int ProgramCount() {
  const char* wanted = std::getenv("LAMBDAJET_RANDOM_PROGRAMS");
  return wanted == nullptr ? 40 : std::atoi(wanted);
}

Polynomial Sum(const Polynomial& a, const Polynomial& b) {
  Polynomial sum = a;
  for (std::size_t i = 0; i < sum.c.size(); ++i) {
    sum.c[i] += b.c[i];
  }
  return sum;
}

// Jet on the sheet, from the rigid setpoints by forward kinematics: independent of what the planner believes.
Eigen::Vector2d JetAt(const MachineDescription& m, const kinematics::LambdaMechanism& mechanism,
                      const Segment& s, double t) {
  const auto forward = kinematics::SolveForward(mechanism, {s.q_mm[0].value(t), s.q_mm[1].value(t)});
  const Eigen::Vector2d p_E = m.X_EW().rotation().transpose() *
                              (m.X_DJ().translation_mm() - forward.p_DE_mm - m.X_EW().translation_mm());
  return p_E;
}

void ExpectLimits(const MachineDescription& m, const Plan& plan) {
  double worst = 0.0;
  for (const Segment& s : plan.segments) {
    for (std::size_t a = 0; a < 2; ++a) {
      const Polynomial q = Sum(s.q_mm[a], s.lead_mm[a]);
      const ActuatorLimits& limit = m.actuators[a];
      for (double t = 0.0; t < s.duration_s; t += 1e-4) {
        worst = std::max({worst, std::abs(q.first(t)) / limit.velocity_mm_per_s,
                          std::abs(q.second(t)) / limit.acceleration_mm_per_s2,
                          std::abs(q.third(t)) / limit.jerk_mm_per_s3});
        ASSERT_GE(q.value(t), limit.position_min_mm);
        ASSERT_LE(q.value(t), limit.position_max_mm);
      }
    }
  }
  EXPECT_LE(worst, 1.0 + kRelative);
}

void ExpectPathAcceleration(const MachineDescription& m, const PlannedProgram& planned) {
  for (const PlanSample& s : planned.samples) {
    ASSERT_LE(std::hypot(s.ax_W_mm_per_s2, s.ay_W_mm_per_s2),
              m.path.acceleration_mm_per_s2 * (1 + kRelative));
    ASSERT_LE(std::hypot(s.vx_W_mm_per_s, s.vy_W_mm_per_s),
              std::max(m.path.rapid_mm_per_s, m.path.feed_mm_per_s) * (1 + kRelative));
  }
}

void ExpectContinuity(const Plan& plan) {
  for (std::size_t i = 1; i < plan.segments.size(); ++i) {
    const Segment& a = plan.segments[i - 1];
    const Segment& b = plan.segments[i];
    const double T = a.duration_s;
    ASSERT_NEAR(a.start_s + T, b.start_s, 1e-9);
    for (std::size_t j = 0; j < 2; ++j) {
      ASSERT_NEAR(a.q_mm[j].value(T), b.q_mm[j].value(0), 1e-9) << i;
      ASSERT_NEAR(a.q_mm[j].first(T), b.q_mm[j].first(0), 1e-7) << i;
      ASSERT_NEAR(a.q_mm[j].second(T), b.q_mm[j].second(0), 1e-4) << i;
      ASSERT_NEAR(a.lead_mm[j].value(T), b.lead_mm[j].value(0), 1e-6) << i;
      ASSERT_NEAR(a.lead_mm[j].first(T), b.lead_mm[j].first(0), 1e-3) << i;
    }
    ASSERT_NEAR(a.s_mm.value(T), b.s_mm.value(0), 1e-9);
    ASSERT_NEAR(a.s_mm.first(T), b.s_mm.first(0), 1e-7);
  }
}

void ExpectMonotone(const Plan& plan) {
  double last = plan.segments.front().s_mm.value(0);
  for (const Segment& s : plan.segments) {
    for (int k = 0; k <= 8; ++k) {
      const double here = s.s_mm.value(s.duration_s * k / 8);
      ASSERT_GE(here, last - 1e-6);  // a nanometre: quintics of a motion of higher order, at its very start
      last = std::max(last, here);
    }
  }
  EXPECT_NEAR(plan.segments.back().s_mm.value(plan.segments.back().duration_s), plan.length_mm, 1e-9);
}

void ExpectClosedGates(const Plan& plan) {
  std::uint32_t seen = 0;
  for (const Segment& s : plan.segments) {
    if (s.gate_at_end == 0) {
      continue;
    }
    ASSERT_EQ(s.gate_at_end, ++seen);
    const Gate& gate = plan.gates[seen - 1];
    EXPECT_NEAR(s.s_mm.value(s.duration_s), gate.s_mm, 1e-9);
    EXPECT_NEAR(s.s_mm.first(s.duration_s), 0.0, 1e-9);
    for (std::size_t a = 0; a < 2; ++a) {
      EXPECT_NEAR(s.q_mm[a].first(s.duration_s), 0.0, 1e-8);
      EXPECT_NEAR(s.lead_mm[a].value(s.duration_s), 0.0, 1e-6);
    }
  }
  EXPECT_EQ(seen, plan.gates.size());
  for (std::size_t i = 1; i < plan.events.size(); ++i) {
    EXPECT_GE(plan.events[i].s_mm, plan.events[i - 1].s_mm);
  }
}

double ToChord(const Eigen::Vector2d& p, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  const Eigen::Vector2d d = b - a;
  const double share = d.squaredNorm() > 0.0 ? std::clamp((p - a).dot(d) / d.squaredNorm(), 0.0, 1.0) : 0.0;
  return (p - a - share * d).norm();
}

// Largest distance of the jet from the programmed contour, and of the contour's corners from the jet's path.
void ExpectContour(const MachineDescription& m, const std::string& text, const PlannedProgram& planned) {
  const auto mechanism = kinematics::LambdaMechanism::FromDescription(m);
  PathDefaults defaults;
  defaults.tolerance_mm = m.path.corner_tolerance_mm;
  const ProgramPath path = MakeProgramPath(ReadGcode(text).operations, defaults);
  struct Piece {
    const PathPiece* piece;
    double s;
  };
  std::vector<Piece> pieces;
  for (std::size_t i = 0; i < path.elements.size(); ++i) {
    for (const PathPiece& p : path.elements[i].pieces) {
      pieces.push_back({&p, planned.element_begin_s_mm[i] + p.begin_mm});
    }
  }
  std::vector<double> corner(pieces.size(), 1e9);
  double worst = 0.0;
  std::size_t from = 0;
  Eigen::Vector2d last = path.start_mm;
  for (const Segment& segment : planned.plan.segments) {
    for (int k = 0; k < 8; ++k) {
      const double t = segment.duration_s * k / 8, s = segment.s_mm.value(t);
      while (from < pieces.size() && pieces[from].s + pieces[from].piece->length_mm < s - 3.0) {
        ++from;
      }
      const Eigen::Vector2d p = JetAt(m, mechanism, segment, t);
      double nearest = 1e9;
      bool in_run = false;
      for (std::size_t i = from; i < pieces.size() && pieces[i].s < s + 3.0; ++i) {
        nearest = std::min(nearest, DistanceTo(*pieces[i].piece, p));
        in_run = in_run || (s >= pieces[i].s && s <= pieces[i].s + pieces[i].piece->length_mm);
        corner[i] = std::min(corner[i], ToChord(PointOn(*pieces[i].piece, 0.0).p_mm, last, p));
      }
      worst = in_run ? std::max(worst, nearest) : worst;
      last = p;
    }
  }
  EXPECT_LE(worst, m.path.corner_tolerance_mm * (1 + 1e-3));
  for (std::size_t i = 1; i < pieces.size(); ++i) {
    EXPECT_LE(corner[i], m.path.corner_tolerance_mm * (1 + 3e-2)) << pieces[i].piece->line;
  }
}

class PlanLaws : public testing::TestWithParam<bool> {};

TEST_P(PlanLaws, HoldOnRandomPrograms) {
  const MachineDescription m = DemoLikeMachine();
  PlanOptions options;
  options.compensate = GetParam();
  for (int seed = 1; seed <= ProgramCount(); ++seed) {
    SCOPED_TRACE(seed);
    const std::string text = RandomProgram(static_cast<unsigned>(seed)).Make();
    const PlannedProgram planned = PlanPartProgram(text, m, options);
    ASSERT_TRUE(planned.faults.empty()) << planned.faults[0].line << " " << planned.faults[0].reason << " "
                                        << planned.faults[0].message << "\n"
                                        << text;
    ExpectLimits(m, planned.plan);
    ExpectPathAcceleration(m, planned);
    ExpectContinuity(planned.plan);
    ExpectMonotone(planned.plan);
    ExpectClosedGates(planned.plan);
    ExpectContour(m, text, planned);
    if (HasFailure()) {
      break;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Elastic, PlanLaws, testing::Values(false, true));

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
  EXPECT_GE(circle, 0.95);
  EXPECT_GE(eight, 0.95);
  EXPECT_LE(circle, 1.0 + 1e-4);
  EXPECT_LE(eight, 1.0 + 1e-4);
}

TEST(ElasticLaw, FeedForwardMakesTheSheetFollow) {
  const ElasticFigures figures = MeasureFeedForward();
  std::printf("elastic error %.4f mm rms; removed %.2f %%, with stiffness 10 %% wrong %.2f %%\n",
              figures.untreated_mm, 100 * figures.removed_exact, 100 * figures.removed_wrong);
  EXPECT_GE(figures.removed_exact, 0.95);
  EXPECT_GE(figures.removed_wrong, 0.80);
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
