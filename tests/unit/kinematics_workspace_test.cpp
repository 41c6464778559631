// The workspace's polygons against an independent fine grid, its rectangle against what binds it, swept collision, and the
// optimiser's promises.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "kinematics/core/largest_rectangle.hpp"
#include "kinematics/core/swept_collision.hpp"
#include "kinematics/core/workspace.hpp"
#include "kinematics/optimisation/geometry_optimisation.hpp"

namespace lambdajet::kinematics {
namespace {

using Eigen::Vector2d;

LambdaMechanism PaperLambda(MechanismParameters p = IdealLambda(1200, 600, 700)) {
  auto m = LambdaMechanism::FromParameters(p);
  m.singular_margin_mm = 20.0;
  m.travel = {{{-1600.0, 400.0}, {-300.0, 1400.0}}};
  return m;
}

LambdaMechanism TiltedLambda() {
  MechanismParameters p = IdealLambda(1200.7, 599.4, 701.3);
  p.tail<6>() << 1.5e-3, 0.31, -0.9e-3, -0.42, 12.5, -7.25;
  return PaperLambda(p);
}

LambdaMechanism ApartBiglide() {
  auto m = LambdaMechanism::FromParameters(TwoRailBiglide(1200, 1000, 1500), {1, -1});
  m.assembly_mode = SolveInverse(m, {0.0, 800.0}).assembly_mode;
  m.singular_margin_mm = 15.0;
  m.travel = {{{-1000.0, 900.0}, {-1200.0, 1100.0}}};
  return m;
}

// Usable by the solver's own verdict, which knows nothing of margins functions or polygons.
bool Usable(const LambdaMechanism& m, const Vector2d& p) {
  return SolveInverse(m, p).reason == Reason::kSolved;
}

double GridArea(const LambdaMechanism& m, double step) {
  std::size_t inside = 0;
  for (double y = -1300.5; y < 1800.0; y += step) {
    for (double x = -3100.25; x < 3100.0; x += step) {
      inside += Usable(m, {x, y});
    }
  }
  return static_cast<double>(inside) * step * step;
}

class WorkspaceOf : public testing::TestWithParam<int> {
 protected:
  LambdaMechanism mechanism() const {
    return GetParam() == 0 ? PaperLambda() : GetParam() == 1 ? TiltedLambda() : ApartBiglide();
  }
};
INSTANTIATE_TEST_SUITE_P(Mechanisms, WorkspaceOf, testing::Values(0, 1, 2));

TEST_P(WorkspaceOf, AreaAgreesWithAFineGridToAThousandth) {
  const LambdaMechanism m = mechanism();
  const Workspace workspace = ComputeWorkspace(m);
  ASSERT_EQ(workspace.reason, Reason::kSolved);
  const double grid = GridArea(m, 2.0);
  std::printf("workspace %.1f mm2, grid %.1f mm2, relative difference %.2e, %zu outlines, %zu vertices\n",
              workspace.area_mm2, grid, workspace.area_mm2 / grid - 1.0, workspace.outlines.size(),
              workspace.outlines[0].size());
  EXPECT_NEAR(workspace.area_mm2 / grid, 1.0, 1e-3);
}

// Every point of every edge lies within 0.1 mm of where the solver's verdict changes.
TEST_P(WorkspaceOf, BoundaryLiesWithinATenthOfAMillimetre) {
  const LambdaMechanism m = mechanism();
  const Workspace workspace = ComputeWorkspace(m);
  std::size_t checked = 0;
  for (const Outline& outline : workspace.outlines) {
    for (std::size_t i = 0; i < outline.size(); ++i) {
      const Vector2d a = outline[i], b = outline[(i + 1) % outline.size()];
      if ((b - a).norm() < 0.3) {
        continue;  // too short to have a direction across
      }
      const Vector2d inward = Vector2d(a.y() - b.y(), b.x() - a.x()).normalized();
      for (const double t : {0.25, 0.5, 0.75}) {
        const Vector2d p = a + t * (b - a);
        ASSERT_TRUE(Usable(m, p + 0.1 * inward)) << p.transpose();
        ASSERT_FALSE(Usable(m, p - 0.1 * inward)) << p.transpose();
        ++checked;
      }
    }
  }
  EXPECT_GT(checked, 300u);
}

TEST_P(WorkspaceOf, RectangleIsUsableThroughoutAndCannotGrow) {
  const LambdaMechanism m = mechanism();
  const Workspace workspace = ComputeWorkspace(m);
  const Rectangle& r = workspace.rectangle;
  ASSERT_GT(r.area_mm2(), 1e4);
  const double e = 0.1;  // the polygon's tolerance
  for (int j = 0; j <= 100; ++j) {
    for (int i = 0; i <= 100; ++i) {
      const Vector2d p(r.x_min_mm + e + (r.x_max_mm - r.x_min_mm - 2 * e) * i / 100.0,
                       r.y_min_mm + e + (r.y_max_mm - r.y_min_mm - 2 * e) * j / 100.0);
      ASSERT_TRUE(Usable(m, p)) << p.transpose();
    }
  }
  // Each side pushed out by 0.5 mm leaves the region somewhere.
  const auto leaves = [&](const Vector2d& from, const Vector2d& to) {
    for (int i = 0; i <= 4000; ++i) {
      if (!Usable(m, from + (to - from) * (i / 4000.0))) {
        return true;
      }
    }
    return false;
  };
  const double out = 0.5;
  EXPECT_TRUE(leaves({r.x_min_mm - out, r.y_min_mm}, {r.x_min_mm - out, r.y_max_mm}));
  EXPECT_TRUE(leaves({r.x_max_mm + out, r.y_min_mm}, {r.x_max_mm + out, r.y_max_mm}));
  EXPECT_TRUE(leaves({r.x_min_mm, r.y_min_mm - out}, {r.x_max_mm, r.y_min_mm - out}));
  EXPECT_TRUE(leaves({r.x_min_mm, r.y_max_mm + out}, {r.x_max_mm, r.y_max_mm + out}));
}

// Brute force over a raster cannot beat it by more than the raster's own coarseness.
TEST(Workspace, RectangleIsTheLargest) {
  const LambdaMechanism m = PaperLambda();
  const Workspace workspace = ComputeWorkspace(m);
  double best = 0.0;
  for (double y0 = 10.0; y0 < 1190.0; y0 += 10.0) {
    double left = -std::numeric_limits<double>::max(), right = std::numeric_limits<double>::max();
    for (double y1 = y0; y1 < 1190.0; y1 += 10.0) {
      // On one straight rail a height's usable interval follows from the travels alone.
      const InverseAnswer at = SolveInverse(m, {0.0, y1});
      if (!at.positioned || at.serial_distance_mm < 20.0 || at.parallel_distance_mm < 20.0) {
        break;
      }
      for (int k = 0; k < 2; ++k) {
        left = std::max(left, m.travel[k].min_mm - at.actuator_position_mm[k]);
        right = std::min(right, m.travel[k].max_mm - at.actuator_position_mm[k]);
      }
      best = std::max(best, (right - left) * (y1 - y0));
    }
  }
  EXPECT_GE(workspace.rectangle.area_mm2(), (1.0 - 1e-4) * best);
  EXPECT_LE(workspace.rectangle.area_mm2(), 1.05 * best);
}

TEST(Workspace, NamesWhatBindsEachSide) {
  const Workspace workspace = ComputeWorkspace(PaperLambda());
  EXPECT_EQ(PoseLimitReason(workspace.binding[0]), Reason::kActuatorLimit);
  EXPECT_EQ(PoseLimitReason(workspace.binding[1]), Reason::kActuatorLimit);
  auto wide = PaperLambda();
  wide.travel = {{{-5000.0, 5000.0}, {-5000.0, 5000.0}}};
  const Workspace free = ComputeWorkspace(wide);
  EXPECT_EQ(free.binding[2], PoseLimit::kParallel);
  EXPECT_EQ(free.binding[3], PoseLimit::kMainLink);
  EXPECT_NEAR(free.rectangle.y_min_mm, 20.0, 0.01);
  EXPECT_NEAR(free.rectangle.y_max_mm, 1180.0, 0.01);
}

TEST(Workspace, RefusesWithoutTravelAndWithoutPoses) {
  auto m = PaperLambda();
  m.travel = {};
  EXPECT_EQ(ComputeWorkspace(m).reason, Reason::kActuatorLimit);
  m = PaperLambda();
  m.singular_margin_mm = 700.0;
  EXPECT_EQ(ComputeWorkspace(m).reason, Reason::kOutOfReach);
  EXPECT_EQ(ComputeWorkspace(LambdaMechanism{}).reason, Reason::kBadGeometry);
}

TEST(LargestRectangle, IsExactInShapesOneKnows) {
  const Outline triangle = {{0, 0}, {100, 0}, {0, 80}};  // half of it: 50 x 40
  const std::vector<Outline> one = {triangle};
  EXPECT_NEAR(LargestRectangle(one).area_mm2(), 2000.0, 1.0);
  const std::vector<Outline> with_hole = {{{0, 0}, {100, 0}, {100, 100}, {0, 100}},
                                          {{60, 60}, {60, 70}, {70, 70}, {70, 60}}};
  EXPECT_NEAR(LargestRectangle(with_hole).area_mm2(), 6000.0, 1.0);
}

TEST(SweptCollision, FindsTheFirstContactExactly) {
  const auto sheet = SheetCorners({-50.0, 20.0, 0.0}, 100.0, 60.0);
  const auto column = BodyCorners(300.0, 0.0, 340.0, 40.0);
  const std::vector<Corners> bodies = {column};
  const std::vector<Vector2d> path = {{0, 0}, {200, 0}, {400, 0}};
  const SweptAnswer hit = SweepSheet(sheet, path, bodies);
  ASSERT_TRUE(hit.collides);
  EXPECT_EQ(hit.stretch, 1u);
  EXPECT_NEAR(hit.p_DE_mm.x(), 250.0, 1e-5);  // the sheet's right edge lies 50 before the tool
  const SweptAnswer with_margin = SweepSheet(sheet, path, bodies, 10.0);
  EXPECT_NEAR(with_margin.p_DE_mm.x(), 240.0, 1e-2);
}

TEST(SweptCollision, TellsTheClearanceOfAPassingSheet) {
  const auto sheet = SheetCorners({0.0, 0.0, 0.0}, 100.0, 60.0);
  const auto column = BodyCorners(300.0, 75.0, 340.0, 90.0);
  const std::vector<Corners> bodies = {column};
  const SweptAnswer passes = SweepSheet(sheet, std::vector<Vector2d>{{0, 0}, {600, 0}}, bodies);
  EXPECT_FALSE(passes.collides);
  EXPECT_NEAR(passes.clearance_mm, 15.0, 1e-9);
  const SweptAnswer stands = SweepSheet(sheet, std::vector<Vector2d>{{300.0, 100.0}}, bodies);
  EXPECT_NEAR(stands.clearance_mm, 10.0, 1e-9);
}

// The distance of two polygons by themselves, which knows nothing of their Minkowski sum.
double Cross(const Vector2d& a, const Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

// True if some edge of `polygon` has all of `other` on its outside.
bool Separates(Corners polygon, const Vector2d& polygon_shift, Corners other, const Vector2d& other_shift) {
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vector2d edge = polygon[(i + 1) % polygon.size()] - polygon[i];
    const bool outside = std::all_of(other.begin(), other.end(), [&](const Vector2d& p) {
      return Cross(edge, p + other_shift - polygon[i] - polygon_shift) < 0.0;
    });
    if (outside) {
      return true;
    }
  }
  return false;
}

double PointToEdge(const Vector2d& p, const Vector2d& a, const Vector2d& b) {
  const Vector2d edge = b - a;
  const double t = std::clamp((p - a).dot(edge) / edge.squaredNorm(), 0.0, 1.0);
  return (p - a - t * edge).norm();
}

// Between disjoint convex polygons a corner of one is nearest to an edge of the other.
double NearestCorner(Corners corners, const Vector2d& corner_shift, Corners edges,
                     const Vector2d& edge_shift) {
  double nearest = std::numeric_limits<double>::max();
  for (const Vector2d& p : corners) {
    for (std::size_t i = 0; i < edges.size(); ++i) {
      nearest = std::min(nearest, PointToEdge(p + corner_shift, edges[i] + edge_shift,
                                              edges[(i + 1) % edges.size()] + edge_shift));
    }
  }
  return nearest;
}

double Distance(Corners moving, const Vector2d& shift_mm, Corners fixed) {
  const Vector2d none = Vector2d::Zero();
  if (!Separates(moving, shift_mm, fixed, none) && !Separates(fixed, none, moving, shift_mm)) {
    return 0.0;
  }
  return std::min(NearestCorner(moving, shift_mm, fixed, none), NearestCorner(fixed, none, moving, shift_mm));
}

std::vector<Vector2d> RandomConvex(std::mt19937_64& random) {
  std::uniform_real_distribution<double> place(-400.0, 400.0), turn(0.0, 6.2831), size(10.0, 150.0);
  const Vector2d centre(place(random), place(random)), half(size(random), size(random));
  std::vector<double> angles(3 + random() % 7);
  std::generate(angles.begin(), angles.end(), [&] { return turn(random); });
  std::sort(angles.begin(), angles.end());
  std::vector<Vector2d> corners;
  for (const double a : angles) {
    corners.push_back(centre + Vector2d(half.x() * std::cos(a), half.y() * std::sin(a)));
  }
  return IsConvex(corners) ? corners : RandomConvex(random);
}

// The distance is convex along a straight stretch, so halving finds its least value and the first contact to all digits.
struct Searched {
  double least_mm = 0.0;
  double least_at = 0.0;
  double contact_at = 2.0;
};
Searched Search(Corners sheet, const Vector2d& from, const Vector2d& to, Corners body, double margin_mm) {
  const auto at = [&](double t) { return Distance(sheet, from + t * (to - from), body); };
  double low = 0.0, high = 1.0;
  for (int i = 0; i < 90; ++i) {
    const double a = low + (high - low) / 3.0, b = high - (high - low) / 3.0;
    const bool falling = at(a) > at(b);
    (falling ? low : high) = falling ? a : b;
  }
  Searched found{at(low), low, 2.0};
  if (found.least_mm <= margin_mm) {
    double free = 0.0, met = low;
    for (int i = 0; i < 50; ++i) {
      const double middle = 0.5 * (free + met);
      (at(middle) <= margin_mm ? met : free) = middle;
    }
    found.contact_at = met;
  }
  return found;
}

TEST(SweptCollision, ContactAndClearanceAreThoseOfASearch) {
  std::mt19937_64 random(17);
  std::uniform_real_distribution<double> place(-450.0, 450.0);
  int hits = 0;
  for (int n = 0; n < 1500; ++n) {
    const std::vector<Vector2d> sheet = RandomConvex(random), body = RandomConvex(random);
    const std::vector<Vector2d> path = {{place(random), place(random)}, {place(random), place(random)}};
    const double margin = n % 3 == 0 ? 25.0 : 0.0;
    const std::vector<Corners> bodies = {body};
    const SweptAnswer swept = SweepSheet(sheet, path, bodies, margin);
    const Searched found = Search(sheet, path[0], path[1], body, margin);
    if (std::abs(found.least_mm - margin) < 1e-4) {
      continue;  // it grazes
    }
    ASSERT_EQ(swept.collides, found.contact_at <= 1.0) << n << ": " << found.least_mm;
    if (swept.collides) {
      ASSERT_LE((swept.p_DE_mm - path[0] - found.contact_at * (path[1] - path[0])).norm(), 1e-4) << n;
    } else {
      ASSERT_NEAR(swept.clearance_mm, found.least_mm, 1e-6) << n;
      ASSERT_NEAR(Distance(sheet, swept.p_DE_mm, body), found.least_mm, 1e-6) << n;
    }
    hits += swept.collides;
  }
  EXPECT_GT(hits, 80);
  EXPECT_LT(hits, 1400);
}

// Seen from the sheet the body moves the other way; a path that is split or run backwards comes as near.
TEST(SweptCollision, IsTheSameFromTheBodysSideAndAlongASplitOrTurnedPath) {
  std::mt19937_64 random(23);
  std::uniform_real_distribution<double> place(-900.0, 900.0);
  for (int n = 0; n < 1000; ++n) {
    const std::vector<Vector2d> sheet = RandomConvex(random), body = RandomConvex(random);
    const std::vector<Corners> sheets = {sheet}, bodies = {body};
    const Vector2d a(place(random), place(random)), b(place(random), place(random));
    const SweptAnswer there = SweepSheet(sheet, std::vector<Vector2d>{a, b}, bodies);
    const SweptAnswer back = SweepSheet(sheet, std::vector<Vector2d>{b, a}, bodies);
    const SweptAnswer split =
        SweepSheet(sheet, std::vector<Vector2d>{a, a + 0.3 * (b - a), a + 0.7 * (b - a), b}, bodies);
    const SweptAnswer seen = SweepSheet(body, std::vector<Vector2d>{-a, -b}, sheets);
    for (const SweptAnswer& other : {back, split, seen}) {
      ASSERT_EQ(other.collides, there.collides);
      ASSERT_NEAR(other.clearance_mm, there.clearance_mm, 1e-7);
    }
    ASSERT_LE((split.p_DE_mm - there.p_DE_mm).norm(), there.collides ? 1e-6 : 1e-3 * (b - a).norm());
  }
}

TEST(GeometryOptimisation, LowersTheWorstErrorGainAndServesTheZone) {
  OptimisationTask task;
  task.start = PaperLambda();
  task.start.travel = {{{-1600.0, 2600.0}, {-1600.0, 2600.0}}};
  task.zone = {-300.0, 400.0, 300.0, 900.0};
  task.evaluations = 1500;
  const OptimisationAnswer answer = OptimiseGeometry(task);
  ASSERT_EQ(answer.reason, Reason::kSolved);
  EXPECT_GT(answer.before, 0.0);
  EXPECT_LT(answer.after, 0.9 * answer.before);
  EXPECT_LE(answer.evaluations, 1600);
  EXPECT_NEAR(WorstErrorGain(answer.found, task.zone).gain, answer.after, 1e-12);
  std::printf(
      "worst error gain over the zone: %.4f before, %.4f after, links %.1f %.1f %.1f, rail offset %.1f\n",
      answer.before, answer.after, answer.found.parameters[0], answer.found.parameters[1],
      answer.found.parameters[2], answer.found.parameters[4]);
}

TEST(GeometryOptimisation, EnlargesTheRectangle) {
  OptimisationTask task;
  task.start = PaperLambda();
  task.zone = {-200.0, 500.0, 100.0, 800.0};
  task.objective = Objective::kRectangle;
  task.highest_ratio = 1.3;
  task.evaluations = 80;
  const OptimisationAnswer answer = OptimiseGeometry(task);
  ASSERT_EQ(answer.reason, Reason::kSolved);
  EXPECT_GT(answer.after, answer.before);
}

TEST(GeometryOptimisation, SaysWhenNothingServesTheZone) {
  OptimisationTask task;
  task.start = PaperLambda();
  task.zone = {-9000.0, 400.0, 9000.0, 900.0};
  task.evaluations = 200;
  EXPECT_EQ(OptimiseGeometry(task).reason, Reason::kOutOfReach);
  task.start.travel = {};
  EXPECT_EQ(OptimiseGeometry(task).reason, Reason::kActuatorLimit);
}

}  // namespace
}  // namespace lambdajet::kinematics
