// The quickest jerk-limited move: keeps its ends and limits, and no searched-for move of any shape is quicker.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "tests/support/figure.hpp"
#include "trajectory/core/idle_motion/jerk_limited_move.hpp"

namespace lambdajet::trajectory {
namespace {

struct Case {
  MoveEnds ends;
  MoveLimits limits;
};

double Logarithmic(std::mt19937_64& random, double from, double to) {
  return from * std::pow(to / from, std::uniform_real_distribution<>(0.0, 1.0)(random));
}

Case RandomCase(std::mt19937_64& random, bool at_rest) {
  Case c;
  c.limits = {Logarithmic(random, 1, 1000), Logarithmic(random, 10, 1e4), Logarithmic(random, 100, 1e6)};
  std::uniform_real_distribution<> sign(-1.0, 1.0);
  c.ends.distance_mm = sign(random) * Logarithmic(random, 1e-3, 1e3);
  if (!at_rest) {
    c.ends.start_mm_per_s = c.limits.velocity_mm_per_s * sign(random);
    c.ends.end_mm_per_s =
        random() % 4 == 0 ? c.ends.start_mm_per_s : c.limits.velocity_mm_per_s * sign(random);
  }
  return c;
}

TEST(JerkLimitedMove, MeetsItsEndsAndKeepsItsLimits) {
  std::mt19937_64 random(1);
  for (int i = 0; i < 40000; ++i) {
    const Case c = RandomCase(random, i % 2 == 0);
    const JerkLimitedMove move = SolveMove(c.ends, c.limits);
    ASSERT_EQ(move.verdict, MoveVerdict::kMoves);
    const MovePoint end = move.At(move.duration_s);
    const double scale = std::abs(c.ends.distance_mm) + c.limits.velocity_mm_per_s * move.duration_s;
    ASSERT_NEAR(end.way_mm, c.ends.distance_mm, 1e-10 * scale) << i;
    ASSERT_NEAR(end.velocity_mm_per_s, c.ends.end_mm_per_s, 1e-10 * c.limits.velocity_mm_per_s) << i;
    ASSERT_NEAR(end.acceleration_mm_per_s2, 0.0,
                1e-10 * c.limits.acceleration_mm_per_s2 + 1e-14 * c.limits.jerk_mm_per_s3 * move.duration_s)
        << i;
    double t = 0.0;
    for (std::size_t k = 0; k < move.stretch_s.size(); ++k) {
      ASSERT_GE(move.stretch_s[k], 0.0);
      t += move.stretch_s[k];
      const MovePoint p = move.At(t);
      ASSERT_LE(std::abs(p.velocity_mm_per_s), c.limits.velocity_mm_per_s * (1 + 1e-9));
      ASSERT_LE(std::abs(p.acceleration_mm_per_s2), c.limits.acceleration_mm_per_s2 * (1 + 1e-9));
    }
    // The same move backwards in time, and mirrored, takes as long.
    const MoveEnds back{c.ends.distance_mm, c.ends.end_mm_per_s, c.ends.start_mm_per_s};
    ASSERT_NEAR(SolveMove(back, c.limits).duration_s, move.duration_s, 1e-9 * move.duration_s);
  }
}

double ChangeTime(double change, double acceleration, double jerk) {
  const double x = std::abs(change);
  return x > acceleration * acceleration / jerk ? x / acceleration + acceleration / jerk
                                                : 2 * std::sqrt(x / jerk);
}

// Every peak velocity within the limit at which a move with these accelerations and this cruise ends where it should;
// found by looking at each, so nothing is assumed about which is best or how many there are.
double QuickestWithCruise(const Case& c, double rise, double fall, double cruise) {
  const double j = c.limits.jerk_mm_per_s3, v = c.ends.start_mm_per_s, u = c.ends.end_mm_per_s;
  const double top = c.limits.velocity_mm_per_s;
  const auto time = [&](double p) {
    return ChangeTime(p - v, rise, j) + ChangeTime(u - p, fall, j) + cruise;
  };
  const auto error = [&](double p) {
    return 0.5 * (v + p) * ChangeTime(p - v, rise, j) + 0.5 * (p + u) * ChangeTime(u - p, fall, j) +
           p * cruise - c.ends.distance_mm;
  };
  std::vector<double> looks = {-top, top};
  for (int i = 1; i < 600; ++i) {
    looks.push_back(top * (2.0 * i / 600 - 1.0));
  }
  for (const double near : {v, u}) {  // a short move hardly leaves its velocities
    for (double step = top; step > 1e-15 * top; step *= 0.6) {
      looks.insert(looks.end(), {std::max(-top, near - step), std::min(top, near + step)});
    }
  }
  std::sort(looks.begin(), looks.end());
  double best = INFINITY, before = error(-top);
  for (std::size_t i = 1; i < looks.size(); ++i) {
    double low = looks[i - 1], high = looks[i];
    const double here = error(high);
    if ((before <= 0.0) != (here <= 0.0)) {
      for (int k = 0; k < 60; ++k) {
        const double middle = 0.5 * (low + high);
        ((error(middle) <= 0.0) == (before <= 0.0) ? low : high) = middle;
      }
      best = std::min(best, time(low));
    }
    before = here;
  }
  return best;
}

double SearchedTime(const Case& c) {
  const double a = c.limits.acceleration_mm_per_s2;
  double best = INFINITY;
  for (const double rise : {1.0, 0.7, 0.3}) {
    for (const double fall : {1.0, 0.7, 0.3}) {
      best = std::min(best, QuickestWithCruise(c, rise * a, fall * a, 0.0));
    }
  }
  double low = 0.0, high = 4.0 * std::abs(c.ends.distance_mm) / c.limits.velocity_mm_per_s;
  for (int round = 0; round < 22; ++round) {
    constexpr int kGrid = 8;
    double at = high, least = INFINITY;
    for (int i = 0; i <= kGrid; ++i) {
      const double cruise = low + (high - low) * i / kGrid;
      const double time = QuickestWithCruise(c, a, a, cruise);
      if (time < least) {
        least = time;
        at = cruise;
      }
    }
    best = std::min(best, least);
    const double step = (high - low) / kGrid;
    low = std::max(0.0, at - step);
    high = at + step;
  }
  return best;
}

TEST(JerkLimitedMove, IsAsQuickAsTheSearchedOptimum) {
  std::mt19937_64 random(2);
  double worst = 0.0;
  for (int i = 0; i < 200; ++i) {
    const Case c = RandomCase(random, i % 2 == 0);
    SCOPED_TRACE(i);
    const double ours = SolveMove(c.ends, c.limits).duration_s;
    const double searched = SearchedTime(c);
    EXPECT_LE(ours, searched * (1 + 1e-6));
    EXPECT_GE(ours, searched * (1 - 1e-6)) << "quicker than the search: limits or search are wrong";
    worst = std::max(worst, std::abs(ours / searched - 1.0));
  }
  tests::PrintFigure("move.off_optimum", worst);
}

TEST(JerkLimitedMove, KnownMoves) {
  // Jerk alone: T = 4 cbrt(h/(2 j)); with plateau: T = sqrt((a/j)^2 + 4 h/a) + a/j; with cruise: T = h/v + v/a + a/j.
  EXPECT_NEAR(SolveMove({.distance_mm = 2}, {1e9, 1e9, 1}).duration_s, 4.0, 1e-12);
  EXPECT_NEAR(SolveMove({.distance_mm = 6}, {1e9, 1, 1}).duration_s, 6.0, 1e-12);
  EXPECT_NEAR(SolveMove({.distance_mm = -10}, {2, 1, 1}).duration_s, 8.0, 1e-12);
  EXPECT_EQ(SolveMove({}, {2, 1, 1}).duration_s, 0.0);
  // At full speed against the way: turns, and comes back past its start.
  EXPECT_GT(SolveMove({.distance_mm = 1, .start_mm_per_s = -2, .end_mm_per_s = -2}, {2, 1, 1}).duration_s,
            8.0);
  EXPECT_EQ(SolveMove({.distance_mm = 0, .start_mm_per_s = -2, .end_mm_per_s = -2}, {2, 1, 1}).duration_s,
            0.0);
}

TEST(JerkLimitedMove, RefusesByName) {
  EXPECT_EQ(SolveMove({1, 3, 0}, {2, 1, 1}).verdict, MoveVerdict::kVelocityBeyondLimit);
  EXPECT_EQ(SolveMove({1, 0, 0}, {2, 0, 1}).verdict, MoveVerdict::kLimitNotPositive);
  EXPECT_EQ(SolveMove({std::nan(""), 0, 0}, {2, 1, 1}).verdict, MoveVerdict::kNotFinite);
}

// Both actuators keep their limits on the line, one uses one of its limits to the full.
TEST(JerkLimitedMove, PairSharesTheLine) {
  std::mt19937_64 random(3);
  for (int i = 0; i < 10000; ++i) {
    const Case a = RandomCase(random, true), b = RandomCase(random, true);
    const JerkLimitedMove move =
        SolvePairMove({a.ends.distance_mm, b.ends.distance_mm}, {a.limits, b.limits});
    const double alone =
        std::max(SolveMove(a.ends, a.limits).duration_s, SolveMove(b.ends, b.limits).duration_s);
    ASSERT_GE(move.duration_s, alone * (1 - 1e-12));
    ASSERT_NEAR(move.At(move.duration_s).way_mm, 1.0, 1e-10);
    for (const Case* c : {&a, &b}) {
      ASSERT_LE(std::abs(move.peak_mm_per_s * c->ends.distance_mm),
                c->limits.velocity_mm_per_s * (1 + 1e-12));
      ASSERT_LE(std::abs(move.jerk_mm_per_s3[0] * c->ends.distance_mm),
                c->limits.jerk_mm_per_s3 * (1 + 1e-12));
    }
  }
}

}  // namespace
}  // namespace lambdajet::trajectory
