// What the judge finds on synthetic cuts whose deviation is known.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>

#include "inspection/core/comparison.hpp"

namespace lambdajet::inspection {
namespace {

constexpr double kTurn = 2.0 * std::numbers::pi;
constexpr double kKerf = 1.0;

Drawing CircleDrawing(double radius, Side side) {
  return {"circle", kKerf, {{"round", FeatureKind::kHole, side, 0.1, {Arc{{100, 80}, radius, 0.0, kTurn}}}}};
}

Drawing SquareDrawing(double low, double high) {
  const Eigen::Vector2d a(low, low), b(high, low), c(high, high), d(low, high);
  return {"square",
          kKerf,
          {{"plate",
            FeatureKind::kContour,
            Side::kOutside,
            0.1,
            {Line{a, b}, Line{b, c}, Line{c, d}, Line{d, a}}}}};
}

// A sheet that moves so that the jet, standing at a known place with the sheet turned, follows the path
// p_W(t).
Truth TruthOf(const std::function<Eigen::Vector2d(double)>& path, double duration_s,
              double lag_time_s = 0.0) {
  Truth truth;
  truth.lag_time_s = lag_time_s;
  const double theta = 0.3;
  const Eigen::Vector2d jet(900.0, 850.0);
  const auto count = static_cast<int>(std::lround(1000.0 * duration_s));
  for (int i = 0; i <= count; ++i) {
    const std::int64_t stamp = 1'000'000'000'000 + std::int64_t{1'000'000} * i;
    const Eigen::Vector2d p = path(1e-3 * i);
    const double c = std::cos(theta);
    const double s = std::sin(theta);
    truth.sheet.push_back(
        {stamp, jet.x() - (c * p.x() - s * p.y()), jet.y() - (s * p.x() + c * p.y()), theta});
    truth.jet.push_back({stamp, jet.x(), jet.y()});
  }
  truth.switches = {{truth.sheet.front().time_ns, true}, {truth.sheet.back().time_ns, false}};
  return truth;
}

// Round the circle a little more than once, at 50 mm/s.
Truth CircleTruth(const Eigen::Vector2d& center, double radius, double lag_time_s = 0.0) {
  const double omega = 50.0 / radius;
  return TruthOf(
      [=](double t) {
        return Eigen::Vector2d(center + radius * Eigen::Vector2d(std::cos(omega * t), std::sin(omega * t)));
      },
      1.1 * kTurn / omega, lag_time_s);
}

// Once round a square's centre line and a little over, at 50 mm/s, starting in the middle of its first side.
std::function<Eigen::Vector2d(double)> SquarePath(double low, double high, double* duration_s) {
  const double side = high - low;
  *duration_s = (4.2 * side) / 50.0;
  return [=](double t) {
    const double s = std::fmod(50.0 * t + 0.5 * side, 4.0 * side);
    const int edge = static_cast<int>(s / side);
    const double r = s - edge * side;
    switch (edge) {
      case 0:
        return Eigen::Vector2d(low + r, low);
      case 1:
        return Eigen::Vector2d(high, low + r);
      case 2:
        return Eigen::Vector2d(high - r, high);
      default:
        return Eigen::Vector2d(low, high - r);
    }
  };
}

FeatureResult Judge(const Truth& truth, const Drawing& drawing) {
  EXPECT_TRUE(ValidateDrawing(drawing).empty());
  return CompareWithDrawing(JoinTruth(truth), drawing).all;
}

TEST(Inspection, PerfectCutHasNoDeviation) {
  const auto hole = Judge(CircleTruth({100, 80}, 30.0 - 0.5 * kKerf), CircleDrawing(30.0, Side::kInside));
  EXPECT_LT(hole.max_mm, 2e-5);
  EXPECT_EQ(hole.not_cut, 0u);
  EXPECT_TRUE(hole.passed);
  double duration = 0.0;
  const auto path = SquarePath(20.0 - 0.5, 120.0 + 0.5, &duration);
  const auto plate = Judge(TruthOf(path, duration), SquareDrawing(20, 120));
  EXPECT_LT(plate.max_mm, 0.03);  // the corner falls between two stamps
  EXPECT_LT(plate.p95_mm, 1e-6);
  EXPECT_EQ(plate.not_cut, 0u);
}

TEST(Inspection, CircleCutTooLargeOrSmallIsSigned) {
  // A hole cut 0.2 mm larger has lost material; a disc cut 0.2 mm larger has too much.
  const auto hole = Judge(CircleTruth({100, 80}, 30.2 - 0.5), CircleDrawing(30.0, Side::kInside));
  EXPECT_NEAR(hole.mean_mm, -0.2, 1e-4);
  EXPECT_NEAR(hole.p95_mm, 0.2, 1e-4);
  EXPECT_FALSE(hole.passed);
  const auto disc = Judge(CircleTruth({100, 80}, 30.2 + 0.5), CircleDrawing(30.0, Side::kOutside));
  EXPECT_NEAR(disc.mean_mm, 0.2, 1e-4);
}

TEST(Inspection, OffsetCircleDeviatesByTheCosine) {
  const double shift = 0.3;
  const Drawing drawing = CircleDrawing(30.0, Side::kInside);
  const auto result = CompareWithDrawing(JoinTruth(CircleTruth({100 + shift, 80}, 29.5)), drawing);
  for (const Deviation& d : result.deviations) {
    const double cosine = (d.p_W_mm - Eigen::Vector2d(100, 80)).normalized().x();
    EXPECT_NEAR(d.deviation_mm, -shift * cosine, 2e-3);
  }
  EXPECT_NEAR(result.all.p95_mm, shift * std::cos(0.05 * std::numbers::pi / 2.0), 1e-3);
  ASSERT_TRUE(result.features[0].circle.fitted);
  EXPECT_NEAR(result.features[0].circle.position_error_mm, shift, 1e-3);
  EXPECT_NEAR(result.features[0].circle.diameter_error_mm, 0.0, 3e-3);
}

TEST(Inspection, ShiftedSquareDeviatesOnTwoSidesOnly) {
  double duration = 0.0;
  const auto path = SquarePath(19.5, 120.5, &duration);
  const auto result =
      Judge(TruthOf([&](double t) { return Eigen::Vector2d(path(t) + Eigen::Vector2d(0.4, 0.0)); }, duration),
            SquareDrawing(20, 120));
  EXPECT_NEAR(result.p95_mm, 0.4, 1e-6);
  EXPECT_LT(result.max_mm, 0.45);
  EXPECT_LT(result.p50_mm, 0.4);
  EXPECT_NEAR(result.mean_mm, 0.0, 3e-3);
  EXPECT_EQ(result.not_cut, 0u);
}

TEST(Inspection, RotatedSquareDeviatesLinearly) {
  double duration = 0.0;
  const auto path = SquarePath(19.5, 120.5, &duration);
  const double phi = 0.004;
  const Eigen::Vector2d center(70, 70);
  const Eigen::Rotation2Dd turn(phi);
  const auto result =
      Judge(TruthOf([&](double t) { return Eigen::Vector2d(center + turn * (path(t) - center)); }, duration),
            SquareDrawing(20, 120));
  EXPECT_NEAR(result.p50_mm, 25.0 * phi, 2e-3);
  EXPECT_NEAR(result.p95_mm, 47.5 * phi, 3e-3);
}

TEST(Inspection, LagOnAnArcIsTheAnalyticInset) {
  const double radius = 20.0;
  const double lag = 0.02;
  const double ratio = 50.0 * lag / radius;
  const double inset = radius - radius / std::sqrt(1.0 + ratio * ratio);
  const auto result = Judge(CircleTruth({100, 80}, radius, lag), CircleDrawing(radius + 0.5, Side::kInside));
  EXPECT_NEAR(result.p50_mm, inset, 1e-4);
  EXPECT_GT(result.mean_mm, 0.0);  // a hole comes out too small
}

TEST(Inspection, DeviationIsInvariantUnderMotionOfEverything) {
  const Eigen::Vector2d shift(300.0, -50.0);
  const double phi = 1.1;
  const Eigen::Rotation2Dd turn(phi);
  double duration = 0.0;
  const auto path = SquarePath(19.6, 120.3, &duration);
  Drawing moved = SquareDrawing(20, 120);
  for (OutlineElement& element : moved.features[0].outline) {
    Line& line = std::get<Line>(element);
    line = {shift + turn * line.from_W_mm, shift + turn * line.to_W_mm};
  }
  const auto before = Judge(TruthOf(path, duration), SquareDrawing(20, 120));
  const auto after =
      Judge(TruthOf([&](double t) { return Eigen::Vector2d(shift + turn * path(t)); }, duration), moved);
  EXPECT_NEAR(before.p95_mm, after.p95_mm, 1e-9);
  EXPECT_NEAR(before.mean_mm, after.mean_mm, 1e-9);
  EXPECT_NEAR(before.rms_mm, after.rms_mm, 1e-9);
}

TEST(Inspection, DirectionAndStartOfTheOutlineDoNotMatter) {
  double duration = 0.0;
  const auto path = SquarePath(19.6, 120.3, &duration);
  Drawing reversed = SquareDrawing(20, 120);
  auto& outline = reversed.features[0].outline;
  std::reverse(outline.begin(), outline.end());
  for (OutlineElement& element : outline) {
    std::swap(std::get<Line>(element).from_W_mm, std::get<Line>(element).to_W_mm);
  }
  const auto a = Judge(TruthOf(path, duration), SquareDrawing(20, 120));
  const auto b = Judge(TruthOf(path, duration), reversed);
  EXPECT_NEAR(a.mean_mm, b.mean_mm, 1e-9);
  EXPECT_NEAR(a.p95_mm, b.p95_mm, 1e-9);
}

TEST(Inspection, WaterOffLeavesPointsNotCut) {
  Truth truth = CircleTruth({100, 80}, 29.5);
  const std::int64_t start = truth.sheet.front().time_ns;
  truth.switches = {{start, true},
                    {start + 1'000'000'000, false},
                    {start + 1'100'000'000, true},
                    {truth.sheet.back().time_ns, false}};
  const auto result = Judge(truth, CircleDrawing(30.0, Side::kInside));
  EXPECT_NEAR(result.not_cut, 5.0 * 30.0 / 29.5 / kPointSpacingMm, 2.0);  // 0.1 s at 50 mm/s
  EXPECT_FALSE(result.passed);
  EXPECT_LT(result.max_mm, 2e-5);  // the rest is judged as it is
  EXPECT_LT(result.conforming, 1.0);
}

TEST(Inspection, NothingCutIsNotAPass) {
  Truth truth = CircleTruth({100, 80}, 29.5);
  truth.switches.clear();
  const auto result = Judge(truth, CircleDrawing(30.0, Side::kInside));
  EXPECT_EQ(result.not_cut, result.points);
  EXPECT_FALSE(result.passed);
  EXPECT_EQ(Judge({}, CircleDrawing(30.0, Side::kInside)).passed, false);
}

TEST(Inspection, LeadsCrossingElsewhereDoNotMatter) {
  // In from the hole's centre on a tangential arc, round, and out again.
  const double omega = 50.0 / 29.3;
  const auto round = [=](double t) {
    return Eigen::Vector2d(Eigen::Vector2d(100, 80) +
                           29.3 * Eigen::Vector2d(std::cos(omega * t), std::sin(omega * t)));
  };
  const double whole = kTurn / omega;
  const auto path = [=](double t) {
    const double lead = 10.0;  // radius of the lead arcs
    const Eigen::Vector2d center(100 + 29.3 - lead, 80);
    const auto on_lead = [&](double angle) {
      return Eigen::Vector2d(center + lead * Eigen::Vector2d(std::cos(angle), std::sin(angle)));
    };
    const double quarter = std::numbers::pi / 2.0 * lead / 50.0;
    if (t < quarter) {
      return on_lead(50.0 / lead * (t - quarter));
    }
    return t < quarter + whole ? round(t - quarter) : on_lead(50.0 / lead * (t - quarter - whole));
  };
  const auto result = Judge(TruthOf(path, whole + 0.6), CircleDrawing(30.0, Side::kInside));
  EXPECT_NEAR(result.mean_mm, 0.2, 1e-3);
  EXPECT_NEAR(result.max_mm, 0.2, 1e-3);
}

// At 1-2 mm/s a millisecond is a micrometre: what single samples do says nothing about where the cut goes.
TEST(Inspection, ASlowCutThatSwingsAndIsMeasuredWithNoiseIsCutEverywhere) {
  std::mt19937 random(7);
  const auto between = [&](double low, double high) {
    return std::uniform_real_distribution(low, high)(random);
  };
  for (int i = 0; i < 12; ++i) {
    const double speed = between(0.8, 2.0);  // mm/s
    const double swing = between(0.01, 0.08);
    const double frequency = between(3.0, 9.0);
    const double noise = between(0.0, 0.003);
    const double phase = between(0.0, kTurn);
    const double radius = between(3.0, 6.0);
    std::normal_distribution<double> gauss(0.0, noise);
    const auto path = [&](double t) {
      const double angle = speed * t / radius;
      const Eigen::Vector2d swung(std::cos(kTurn * frequency * t), std::sin(kTurn * frequency * t + phase));
      return Eigen::Vector2d(Eigen::Vector2d(100, 80) +
                             radius * Eigen::Vector2d(std::cos(angle), std::sin(angle)) + swing * swung +
                             Eigen::Vector2d(gauss(random), gauss(random)));
    };
    const auto result =
        Judge(TruthOf(path, 1.05 * kTurn * radius / speed), CircleDrawing(radius + 0.5, Side::kInside));
    EXPECT_EQ(result.not_cut, 0u) << speed << " mm/s, swing " << swing << " mm at " << frequency << " Hz";
    EXPECT_LE(result.max_mm, 1.5 * swing + 5.0 * noise + 1e-3);
  }
}

// A weak drive rings: 0.65 mm either way, a wave every 2.5 mm, so that over half a millimetre the cut leans by 51 degrees.
TEST(Inspection, ACutThatSwingsWidelyIsCutEverywhere) {
  const double radius = 30.0 - 0.5 * kKerf, omega = 50.0 / radius;
  const Truth truth = TruthOf(
      [=](double t) {
        const double swing = 0.65 * std::sin(kTurn * radius * omega * t / 2.5);
        const double r = radius + swing;
        return Eigen::Vector2d(100.0 + r * std::cos(omega * t), 80.0 + r * std::sin(omega * t));
      },
      1.1 * kTurn / omega);
  const FeatureResult hole = Judge(truth, CircleDrawing(30.0, Side::kInside));
  EXPECT_EQ(hole.not_cut, 0u);
  EXPECT_NEAR(hole.max_mm, 0.65, 0.02);
}

TEST(JoinTruth, DoesNotDependOnBatchesOrOrder) {
  const Truth truth = CircleTruth({100, 80}, 29.7, 0.01);
  const CutPath once = JoinTruth(truth);
  Truth shuffled = truth;
  std::mt19937 random(4);
  std::shuffle(shuffled.sheet.begin(), shuffled.sheet.end(), random);
  std::shuffle(shuffled.jet.begin(), shuffled.jet.end(), random);
  shuffled.sheet.insert(shuffled.sheet.end(), truth.sheet.begin() + 10,
                        truth.sheet.begin() + 40);  // sent twice
  const CutPath again = JoinTruth(shuffled);
  ASSERT_EQ(once.cuts.size(), again.cuts.size());
  ASSERT_EQ(once.cuts[0].size(), again.cuts[0].size());
  for (std::size_t i = 0; i < once.cuts[0].size(); ++i) {
    EXPECT_EQ(once.cuts[0][i].p_W_mm, again.cuts[0][i].p_W_mm);
  }
  EXPECT_EQ(again.missing, 0u);
}

TEST(JoinTruth, CountsWhatIsMissingWhileTheWaterIsOn) {
  Truth truth = CircleTruth({100, 80}, 29.7);
  truth.sheet.erase(truth.sheet.begin() + 100, truth.sheet.begin() + 130);
  truth.jet.erase(truth.jet.begin() + 500, truth.jet.begin() + 510);
  EXPECT_EQ(JoinTruth(truth).missing, 40u);
  truth.switches.clear();
  const CutPath idle = JoinTruth(truth);
  EXPECT_EQ(idle.missing, 0u);
  EXPECT_EQ(idle.missing_idle, 40u);
  EXPECT_TRUE(idle.cuts.empty());
}

TEST(JoinTruth, CutsExactlyBetweenTheSwitches) {
  Truth truth = TruthOf([](double t) { return Eigen::Vector2d(50.0 * t, 10.0); }, 2.0);
  const std::int64_t start = truth.sheet.front().time_ns;
  truth.switches = {{start + 500'300'000, true}, {start + 1'500'700'000, false}};
  const CutPath path = JoinTruth(truth);
  ASSERT_EQ(path.cuts.size(), 1u);
  EXPECT_NEAR(path.cuts[0].front().p_W_mm.x(), 25.015, 1e-9);
  EXPECT_NEAR(path.cuts[0].back().p_W_mm.x(), 75.035, 1e-9);
  EXPECT_NEAR(path.cuts[0].back().p_W_mm.y(), 10.0, 1e-9);
  EXPECT_NEAR(path.cutting_time_s, 1.0004, 1e-9);
}

TEST(Drawing, RefusesOpenAndSenselessOutlines) {
  Drawing open = SquareDrawing(0, 10);
  open.features[0].outline.pop_back();
  ASSERT_FALSE(ValidateDrawing(open).empty());
  EXPECT_EQ(ValidateDrawing(open)[0].reason, "OPEN_OUTLINE");
  Drawing bad = CircleDrawing(NAN, Side::kInside);
  EXPECT_EQ(ValidateDrawing(bad)[0].reason, "BAD_ELEMENT");
  bad = CircleDrawing(5, Side::kInside);
  bad.kerf_width_mm = 0.0;
  EXPECT_EQ(ValidateDrawing(bad)[0].reason, "BAD_KERF");
  EXPECT_EQ(ValidateDrawing({"", 1.0, {}})[0].reason, "NO_FEATURES");
}

}  // namespace
}  // namespace lambdajet::inspection
