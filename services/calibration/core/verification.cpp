#include "calibration/core/verification.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "calibration/core/chi_square.hpp"
#include "calibration/core/look_system.hpp"

namespace lambdajet::calibration {
namespace {

constexpr std::size_t kMostLooks = 600;  // of which a dense covariance is made

// Everything whitened by the looks' own noise.
struct Innovation {
  Eigen::VectorXd r;           // seen minus predicted
  Eigen::MatrixXd covariance;  // S: noise, parameters, marks and tracking runs
  Eigen::MatrixXd move;        // A: of the looks by shift of the module and turn of the sheet
  double reach_mm = 0.0;       // of the marks looked at from their middle
};

Innovation Line(const LookSystem& system) {
  const auto n = static_cast<Eigen::Index>(2 * system.look_count());
  const auto marks = static_cast<Eigen::Index>(kMarkSize * system.mark_count());
  const auto runs = static_cast<Eigen::Index>(kRunSize * system.run_count());
  Innovation line{Eigen::VectorXd::Zero(n), {}, Eigen::MatrixXd::Zero(n, 3), 0.0};
  Eigen::MatrixXd J = Eigen::MatrixXd::Zero(n, kAll + marks + runs);  // to all that is N(0, I)
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();
  for (std::size_t i = 0; i < system.look_count(); ++i) {
    const auto at = static_cast<Eigen::Index>(2 * i);
    const LookRow& row = system.row(i);
    line.r.segment<2>(at) = -row.residual;
    line.move.middleRows<2>(at) = row.J_move;
    J.block<2, kAll>(at, 0) = row.J_z;
    J.block<2, kMarkSize>(at, kAll + static_cast<Eigen::Index>(kMarkSize * system.mark_of(i))) = row.J_mark;
    if (system.run_of(i) >= 0) {
      J.block<2, kRunSize>(at, kAll + marks + kRunSize * system.run_of(i)) = row.J_run;
    }
    middle += *MarkPlace(system.machine(), system.look(i).mark) / static_cast<double>(system.look_count());
  }
  // The turn is taken about the marks' middle, so that it does not shift them as a whole: a turn about W's origin less the
  // shift that it gives the middle, both seen through base x and y.
  const Eigen::Matrix2d R_DW = system.machine().X_EW().rotation();
  const Eigen::Vector2d arm = R_DW * middle;
  const Eigen::Vector2d shift(-arm.y(), arm.x());
  for (std::size_t i = 0; i < system.look_count(); ++i) {
    const auto at = static_cast<Eigen::Index>(2 * i);
    line.move.block<2, 1>(at, 2) += line.move.block<2, 2>(at, 0) * shift;
    line.reach_mm =
        std::max(line.reach_mm, (*MarkPlace(system.machine(), system.look(i).mark) - middle).norm());
  }
  line.covariance = Eigen::MatrixXd::Identity(n, n) + J * J.transpose();
  return line;
}

void Estimate(const Innovation& line, Verification& found) {
  const Eigen::LLT<Eigen::MatrixXd> root(line.covariance);
  const Eigen::VectorXd whitened_r = root.matrixL().solve(line.r);
  const Eigen::MatrixXd whitened_A = root.matrixL().solve(line.move);
  const Eigen::Matrix3d normal = whitened_A.transpose() * whitened_A;
  found.chi_square = whitened_r.squaredNorm();
  found.degrees_of_freedom = static_cast<std::size_t>(line.r.size());
  found.p_value = ChiSquareUpperTail(found.chi_square, static_cast<double>(found.degrees_of_freedom));
  found.move_covariance = normal.llt().solve(Eigen::Matrix3d::Identity());
  found.move = found.move_covariance * (whitened_A.transpose() * whitened_r);
  const double explained = found.move.dot(normal * found.move);
  found.move_p_value = ChiSquareUpperTail(explained, 3.0);
  found.remainder_p_value =
      ChiSquareUpperTail(found.chi_square - explained, static_cast<double>(found.degrees_of_freedom) - 3.0);
  found.shift_mm = found.move.head<2>().norm();
  const Eigen::Vector2d along = found.shift_mm > 0.0 ? Eigen::Vector2d(found.move.head<2>() / found.shift_mm)
                                                     : Eigen::Vector2d(1.0, 0.0);
  found.shift_sigma_mm = std::sqrt(along.dot(found.move_covariance.topLeftCorner<2, 2>() * along));
}

void Judge(const VerificationOptions& options, double reach_mm, Verification& found) {
  char text[320];
  const double displaced_mm = found.shift_mm + reach_mm * std::abs(found.move.z());
  if (found.move_p_value < options.false_alarm && displaced_mm > options.tolerance_mm) {
    found.verdict = Verdict::kMoved;
    std::snprintf(text, sizeof text,
                  "module moved %.0f um (x %+.0f, y %+.0f, sigma %.0f um) and turned %+.3f mrad; identify "
                  "the base before cutting",
                  1e3 * found.shift_mm, 1e3 * found.move.x(), 1e3 * found.move.y(),
                  1e3 * found.shift_sigma_mm, 1e3 * found.move.z());
  } else if (found.p_value < options.false_alarm) {
    found.verdict = Verdict::kUncertain;
    std::snprintf(text, sizeof text,
                  "the looks contradict the version (chi-square %.1f of %zu) but not as a moved base: check "
                  "marks, camera and sheet",
                  found.chi_square, found.degrees_of_freedom);
  } else if (found.shift_sigma_mm > options.tolerance_mm) {
    found.verdict = Verdict::kUncertain;
    std::snprintf(text, sizeof text,
                  "nothing contradicts the version, but it is known too coarsely to tell a move of %.0f um "
                  "(sigma %.0f um): identify",
                  1e3 * options.tolerance_mm, 1e3 * found.shift_sigma_mm);
  } else {
    found.verdict = Verdict::kPass;
    std::snprintf(text, sizeof text,
                  "base stands: shift %.0f um with sigma %.0f um, rms of the looks %.0f um",
                  1e3 * found.shift_mm, 1e3 * found.shift_sigma_mm, 1e3 * found.rms_mm);
  }
  found.explanation = text;
}

}  // namespace

std::string_view VerdictName(Verdict verdict) {
  constexpr std::array<std::string_view, 4> kNames = {"PASS", "MOVED", "UNCERTAIN", "TOO_FEW"};
  return kNames[static_cast<std::size_t>(verdict)];
}

Verification VerifyBase(const MachineDescription& machine, const std::vector<Measurement>& run,
                        const VerificationOptions& options) {
  Verification found;
  UsableRun usable = SelectUsable(machine, run);
  found.refused = std::move(usable.refused);
  std::vector<Measurement> looks;
  for (const std::size_t i : usable.order) {
    if (!IsHole(run[i]) && looks.size() < kMostLooks) {
      looks.push_back(run[i]);
    }
  }
  found.looks = looks.size();
  const bool apart = std::any_of(looks.begin(), looks.end(),
                                 [&](const Measurement& m) { return m.mark != looks.front().mark; });
  LookSystem look_system(machine, Prior::Of(machine.parameters, machine.covariance), looks);
  if (!apart || !look_system.Evaluate(look_system.Start())) {
    found.explanation =
        std::to_string(looks.size()) + " usable looks; at least 2 of different marks are needed";
    return found;
  }
  const Innovation line = Line(look_system);
  Estimate(line, found);
  const double n = static_cast<double>(looks.size());
  double squared = 0.0;
  for (std::size_t i = 0; i < looks.size(); ++i) {
    found.mean_shift_C_mm -= look_system.row(i).miss_mm / n;
    squared += look_system.row(i).miss_mm.squaredNorm();
  }
  found.rms_mm = std::sqrt(squared / (2.0 * n));
  Judge(options, line.reach_mm, found);
  return found;
}

}  // namespace lambdajet::calibration
