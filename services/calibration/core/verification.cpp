#include "calibration/core/verification.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "calibration/core/chi_square.hpp"
#include "calibration/core/look_system.hpp"

namespace lambdajet::calibration {
namespace {

constexpr std::size_t kMostLooks = 600;  // of which a dense covariance is made
constexpr double kFree = 1e3;            // prior sigmas that what only swings may differ by
constexpr int kSwingSteps = 6;
constexpr double kMostStep = 2.0;  // prior sigmas
constexpr int kPlaceSize = 2;      // of a tracking run's unknowns the first, its place; the others swing

// Everything whitened by the looks' own noise.
struct Innovation {
  Eigen::VectorXd r;           // seen minus predicted
  Eigen::MatrixXd covariance;  // S: noise, parameters, marks and tracking runs
  Eigen::MatrixXd move;        // A: of the looks by shift of the module and turn of the sheet
  Eigen::Index free = 0;       // readings that what only swings takes up
  double reach_mm = 0.0;       // of the marks looked at from their middle
};

// A tracking run's unknowns that say nothing of where it looked: its swing, and the elasticity behind it.
Eigen::MatrixXd SwingColumns(const LookSystem& system, std::size_t first, std::size_t end) {
  Eigen::MatrixXd J(static_cast<Eigen::Index>(2 * (end - first)), kRunSize - kPlaceSize + 2);
  for (std::size_t i = first; i < end; ++i) {
    const LookRow& row = system.row(i);
    J.middleRows<2>(static_cast<Eigen::Index>(2 * (i - first)))
        << row.J_run.rightCols<kRunSize - kPlaceSize>(),
        row.J_z.col(At(Parameter::kElasticLagS2)), row.J_z.col(At(Parameter::kDampingTimeS));
  }
  return J;
}

// Moves the unknowns of swing and elasticity to what the pictures say, by Gauss-Newton with each run's place beside them, so that
// what follows is linear about the swing that was seen, not about the one expected. False if the system cannot be evaluated.
bool FollowSwing(LookSystem& system, LookUnknowns& at) {
  constexpr int kSwing = kRunSize - kPlaceSize;
  const auto shared = kRunSize * static_cast<Eigen::Index>(system.run_count());
  for (int step = 0; step < kSwingSteps; ++step) {
    system.Relinearise(at.z);
    if (!system.Evaluate(at)) {
      return false;
    }
    Eigen::MatrixXd J = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(2 * system.look_count()), shared + 2);
    Eigen::VectorXd r = Eigen::VectorXd::Zero(J.rows());
    for (std::size_t i = 0; i < system.look_count(); ++i) {
      const LookRow& row = system.row(i);
      const auto k = static_cast<Eigen::Index>(2 * i);
      if (const int run = system.run_of(i); run >= 0) {
        J.block<2, kRunSize>(k, kRunSize * run) = row.J_run;
        J.block<2, 2>(k, shared) << row.J_z.col(At(Parameter::kElasticLagS2)),
            row.J_z.col(At(Parameter::kDampingTimeS));
        r.segment<2>(k) = -row.residual;
      }
    }
    const Eigen::VectorXd change =
        J.completeOrthogonalDecomposition().solve(r).cwiseMax(-kMostStep).cwiseMin(kMostStep);
    at.z[At(Parameter::kElasticLagS2)] += change[shared];
    at.z[At(Parameter::kDampingTimeS)] += change[shared + 1];
    for (std::size_t run = 0; run < system.run_count(); ++run) {
      at.runs[run].tail<kSwing>() +=
          change.segment<kSwing>(kRunSize * static_cast<Eigen::Index>(run) + kPlaceSize);
    }
  }
  system.Relinearise(at.z);
  return system.Evaluate(at);
}

// Mean square, per reading, of what is left of the tracking runs when each is fitted by itself with place and swing; at least
// 1. It is what the spring-mass model, linear about this version, does not know of the swing.
double TrackingNoise(const LookSystem& system) {
  double squared = 0.0;
  Eigen::Index freedom = 0;
  for (std::size_t first = 0, end = 0; first < system.look_count(); first = end) {
    end = first + 1;
    while (end < system.look_count() && system.run_of(end) == system.run_of(first)) {
      ++end;
    }
    if (system.run_of(first) < 0) {
      continue;
    }
    const Eigen::MatrixXd swing = SwingColumns(system, first, end);
    Eigen::MatrixXd J(swing.rows(), swing.cols() + kPlaceSize);
    Eigen::VectorXd r(swing.rows());
    J.rightCols(swing.cols()) = swing;
    for (std::size_t i = first; i < end; ++i) {
      const auto at = static_cast<Eigen::Index>(2 * (i - first));
      J.block<2, kPlaceSize>(at, 0) = system.row(i).J_run.leftCols<kPlaceSize>();
      r.segment<2>(at) = system.row(i).residual;
    }
    const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> fit(J);
    squared += (r - J * fit.solve(r)).squaredNorm();
    freedom += J.rows() - fit.rank();
  }
  return freedom > 0 ? std::max(1.0, squared / static_cast<double>(freedom)) : 1.0;
}

// How soft the levers are is identification's to say; here it may be whatever the pictures say.
void FreeTheSwing(const LookSystem& system, Eigen::MatrixXd& J, Innovation& line) {
  if (system.run_count() == 0) {
    return;
  }
  J.col(At(Parameter::kElasticLagS2)) *= kFree;
  J.col(At(Parameter::kDampingTimeS)) *= kFree;
  const auto swings = kRunSize - kPlaceSize;
  for (std::size_t run = 0; run < system.run_count(); ++run) {
    const auto at = J.cols() - kRunSize * static_cast<Eigen::Index>(system.run_count() - run) + kPlaceSize;
    J.middleCols(at, swings) *= kFree;
  }
  line.free = 2 + swings * static_cast<Eigen::Index>(system.run_count());
}

Innovation Line(const LookSystem& system) {
  const auto n = static_cast<Eigen::Index>(2 * system.look_count());
  const auto marks = static_cast<Eigen::Index>(kMarkSize * system.mark_count());
  const auto runs = static_cast<Eigen::Index>(kRunSize * system.run_count());
  Innovation line{Eigen::VectorXd::Zero(n), {}, Eigen::MatrixXd::Zero(n, 3)};
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
  FreeTheSwing(system, J, line);
  line.covariance = Eigen::MatrixXd::Identity(n, n) + J * J.transpose();
  return line;
}

void Estimate(const Innovation& line, Verification& found) {
  const Eigen::LLT<Eigen::MatrixXd> root(line.covariance);
  const Eigen::VectorXd whitened_r = root.matrixL().solve(line.r);
  const Eigen::MatrixXd whitened_A = root.matrixL().solve(line.move);
  const Eigen::Matrix3d normal = whitened_A.transpose() * whitened_A;
  found.chi_square = whitened_r.squaredNorm();
  found.degrees_of_freedom = static_cast<std::size_t>(line.r.size() - line.free);
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
  LookUnknowns at = look_system.Start();
  if (!FollowSwing(look_system, at)) {  // as the version says, then
    at = look_system.Start();
    look_system.Relinearise(at.z);
    (void)look_system.Evaluate(at);
  }
  found.tracking_noise_ratio = TrackingNoise(look_system);
  look_system.SetTrackingNoise(found.tracking_noise_ratio);
  look_system.Relinearise(at.z);
  (void)look_system.Evaluate(at);  // evaluated a moment ago with other weights
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
