// Seed paper 000: the error budget, the jet stack and the elastic error, with the numbers as checked and
// corrected.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "accuracy/core/budget.hpp"
#include "accuracy/core/elastic.hpp"
#include "accuracy/core/jet_stack.hpp"
#include "kinematics/core/lambda_mechanism.hpp"

namespace lambdajet::accuracy {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

SetUpShares PaperShares() { return {{0.2, 0.2, 0.2, 0.2}, 0.29e-3, 0.29e-3, 1200.0, 1200.0}; }

TEST(PaperBudget, AddsSkewsOverTheirLevers) { EXPECT_NEAR(SetUpError(PaperShares()), 0.6341987017, 1e-10); }

TEST(PaperBudget, PrintedFormIsTheOneWithoutLevers) {
  SetUpShares printed = PaperShares();
  printed.radius_a_mm = printed.radius_b_mm = 1.0;
  EXPECT_NEAR(SetUpError(printed), 0.4000002102, 1e-10);
}

TEST(PaperBudget, TotalsBeforeAndAfterIdentification) {
  const double base = SetUpError(PaperShares());
  EXPECT_NEAR(TotalError(base, 0.38, 0.18), 0.76092575, 1e-8);
  EXPECT_NEAR(TotalError(base, 0.45, 0.18), 0.79819045, 1e-8);
  EXPECT_NEAR(TotalError(0.0, 0.38, 0.18), 0.42047592, 1e-8);
  EXPECT_NEAR(TotalError(0.0, 0.45, 0.18), 0.48466483, 1e-8);
  EXPECT_NEAR(TotalError(0.0, 0.19, 0.18), 0.26172505, 1e-8);
  EXPECT_NEAR(TotalError(0.0, 0.225, 0.18), 0.28814059, 1e-8);
}

TEST(PaperBudget, IdentifiedTotalsNeedHalfTheElasticError) {
  EXPECT_NEAR(std::sqrt(0.75 * 0.75 - 0.38 * 0.38 - 0.18 * 0.18), 0.62104750, 1e-8);
  EXPECT_NEAR(TotalError(0.62104750, 0.38, 0.18), 0.75, 1e-8);
  EXPECT_NEAR(TotalError(0.66143783, 0.45, 0.18), 0.82, 1e-8);
  EXPECT_NEAR(TotalError(0.0, 0.17349352, 0.18), 0.25, 1e-8);
  EXPECT_NEAR(TotalError(0.0, 0.24, 0.18), 0.30, 1e-8);
}

TEST(PaperElastic, ForceOfThePrintedDeflections) {
  EXPECT_DOUBLE_EQ(StaticDeflectionMm(19.0, 50.0), 0.38);
  EXPECT_DOUBLE_EQ(StaticDeflectionMm(22.5, 50.0), 0.45);
  EXPECT_DOUBLE_EQ(InertiaForceN(38.0, 500.0), 19.0);
}

TEST(PaperElastic, NaturalFrequencies) {
  const struct {
    double mass_kg, frequency_hz;
  } rows[] = {{38, 5.773},   {45, 5.305},     {19, 8.164},   {22.5, 7.503},
              {9.5, 11.546}, {11.25, 10.610}, {3.8, 18.256}, {4.5, 16.776}};
  for (const auto& row : rows) {
    EXPECT_NEAR(NaturalFrequencyHz(1e-3 * row.mass_kg / 50.0), row.frequency_hz, 6e-4);
  }
}

TEST(PaperElastic, StepOfAccelerationDoublesTheDeflectionUndamped) {
  const double lag = 8e-4;
  for (const double z : {0.0, 0.05, 0.2, 0.7}) {
    SpringResponse spring(lag, 2.0 * z * std::sqrt(lag));
    double peak = 0.0;
    for (int i = 0; i < 4000; ++i) {
      spring.Advance(1e-4, {-lag * 500.0, 0.0});
      peak = std::max(peak, std::abs(spring.deflection().x()));
    }
    EXPECT_NEAR(peak / (lag * 500.0), StepPeakFactor(z), 1e-4) << z;
  }
}

TEST(PaperElastic, ComplianceFromStiffnessPerDrive) {
  const struct {
    double y, cxx, cxy, cyy, biglide_cxx, biglide_cyy;
  } rows[] = {{300, 0.0235154001, -0.0973705789, 0.7014982600, 0.01, 0.15},
              {500, 0.0239423030, -0.0561799896, 0.2263751707, 0.01, 0.0476},
              {700, 0.0248210001, -0.0375880294, 0.0953282465, 0.01, 0.0193877551},
              {900, 0.0268648867, -0.0263264379, 0.0410961153, 0.01, 0.0077777778},
              {1100, 0.0347865802, -0.0176706051, 0.0125975541, 0.01, 0.0019008264}};
  const auto lambda = kinematics::LambdaMechanism::FromParameters(kinematics::IdealLambda(1200, 600, 700));
  const auto biglide = kinematics::LambdaMechanism::FromParameters(kinematics::IdealLambda(1200, 1200, 1200));
  for (const auto& row : rows) {
    const Eigen::Matrix2d C = ToolCompliance(kinematics::ComputeJacobians(lambda, {500, row.y}).J_q_x, 50.0);
    EXPECT_NEAR(C(0, 0), row.cxx, 1e-10) << row.y;
    EXPECT_NEAR(C(0, 1), row.cxy, 1e-10) << row.y;
    EXPECT_NEAR(C(1, 1), row.cyy, 1e-10) << row.y;
    const Eigen::Matrix2d B = ToolCompliance(kinematics::ComputeJacobians(biglide, {500, row.y}).J_q_x, 50.0);
    EXPECT_NEAR(B(0, 0), row.biglide_cxx, 1e-10) << row.y;
    EXPECT_NEAR(B(1, 1), row.biglide_cyy, 1e-10) << row.y;
  }
}

TEST(PaperElastic, ForceThatGivesThePrintedRangeAlongX) {
  const auto lambda = kinematics::LambdaMechanism::FromParameters(kinematics::IdealLambda(1200, 600, 700));
  const Eigen::Matrix2d low = ToolCompliance(kinematics::ComputeJacobians(lambda, {500, 300}).J_q_x, 50.0);
  const Eigen::Matrix2d high =
      ToolCompliance(kinematics::ComputeJacobians(lambda, {500, 950.895217}).J_q_x, 50.0);
  EXPECT_NEAR(16.159623 * low(0, 0), 0.38, 1e-8);
  EXPECT_NEAR(16.159623 * high(0, 0), 0.45, 1e-8);
  EXPECT_NEAR(16.159623 * std::abs(low(0, 1)), 1.57, 5e-3);
}

JetStack PaperStack(double tube_mm, double to_exit_mm, double offset_mm) {
  return {0.064 * kDegree, 0.038 * kDegree, to_exit_mm, tube_mm, offset_mm};
}

TEST(PaperJetStack, TiltsAreDegrees) {
  EXPECT_NEAR(0.064 * kDegree, 0.0011170107, 1e-10);
  EXPECT_NEAR(0.038 * kDegree, 0.0006632251, 1e-10);
}

TEST(PaperJetStack, AxisDeviation) {
  const struct {
    double tube, to_exit, offset, mean, rms, min, max;
  } rows[] = {{76.2, 147.7, 0.0744, 0.177616, 0.187906, 0.0400, 0.2899},
              {101.6, 147.7, 0.0577, 0.177277, 0.187321, 0.0399, 0.2901},
              {127.0, 147.7, 0.0408, 0.178657, 0.189680, 0.0400, 0.2900},
              {76.2, 106.2, 0.0, 0.124073, 0.128943, 0.0681, 0.1692}};
  for (const auto& row : rows) {
    const Spread spread = AxisDeviation(PaperStack(row.tube, row.to_exit, row.offset));
    EXPECT_NEAR(spread.mean_mm, row.mean, 5e-5) << row.tube;  // the offset is printed to 1e-4 mm
    EXPECT_NEAR(spread.rms_mm, row.rms, 5e-5) << row.tube;
    EXPECT_NEAR(spread.min_mm, row.min, 1.1e-4) << row.tube;
    EXPECT_NEAR(spread.max_mm, row.max, 1.1e-4) << row.tube;
  }
}

TEST(PaperJetStack, EdgeDeviationIsTheAxisAndTheBore) {
  const Spread edge = EdgeDeviation(PaperStack(76.2, 147.7, 0.0744), {0.23, 0.28, 0.69}, 7, 200000);
  EXPECT_NEAR(edge.mean_mm, 0.577, 2e-3);
  EXPECT_NEAR(edge.min_mm, 0.274, 5e-3);
  EXPECT_NEAR(edge.max_mm, 0.973, 1e-2);
}

}  // namespace
}  // namespace lambdajet::accuracy
