#include "calibration/core/look_solver.hpp"

#include <ceres/ceres.h>

#include <Eigen/Cholesky>
#include <memory>

namespace lambdajet::calibration {
namespace {

using RowMajorZ = Eigen::Matrix<double, 2, kAll, Eigen::RowMajor>;
using RowMajorMark = Eigen::Matrix<double, 2, kMarkSize, Eigen::RowMajor>;
using RowMajorRun = Eigen::Matrix<double, 2, kRunSize, Eigen::RowMajor>;

// Evaluates the whole system once a point, tracking runs being one chain; the costs below only read their
// rows.
class WholeSystem final : public ceres::EvaluationCallback {
 public:
  WholeSystem(LookSystem& system, const LookUnknowns& at) : system_(system), at_(at) {}
  void PrepareForEvaluation(bool, bool new_point) override {
    if (new_point || !evaluated_) {
      holds_ = system_.Evaluate(at_);
      evaluated_ = true;
    }
  }
  bool holds() const { return holds_; }

 private:
  LookSystem& system_;
  const LookUnknowns& at_;
  bool evaluated_ = false;
  bool holds_ = false;
};

class LookCost final : public ceres::CostFunction {
 public:
  LookCost(const LookSystem& system, const WholeSystem& whole, std::size_t look)
      : system_(system), whole_(whole), look_(look) {
    set_num_residuals(2);
    *mutable_parameter_block_sizes() = {kAll, kMarkSize};
    if (system.run_of(look) >= 0) {
      mutable_parameter_block_sizes()->push_back(kRunSize);
    }
  }
  bool Evaluate(double const* const*, double* residuals, double** jacobians) const override {
    if (!whole_.holds()) {
      return false;  // Ceres shortens its step
    }
    const LookRow& row = system_.row(look_);
    Eigen::Map<Eigen::Vector2d> r(residuals);
    r = row.residual;
    if (jacobians == nullptr) {
      return true;
    }
    if (jacobians[0] != nullptr) {
      Eigen::Map<RowMajorZ> J(jacobians[0]);
      J = row.J_z;
    }
    if (jacobians[1] != nullptr) {
      Eigen::Map<RowMajorMark> J(jacobians[1]);
      J = row.J_mark;
    }
    if (parameter_block_sizes().size() > 2 && jacobians[2] != nullptr) {
      Eigen::Map<RowMajorRun> J(jacobians[2]);
      J = row.J_run;
    }
    return true;
  }

 private:
  const LookSystem& system_;
  const WholeSystem& whole_;
  const std::size_t look_;
};

// The prior N(0, I) of one block.
template <int N>
class UnitPrior final : public ceres::SizedCostFunction<N, N> {
 public:
  bool Evaluate(double const* const* x, double* residuals, double** jacobians) const override {
    for (int i = 0; i < N; ++i) {
      residuals[i] = x[0][i];
    }
    if (jacobians != nullptr && jacobians[0] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, N, N, Eigen::RowMajor>> J(jacobians[0]);
      J.setIdentity();
    }
    return true;
  }
};

class Watch final : public ceres::IterationCallback {
 public:
  explicit Watch(const std::function<bool()>& go_on) : go_on_(go_on) {}
  ceres::CallbackReturnType operator()(const ceres::IterationSummary&) override {
    return !go_on_ || go_on_() ? ceres::SOLVER_CONTINUE : ceres::SOLVER_ABORT;
  }

