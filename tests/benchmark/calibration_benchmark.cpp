// Times the identification of 19 parameters from 60 looks, and prints the ratio to plain Ceres in the same run: one
// AutoDiffCostFunction of 19 derivatives a look, priors, no loss, dense QR; no outliers, covariance or hold-out.
#include <ceres/ceres.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <functional>
#include <vector>

#include "calibration/core/identification.hpp"
#include "kinematics/core/lambda_kernel.hpp"
#include "tests/support/simulated_looks.hpp"

namespace {

using namespace lambdajet;

struct PlainLook {
  template <class S>
  bool operator()(const S* p, S* residual) const {
    using std::cos;
    using std::sin;
    namespace lambda = kinematics::lambda;
    const auto geometry = lambda::MakeGeometry(p);
    const auto place = [&](const Eigen::Vector2d& q) {
      return lambda::Assemble(geometry, lambda::Readings<S>{S(q.x()), S(q.y())}, 1.0, false).tool;
    };
    const auto now = place(look.actuator_position_mm);
    S dx, dy;
    if (calibration::IsHole(look)) {
      const auto pierced = place(look.pierce_actuator_position_mm);
      dx = now.x - pierced.x;
      dy = now.y - pierced.y;
    } else {
      dx = now.x + p[12] + cos(p[14]) * mark.x() - sin(p[14]) * mark.y() - p[9];
      dy = now.y + p[13] + sin(p[14]) * mark.x() + cos(p[14]) * mark.y() - p[10];
    }
    residual[0] = (cos(p[11]) * dx + sin(p[11]) * dy - p[15] - look.p_C_mm.x()) / sigma_mm;
    residual[1] = (-sin(p[11]) * dx + cos(p[11]) * dy - p[16] - look.p_C_mm.y()) / sigma_mm;
    return true;
  }
  calibration::Measurement look;
  Eigen::Vector2d mark;
  double sigma_mm;
};

struct PlainPrior {
  template <class S>
  bool operator()(const S* p, S* residual) const {
    for (int i = 0; i < calibration::kAll; ++i) {
      residual[i] = (p[i] - mean[i]) / sigma[i];
    }
    return true;
  }
  ParameterVector mean, sigma;
};

ParameterVector PlainFit(const MachineDescription& machine,
                         const std::vector<calibration::Measurement>& run) {
  ParameterVector p = machine.parameters;
  ceres::Problem problem;
  for (const auto& look : run) {
    const auto mark = calibration::MarkPlace(machine, look.mark).value_or(Eigen::Vector2d::Zero());
    problem.AddResidualBlock(
        new ceres::AutoDiffCostFunction<PlainLook, 2, calibration::kAll>(new PlainLook{look, mark, 0.008}),
        nullptr, p.data());
  }
  problem.AddResidualBlock(new ceres::AutoDiffCostFunction<PlainPrior, calibration::kAll, calibration::kAll>(
                               new PlainPrior{machine.parameters, machine.covariance.diagonal().cwiseSqrt()}),
                           nullptr, p.data());
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.logging_type = ceres::SILENT;
  options.function_tolerance = 1e-12;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  return p;
}

double MedianMs(int times, const std::function<void()>& work) {
  std::vector<double> ms;
  for (int i = 0; i < times; ++i) {
    const auto start = std::chrono::steady_clock::now();
    work();
    ms.push_back(1e3 * std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  }
  std::nth_element(ms.begin(), ms.begin() + times / 2, ms.end());
  return ms[static_cast<std::size_t>(times / 2)];
}

}  // namespace

int main() {
  const MachineDescription machine = support::PaperSizedMachine();
  support::LookSimulator simulator(machine, 3);
  simulator.DrawTruth();
  std::vector<calibration::Measurement> run;
  for (int i = 0; i < 54; ++i) {
    run.push_back(simulator.Still(1 + i % 20));
  }
  for (int n = 1; n <= 6; ++n) {
    run.push_back(simulator.Hole(n, {60.0 * n, 8.0}));
  }
  calibration::IdentificationOptions bare;
  bare.hold_out_folds = 0;
  ParameterVector plain = machine.parameters;
  calibration::Identification found;
  const double plain_ms = MedianMs(51, [&] { plain = PlainFit(machine, run); });
  const double bare_ms = MedianMs(51, [&] { found = calibration::Identify(machine, run, bare); });
  const double whole_ms = MedianMs(51, [&] { found = calibration::Identify(machine, run); });
  double plain_miss = 0.0, miss = 0.0;
  for (const auto& place : found.places) {
    plain_miss =
        std::max(plain_miss, calibration::JetMiss(machine, plain, simulator.truth(), place.p_W_mm)->norm());
    miss = std::max(miss,
                    calibration::JetMiss(machine, found.parameters, simulator.truth(), place.p_W_mm)->norm());
  }
  std::printf("60 looks, 19 parameters, medians of 51: plain Ceres %.2f ms (worst miss %.4f mm)\n", plain_ms,
              plain_miss);
  std::printf("  Identify without hold-out %.2f ms, %.2f times plain (worst miss %.4f mm)\n", bare_ms,
              bare_ms / plain_ms, miss);
  std::printf("  Identify with 4-fold hold-out %.2f ms, %.2f times plain\n", whole_ms, whole_ms / plain_ms);
  const auto measuring = simulator.MeasuringRun();
  const double measuring_ms = MedianMs(5, [&] { found = calibration::Identify(machine, measuring); });
  std::printf("  a run with %zu pictures and hold-out %.1f ms\n", measuring.size(), measuring_ms);
  return found.reason == calibration::IdentificationReason::kIdentified ? 0 : 1;
}
