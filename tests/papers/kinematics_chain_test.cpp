// The numbers of seed paper 000's transform chains, velocity (19), acceleration (20), (23) and error stack (44)-(55).
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "foundation/geometry/homogeneous_chain.hpp"

namespace lambdajet {
namespace {

constexpr double kDigits10 = 1e-10;

using Motion = ElementaryMotion;

// x=100 sin 2t; y=40 t^2; gamma=0.2+0.3t; z=-250; alpha=0.1 sin 3t; beta=0.05; x=30+5t^3.
std::array<ChainFactor, 7> TestChain(double t) {
  const double s2 = std::sin(2 * t), c2 = std::cos(2 * t), s3 = std::sin(3 * t), c3 = std::cos(3 * t);
  return {{{Motion::kX, 100 * s2, 200 * c2, -400 * s2},
           {Motion::kY, 40 * t * t, 80 * t, 80},
           {Motion::kGamma, 0.2 + 0.3 * t, 0.3, 0},
           {Motion::kZ, -250, 0, 0},
           {Motion::kAlpha, 0.1 * s3, 0.3 * c3, -0.9 * s3},
           {Motion::kBeta, 0.05, 0, 0},
           {Motion::kX, 30 + 5 * t * t * t, 15 * t * t, 30 * t}}};
}

PointMotion TestPoint(double t) { return {{10 * t, 5, 2 * t * t}, {10, 0, 4 * t}, {0, 0, 4}}; }

void ExpectVector(const Eigen::Vector3d& value, double x, double y, double z) {
  EXPECT_NEAR(value.x(), x, kDigits10);
  EXPECT_NEAR(value.y(), y, kDigits10);
  EXPECT_NEAR(value.z(), z, kDigits10);
}

TEST(PaperChain, PositionVelocityAndAcceleration) {
  const auto factors = TestChain(0.3);
  const ChainMotion chain = MultiplyChain(factors);
  const PointMotion point = TestPoint(0.3);
  const PointMotion moved = CarryPoint(chain, point);
  ExpectVector(moved.r_mm, 86.7261868118, 17.9529848971, -251.0804947573);
  ExpectVector(moved.v_mm_per_s, 171.6376811726, 36.4829804311, 1.5803999531);
  ExpectVector(moved.a_mm_per_s2, -221.4032335278, 86.4709873733, -0.0421355228);
  const Eigen::Vector3d coupling = 2.0 * chain.M_rate.topLeftCorner<3, 3>() * point.v_mm_per_s;
  ExpectVector(moved.a_mm_per_s2 - coupling, -219.7850991011, 80.9337936474, -0.0217433201);
}

TEST(PaperChain, ToolToPart) {
  const std::array<ChainFactor, 3> tool = {{{Motion::kX, 800}, {Motion::kY, 300}, {Motion::kGamma, 0.01}}};
  const std::array<ChainFactor, 4> part = {
      {{Motion::kX, 1500}, {Motion::kY, -20}, {Motion::kGamma, -0.004}, {Motion::kZ, -4}}};
  ExpectVector(CarryPoint(ToolInPart(MultiplyChain(tool), MultiplyChain(part)), {{100, 200, 0}, {}, {}}).r_mm,
               -604.0841049683, 518.5778020573, 4);
}

TEST(PaperErrorStack, LeverMatrixHasTheSignThePrintLacks) {
  const Eigen::Vector3d r(1, 2, 3);
  const Eigen::Vector3d psi(0.01, -0.02, 0.03);
  ExpectVector(LeverMatrix(r) * psi, -0.12, 0, 0.04);
  Eigen::Matrix3d printed = LeverMatrix(r);
  printed(2, 1) = r.x();  // (49) as printed
  ExpectVector(printed * psi, -0.12, 0, 0);
}

TEST(PaperErrorStack, CarriesSixErrorsToTheFixedFrame) {
  const Eigen::Matrix3d M = RotationX(0.02) * RotationZ(30 * M_PI / 180);
  SmallErrors errors;
  errors << 0.03, -0.02, 0.01, 1e-3, -5e-4, 2e-4;
  const SmallErrors carried = ErrorMap(M, {2, -1, -106.2}) * errors;
  constexpr std::array<double, 6> kPrinted = {0.0294942052, 0.1164044665, 0.0087096193,
                                              0.0011160254, 0.0000629742, 0.0002012997};
  for (int i = 0; i < 6; ++i) {
    EXPECT_NEAR(carried[i], kPrinted[static_cast<std::size_t>(i)], 6e-11);
  }
}

TEST(PaperErrorStack, SumsOverItsElements) {
  const Eigen::Vector3d point(2, -1, -106.2);
  const std::array<Pose, 2> elements = {Pose{{0, 0, 0}, RotationX(0.02)}, Pose{{1, 2, -50}, RotationZ(0.3)}};
  std::array<SmallErrors, 2> errors;
  errors[0] << 0.01, 0, 0, 0, 1e-4, 0;
  errors[1] << 0, 0.02, 0, 2e-4, 0, 0;
  // Small errors add to first order: compare with finite displacements of each element.
  SmallErrors sum = SumOfErrors(elements, errors, point);
  Eigen::Vector3d moved = Eigen::Vector3d::Zero();
  for (std::size_t k = 0; k < 2; ++k) {
    const Pose displaced =
        Displaced(elements[k], elements[k].R * errors[k].head<3>(), elements[k].R * errors[k].tail<3>());
    moved += displaced * (elements[k].Inverse() * point) - point;
  }
  EXPECT_LT((sum.head<3>() - moved).norm(), 1e-5);
  EXPECT_GT(moved.norm(), 1e-3);
}

TEST(Chain, DerivativesMatchDifferencesOverTime) {
  const double t = 0.7, h = 1e-4;
  const auto at = [](double time) { return CarryPoint(MultiplyChain(TestChain(time)), TestPoint(time)); };
  const PointMotion now = at(t);
  const Eigen::Vector3d v =
      (8.0 * (at(t + h).r_mm - at(t - h).r_mm) - (at(t + 2 * h).r_mm - at(t - 2 * h).r_mm)) / (12 * h);
  const Eigen::Vector3d a = (8.0 * (at(t + h).v_mm_per_s - at(t - h).v_mm_per_s) -
                             (at(t + 2 * h).v_mm_per_s - at(t - 2 * h).v_mm_per_s)) /
                            (12 * h);
  EXPECT_LT((now.v_mm_per_s - v).norm(), 1e-8 * v.norm());
  EXPECT_LT((now.a_mm_per_s2 - a).norm(), 1e-8 * a.norm());
}

TEST(Chain, SeenFromAMovingPartMatchesDifferencesOverTime) {
  const auto at = [](double t) {
    const ChainMotion part = MultiplyChain(std::array<ChainFactor, 3>{{{Motion::kGamma, 0.4 * t, 0.4, 0.0},
                                                                       {Motion::kY, 20 * t * t, 40 * t, 40},
                                                                       {Motion::kBeta, 0.1 - t, -1, 0}}});
    return CarryPoint(ToolInPart(MultiplyChain(TestChain(t)), part), TestPoint(t));
  };
  const double t = 0.7, h = 1e-4;
  const Eigen::Vector3d v =
      (8.0 * (at(t + h).r_mm - at(t - h).r_mm) - (at(t + 2 * h).r_mm - at(t - 2 * h).r_mm)) / (12 * h);
  const Eigen::Vector3d a = (8.0 * (at(t + h).v_mm_per_s - at(t - h).v_mm_per_s) -
                             (at(t + 2 * h).v_mm_per_s - at(t - 2 * h).v_mm_per_s)) /
                            (12 * h);
  EXPECT_LT((at(t).v_mm_per_s - v).norm(), 1e-8 * v.norm());
  EXPECT_LT((at(t).a_mm_per_s2 - a).norm(), 1e-8 * a.norm());
}

}  // namespace
}  // namespace lambdajet