 private:
  const std::function<bool()>& go_on_;
};

ceres::LossFunction* MakeLoss(RobustLoss loss) {
  constexpr double kScale = 2.5;  // sigmas of a look
  switch (loss) {
    case RobustLoss::kHuber:
      return new ceres::HuberLoss(kScale);
    case RobustLoss::kCauchy:
      return new ceres::CauchyLoss(kScale);
    case RobustLoss::kNone:
      break;
  }
  return nullptr;
}

void AddBlocks(LookSystem& system, const WholeSystem& whole, const std::vector<char>& active, RobustLoss loss,
               LookUnknowns& at, ceres::Problem& problem) {
  for (std::size_t i = 0; i < system.look_count(); ++i) {
    if (!active[i]) {
      continue;
    }
    std::vector<double*> blocks = {at.z.data(), at.marks[system.mark_of(i)].data()};
    if (system.run_of(i) >= 0) {
      blocks.push_back(at.runs[static_cast<std::size_t>(system.run_of(i))].data());
    }
    problem.AddResidualBlock(new LookCost(system, whole, i), MakeLoss(loss), blocks);
  }
  problem.AddResidualBlock(new UnitPrior<kAll>, nullptr, at.z.data());
  for (auto& mark : at.marks) {
    problem.AddResidualBlock(new UnitPrior<kMarkSize>, nullptr, mark.data());
  }
  for (auto& run : at.runs) {
    problem.AddResidualBlock(new UnitPrior<kRunSize>, nullptr, run.data());
  }
}

}  // namespace

SolveReport SolveLooks(LookSystem& system, const std::vector<char>& active, RobustLoss loss,
                       int max_iterations, const std::function<bool()>& go_on, LookUnknowns& at) {
  WholeSystem whole(system, at);
  ceres::Problem::Options ownership;
  ownership.evaluation_callback = &whole;
  ceres::Problem problem(ownership);
  AddBlocks(system, whole, active, loss, at, problem);

  ceres::Solver::Options options;
  // Scaled to the priors, the normal matrix is never worse than (prior sigma / posterior sigma)^2: Cholesky is safe. Each look
  // belongs to one run at most, so runs are eliminated first.
  options.linear_solver_type = at.runs.empty() ? ceres::DENSE_NORMAL_CHOLESKY : ceres::DENSE_SCHUR;
  if (!at.runs.empty()) {
    options.linear_solver_ordering = std::make_shared<ceres::ParameterBlockOrdering>();
    for (auto& run : at.runs) {
      options.linear_solver_ordering->AddElementToGroup(run.data(), 0);
    }
    for (auto& mark : at.marks) {
      options.linear_solver_ordering->AddElementToGroup(mark.data(), 1);
    }
    options.linear_solver_ordering->AddElementToGroup(at.z.data(), 1);
  }
  options.num_threads = 1;
  options.max_num_iterations = max_iterations;
  options.function_tolerance = 1e-12;
  options.gradient_tolerance = 1e-9;
  options.parameter_tolerance = 1e-10;
  options.logging_type = ceres::SILENT;
  Watch watch(go_on);
  options.callbacks.push_back(&watch);
  options.update_state_every_iteration = false;

  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  SolveReport report;
  report.iterations = static_cast<int>(summary.iterations.size());
  if (summary.termination_type == ceres::USER_FAILURE) {
    report.end = SolveEnd::kCancelled;
  } else if (summary.termination_type == ceres::CONVERGENCE && system.Evaluate(at)) {
    report.end = SolveEnd::kConverged;
  }
  return report;
}

ParameterCovariance InformationOfLooks(const LookSystem& system, const std::vector<char>& active) {
  const int rest = static_cast<int>(kMarkSize * system.mark_count() + kRunSize * system.run_count());
  ParameterCovariance of_z = ParameterCovariance::Zero();
  Eigen::MatrixXd of_rest = Eigen::MatrixXd::Identity(rest, rest);  // their priors
  Eigen::MatrixXd across = Eigen::MatrixXd::Zero(kAll, rest);
  for (std::size_t i = 0; i < system.look_count(); ++i) {
    if (!active[i]) {
      continue;
    }
    const LookRow& row = system.row(i);
    of_z.noalias() += row.J_z.transpose() * row.J_z;
    const int mark = static_cast<int>(kMarkSize * system.mark_of(i));
    of_rest.block<kMarkSize, kMarkSize>(mark, mark) += row.J_mark.transpose() * row.J_mark;
    across.middleCols<kMarkSize>(mark) += row.J_z.transpose() * row.J_mark;
    if (system.run_of(i) >= 0) {
      const int run = static_cast<int>(kMarkSize * system.mark_count() +
                                       kRunSize * static_cast<std::size_t>(system.run_of(i)));
      of_rest.block<kRunSize, kRunSize>(run, run) += row.J_run.transpose() * row.J_run;
      of_rest.block<kMarkSize, kRunSize>(mark, run) += row.J_mark.transpose() * row.J_run;
      of_rest.block<kRunSize, kMarkSize>(run, mark) += row.J_run.transpose() * row.J_mark;
      across.middleCols<kRunSize>(run) += row.J_z.transpose() * row.J_run;
    }
  }
  if (rest == 0) {
    return of_z;
  }
  const ParameterCovariance eliminated = across * of_rest.llt().solve(across.transpose());
  const ParameterCovariance information = of_z - eliminated;
  return 0.5 * (information + information.transpose());
}

double SumOfSquares(const LookSystem& system, const std::vector<char>& active, const LookUnknowns& at) {
  double sum = at.z.squaredNorm();
  for (const auto& mark : at.marks) {
    sum += mark.squaredNorm();
  }
  for (const auto& run : at.runs) {
    sum += run.squaredNorm();
  }
  for (std::size_t i = 0; i < system.look_count(); ++i) {
    sum += active[i] ? system.row(i).residual.squaredNorm() : 0.0;
  }
  return sum;
}

}  // namespace lambdajet::calibration
