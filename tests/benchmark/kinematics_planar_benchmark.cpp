// Prints what one lambda solve costs, alone and in a batch, beside a baseline that does only the two roots
// such a solve cannot do without; and what a stretch of a swept sheet costs.
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <random>
#include <vector>

#include "kinematics/core/lambda_mechanism.hpp"
#include "kinematics/core/swept_collision.hpp"

namespace lambdajet::kinematics {
namespace {

constexpr std::size_t kPoses = 16'384;  // stays in the second-level cache
constexpr int kRepeats = 200;

// Median over repeats, so that a neighbour on the machine does not count.
template <class Work>
double NanosecondsAPose(Work work) {
  std::vector<double> times;
  for (int i = 0; i < kRepeats; ++i) {
    const auto start = std::chrono::steady_clock::now();
    work();
    times.push_back(
        std::chrono::duration<double, std::nano>(std::chrono::steady_clock::now() - start).count() / kPoses);
  }
  std::nth_element(times.begin(), times.begin() + kRepeats / 2, times.end());
  return times[kRepeats / 2];
}

double Roots(const std::vector<double>& poses, std::vector<double>& out) {
  return NanosecondsAPose([&] {
    for (std::size_t i = 0; i < kPoses; ++i) {
      out[2 * i] = std::sqrt(1.44e6 - poses[2 * i + 1] * poses[2 * i + 1]);
      out[2 * i + 1] = std::sqrt(4.9e5 - 0.25 * poses[2 * i + 1] * poses[2 * i + 1]);
    }
    asm volatile("" : : "r"(out.data()) : "memory");
  });
}

void Report(const char* name, const LambdaMechanism& m) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> x(-800.0, 800.0), y(160.0, 1150.0);
  std::vector<double> poses(2 * kPoses), actuators(2 * kPoses), back(2 * kPoses);
  std::vector<Reason> reasons(kPoses);
  for (std::size_t i = 0; i < kPoses; ++i) {
    poses[2 * i] = x(random);
    poses[2 * i + 1] = y(random);
  }
  const double roots = Roots(poses, back);
  const double inverse = NanosecondsAPose([&] { SolveInverseBatch(m, poses, actuators, reasons); });
  const double forward = NanosecondsAPose([&] { SolveForwardBatch(m, actuators, back, reasons); });
  double sum = 0.0;
  const double single = NanosecondsAPose([&] {
    for (std::size_t i = 0; i < kPoses; ++i) {
      sum += SolveInverse(m, {poses[2 * i], poses[2 * i + 1]}).actuator_position_mm.x();
    }
  });
  const double single_forward = NanosecondsAPose([&] {
    for (std::size_t i = 0; i < kPoses; ++i) {
      sum += SolveForward(m, {actuators[2 * i], actuators[2 * i + 1]}).p_DE_mm.x();
    }
  });
  std::printf(
      "%s: two roots %.2f ns a pose; batch inverse %.2f ns (x %.1f), batch forward %.2f ns (x %.1f); "
      "single inverse %.1f ns, single forward %.1f ns%s\n",
      name, roots, inverse, inverse / roots, forward, forward / roots, single, single_forward,
      sum == 0.0 ? " (nothing solved)" : "");
}

// A sheet carried zigzag past four bodies that it never meets, so that every stretch is looked at.
void ReportSweep() {
  const auto sheet = SheetCorners({-300.0, 100.0, 0.0}, 800.0, 600.0);
  const std::array<std::array<Eigen::Vector2d, 4>, 4> corners = {
      BodyCorners(2000, 0, 2100, 100), BodyCorners(-2100, 0, -2000, 100), BodyCorners(0, 2000, 100, 2100),
      BodyCorners(0, -2100, 100, -2000)};
  const std::vector<Corners> bodies(corners.begin(), corners.end());
  std::vector<Eigen::Vector2d> path;
  for (std::size_t i = 0; i < kPoses; ++i) {
    path.emplace_back(i % 2 == 0 ? 200.0 : -200.0, 0.01 * static_cast<double>(i));
  }
  double clearance = 0.0;
  const double time = NanosecondsAPose([&] { clearance += SweepSheet(sheet, path, bodies).clearance_mm; });
  std::printf("swept sheet: %.1f ns a stretch and body%s\n", time / static_cast<double>(bodies.size()),
              clearance == 0.0 ? " (it collides)" : "");
}

}  // namespace
}  // namespace lambdajet::kinematics

int main() {
  using namespace lambdajet::kinematics;
  auto paper = LambdaMechanism::FromParameters(IdealLambda(1200, 600, 700));
  paper.singular_margin_mm = 20.0;
  paper.travel = {{{-2500.0, 2500.0}, {-2500.0, 2500.0}}};
  Report("lambda 1200/600/700 on one straight rail", paper);
  MechanismParameters p = IdealLambda(1200.7, 599.4, 701.3);
  p.tail<6>() << 1.5e-3, 0.31, -0.9e-3, -0.42, 12.5, -7.25;
  Report("the same as identified, rails tilted and offset", paper.WithParameters(p));
  ReportSweep();
  return 0;
}
