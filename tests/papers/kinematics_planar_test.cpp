// The numbers of seed paper 000 (lambda mechanism and biglide), as corrected: every printed digit.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <vector>

#include "kinematics/core/lambda_mechanism.hpp"

namespace lambdajet::kinematics {
namespace {

constexpr double kMainMm = 1200.0;
constexpr double kAttachMm = 600.0;
const Eigen::Vector2d kToolMm(500.0, 700.0);

LambdaMechanism Lambda(double second_mm, WorkingMode mode = {1, 1}) {
  return LambdaMechanism::FromParameters(IdealLambda(kMainMm, kAttachMm, second_mm), mode, 1);
}

LambdaMechanism Biglide(double first_mm, double second_mm) {
  return LambdaMechanism::FromParameters(IdealLambda(first_mm, first_mm, second_mm));
}

struct Row {
  double second_mm;
  int s1, s2;
  double q1, q2, determinant, q1_y, q2_y;
};

// Tolerances: half a unit of the last printed digit, and one more for its rounding.
constexpr double kDigits10 = 1e-10;
constexpr double kDigits12 = 1e-12;

class ReferencePose : public testing::TestWithParam<Row> {};

TEST_P(ReferencePose, MatchesEveryPrintedDigit) {
  const Row& row = GetParam();
  const LambdaMechanism m = Lambda(row.second_mm, {row.s1, row.s2});
  const InverseAnswer answer = SolveInverse(m, kToolMm);
  ASSERT_TRUE(answer.positioned);
  EXPECT_NEAR(answer.actuator_position_mm.x(), row.q1, kDigits10);
  EXPECT_NEAR(answer.actuator_position_mm.y(), row.q2, kDigits10);
  const LambdaJacobians jacobians = ComputeJacobians(m, kToolMm);
  EXPECT_NEAR(jacobians.determinant, row.determinant, kDigits12);
  EXPECT_NEAR(jacobians.J_q_x(0, 0), 1.0, 1e-15);
  EXPECT_NEAR(jacobians.J_q_x(1, 0), 1.0, 1e-15);
  EXPECT_NEAR(jacobians.J_q_x(0, 1), row.q1_y, kDigits10);
  EXPECT_NEAR(jacobians.J_q_x(1, 1), row.q2_y, kDigits10);
  const ForwardAnswer back = SolveForward(m, answer.actuator_position_mm);
  if (row.determinant == 0.0) {
    EXPECT_EQ(answer.reason, Reason::kIndeterminate);
    EXPECT_EQ(back.reason, Reason::kIndeterminate);
    EXPECT_FALSE(jacobians.invertible);
    return;
  }
  EXPECT_EQ(answer.reason, Reason::kSolved);
  EXPECT_EQ(back.reason, Reason::kSolved);
  EXPECT_EQ(back.working_mode, (WorkingMode{row.s1, row.s2}));
  EXPECT_NEAR(back.p_DE_mm.x(), 500.0, 1e-9);
  EXPECT_NEAR(back.p_DE_mm.y(), 700.0, 1e-9);
}

INSTANTIATE_TEST_SUITE_P(
    Paper000, ReferencePose,
    testing::Values(
        Row{700, 1, 1, -474.6794344809, 618.8780654087, -0.647767557825, 0.7181848465, 0.0704172886},
        Row{700, 1, -1, -474.6794344809, -593.5574998896, -0.070417288635, 0.7181848465, 0.6477675578},
        Row{700, -1, 1, 1474.6794344809, 1593.5574998896, 0.070417288635, -0.7181848465, -0.6477675578},
        Row{700, -1, -1, 1474.6794344809, 381.1219345913, 0.647767557825, -0.7181848465, -0.0704172886},
        Row{500, 1, 1, -474.6794344809, 369.7317041867, -0.849190452640, 0.7181848465, -0.1310056062},
        Row{500, 1, -1, -474.6794344809, -344.4111386676, 0.131005606180, 0.7181848465, 0.8491904526},
        Row{500, -1, 1, 1474.6794344809, 1344.4111386676, -0.131005606180, -0.7181848465, -0.8491904526},
        Row{500, -1, -1, 1474.6794344809, 630.2682958133, 0.849190452640, -0.7181848465, 0.1310056062},
        Row{600, 1, 1, -474.6794344809, 500.0, -0.718184846460, 0.7181848465, 0.0},
        Row{600, 1, -1, -474.6794344809, -474.6794344809, 0.0, 0.7181848465, 0.7181848465},
        Row{600, -1, 1, 1474.6794344809, 1474.6794344809, 0.0, -0.7181848465, -0.7181848465},
        Row{600, -1, -1, 1474.6794344809, 500.0, 0.718184846460, -0.7181848465, 0.0}));

TEST(PaperLambda, AcceleratesAsTheSecondDerivativeSays) {
  const MotionAnswer answer = SolveInverseMotion(Lambda(700), {kToolMm, {0.0, 300.0}, {1000.0, -500.0}});
  ASSERT_TRUE(answer.differentiable);
  EXPECT_NEAR(answer.motion.acceleration_mm_per_s2.x(), 780.872623539, 1e-9);
  EXPECT_NEAR(answer.motion.acceleration_mm_per_s2.y(), 985.286713136, 1e-9);
  const MotionAnswer unit = SolveInverseMotion(Lambda(700), {kToolMm, {0.0, 1.0}, {0.0, 0.0}});
  EXPECT_NEAR(unit.motion.acceleration_mm_per_s2.x(), 0.001555167186, kDigits12);
  EXPECT_NEAR(unit.motion.acceleration_mm_per_s2.y(), 0.000227726194, kDigits12);
}

TEST(PaperLambda, PrintedFormula59IgnoresTheSecondLink) {
  // (58), (59) as printed: q2 = q1 + L3 sqrt(L1^2 - y^2)/L1 + L3 y/L1; no second link in it, hence one value
  // for all.
  const double c = std::sqrt(kMainMm * kMainMm - 700.0 * 700.0);
  const double printed = 500.0 - c + kAttachMm * c / kMainMm + kAttachMm * 700.0 / kMainMm;
  EXPECT_NEAR(printed, 362.6602827596, kDigits10);
  for (const double second : {500.0, 600.0, 700.0}) {
    EXPECT_GT(std::abs(SolveInverse(Lambda(second), kToolMm).actuator_position_mm.y() - printed), 5.0);
  }
  // It holds only where L2^2 = 2 l^2 y^2.
  const double y = kMainMm * 700.0 / (std::sqrt(2.0) * kAttachMm);
  const InverseAnswer there = SolveInverse(Lambda(700), {0.0, y});
  const double c_there = std::sqrt(kMainMm * kMainMm - y * y);
  EXPECT_NEAR(there.actuator_position_mm.y(), -c_there + 0.5 * c_there + 0.5 * y, 1e-9);
}

struct DeterminantRow {
  double y, lambda_700, lambda_500, lambda_600, printed, biglide, condition_700, condition_biglide;
};
constexpr double kBeyond = 1e9;  // no pose there
const std::array<DeterminantRow, 10> kDeterminants = {{
    {10, -0.0077383310, -0.0091670614, -0.0083336227, 0.4958331886, -0.0166672454, 258.45881429,
     119.99583326},
    {100, -0.0776178442, -0.0920639913, -0.0836242010, 0.4581878995, -0.1672484020, 25.81909979, 11.95826074},
    {200, -0.1566842091, -0.1865774981, -0.1690308509, 0.4154845745, -0.3380617019, 12.87015232, 5.91607978},
    {400, -0.3258478938, -0.3949945855, -0.3535533906, 0.3232233047, -0.7071067812, 6.36673707, 2.82842712},
    {600, -0.5258459591, -0.6636751346, -0.5773502692, 0.2113248654, -1.1547005384, 4.20449854, 1.73205081},
    {800, -0.7953689074, -1.1138802622, -0.8944271910, 0.0527864045, -1.7888543820, 3.22238716, 1.11803399},
    {900, -0.9865738732, -1.5993175119, -1.1338934190, -0.0669467095, -2.2677868381, 3.02146183, 1.13389342},
    {990, -1.2299680491, -4.2388789909, -1.4598340522, -0.2299170261, -2.9196681043, 3.07664777, 1.45983405},
    {1100, -1.7819145734, kBeyond, -2.2936585546, -0.6468292773, -4.5873171093, 3.96982361, 2.29365855},
    {1190, -4.6555193491, kBeyond, -7.6974701055, -3.3487350528, -15.3949402110, 15.07796274, 7.69747011},
}};

TEST(PaperLambda, DeterminantOverHeightMatchesTheTable) {
  for (const DeterminantRow& row : kDeterminants) {
    const Eigen::Vector2d p(123.0, row.y);
    EXPECT_NEAR(ComputeJacobians(Lambda(700), p).determinant, row.lambda_700, kDigits10) << row.y;
    EXPECT_NEAR(ComputeJacobians(Lambda(600), p).determinant, row.lambda_600, kDigits10) << row.y;
    EXPECT_NEAR(ComputeJacobians(Biglide(1200, 1200), p).determinant, row.biglide, kDigits10) << row.y;
    EXPECT_NEAR(ComputeJacobians(Lambda(700), p).condition, row.condition_700, 1e-8) << row.y;
    EXPECT_NEAR(ComputeJacobians(Biglide(1200, 1200), p).condition, row.condition_biglide, 1e-8) << row.y;
    // The paper's |J| = (L3/L1)(1 - y/sqrt(L1^2 - y^2)), with its false zero at L1/sqrt 2.
    EXPECT_NEAR(0.5 * (1.0 - row.y / std::sqrt(kMainMm * kMainMm - row.y * row.y)), row.printed, kDigits10);
    if (row.lambda_500 == kBeyond) {
      EXPECT_EQ(SolveInverse(Lambda(500), p).reason, Reason::kOutOfReach);
    } else {
      EXPECT_NEAR(ComputeJacobians(Lambda(500), p).determinant, row.lambda_500, kDigits10) << row.y;
    }
  }
  EXPECT_NEAR(kMainMm / std::sqrt(2.0), 848.52813742, 1e-8);
  EXPECT_LT(ComputeJacobians(Lambda(700), {0.0, 848.52813742}).determinant, -0.8);  // nothing singular there
}

TEST(PaperLambda, Type1LociStandWhereALinkIsSquareToTheRail) {
  const InverseAnswer long_second = SolveInverse(Lambda(700), {0.0, 1200.0});
  EXPECT_EQ(long_second.reason, Reason::kSingular);
  EXPECT_NEAR(std::abs(long_second.actuator_position_mm.y() - long_second.actuator_position_mm.x()),
              360.55512755, 1e-8);
  const InverseAnswer short_second = SolveInverse(Lambda(500), {0.0, 1000.0});
  EXPECT_EQ(short_second.reason, Reason::kSingular);
  EXPECT_NEAR(std::abs(short_second.actuator_position_mm.y() - short_second.actuator_position_mm.x()),
              331.66247904, 1e-8);
}

TEST(PaperBiglide, ReferencePosesMatch) {
  const InverseAnswer equal = SolveInverse(Biglide(1200, 1200), kToolMm);
  EXPECT_NEAR(equal.actuator_position_mm.x(), -474.6794344809, kDigits10);
  EXPECT_NEAR(equal.actuator_position_mm.y(), 1474.6794344809, kDigits10);
  EXPECT_NEAR(ComputeJacobians(Biglide(1200, 1200), kToolMm).determinant, -1.4363696929, kDigits10);
  EXPECT_NEAR(SolveInverse(Biglide(1200, 1000), kToolMm).actuator_position_mm.y(), 1214.1428428543,
              kDigits10);
  EXPECT_NEAR(ComputeJacobians(Biglide(1200, 1000), kToolMm).determinant, -1.6983809053, kDigits10);
}

TEST(PaperBiglide, OnTwoRailsIsSingularInTheMiddleOnlyWithSlidersOnOppositeSides) {
  const std::array<double, 3> heights = {600.0, 750.0, 900.0};
  const std::array<double, 3> same = {-1.7112436882, -1.6012815381, -1.7112436882};
  const std::array<double, 3> opposite = {0.5565431498, 0.0, -0.5565431498};
  const auto same_side = LambdaMechanism::FromParameters(TwoRailBiglide(1200, 1200, 1500), {1, -1});
  const auto opposite_sides = LambdaMechanism::FromParameters(TwoRailBiglide(1200, 1200, 1500), {1, 1});
  for (std::size_t i = 0; i < heights.size(); ++i) {
    EXPECT_NEAR(ComputeJacobians(same_side, {0.0, heights[i]}).determinant, same[i], kDigits10);
    EXPECT_NEAR(ComputeJacobians(opposite_sides, {0.0, heights[i]}).determinant, opposite[i], kDigits10);
  }
  EXPECT_EQ(SolveInverse(opposite_sides, {0.0, 750.0}).reason, Reason::kSingular);
  EXPECT_NEAR(std::abs(ReportSingularity(opposite_sides, {0.0, 600.0}).parallel_distance_mm), 150.0, 1e-6);
}

}  // namespace
}  // namespace lambdajet::kinematics
