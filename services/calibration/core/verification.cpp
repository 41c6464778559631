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

struct Innovation {
  Eigen::VectorXd r_mm;        // seen minus predicted
  Eigen::MatrixXd covariance;  // S
  Eigen::MatrixXd move;        // A: of the looks by shift of the module and turn of the sheet
  double reach_mm = 0.0;       // of the looks from their middle
};

// Unwhitened rows of the system at its prior.
bool Line(const MachineDescription& machine, const std::vector<Measurement>& looks, Innovation& line) {
  const auto n = static_cast<Eigen::Index>(2 * looks.size());
  line = {Eigen::VectorXd::Zero(n), Eigen::MatrixXd::Zero(n, n), Eigen::MatrixXd::Zero(n, 3), 0.0};
  Eigen::MatrixXd J(n, kAll);
  const Eigen::Matrix2d R_JD = machine.X_DJ().rotation().transpose();
  const double camera = machine.uncertainties.camera_mm;
  const double mark = machine.uncertainties.mark_mm;
  for (std::size_t i = 0; i < looks.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(2 * i);
    const LookPrediction predicted = PredictLook(machine, machine.parameters, looks[i]);
    if (!predicted.closed) {
      return false;
    }
    const EffectorPlace place = PlaceEffector(machine, machine.parameters, looks[i].actuator_position_mm);
    line.r_mm.segment<2>(at) = looks[i].p_C_mm - predicted.p_C_mm;
    J.middleRows<2>(at) = predicted.J;
    const Eigen::Matrix2d of_place =
        StraightnessCovariance(machine, place) + BacklashCovariance(machine, place);
    line.covariance.block<2, 2>(at, at) =
        R_JD * of_place * R_JD.transpose() + (camera * camera + 1e-12) * Eigen::Matrix2d::Identity();
    line.move.block<2, 2>(at, 0) = predicted.J.middleCols<2>(At(Parameter::kBaseXMm));
    line.move.block<2, 1>(at, 2) = predicted.J.col(At(Parameter::kSheetThetaRad));
    for (std::size_t j = 0; j < looks.size(); ++j) {
      if (looks[j].mark == looks[i].mark) {
        line.covariance.block<2, 2>(at, static_cast<Eigen::Index>(2 * j)) +=
            mark * mark * Eigen::Matrix2d::Identity();
      }
    }
  }
  line.covariance += J * machine.covariance * J.transpose();
  // The turn is taken about the looks' middle, so that it does not shift them as a whole.
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (Eigen::Index at = 0; at < n; at += 2) {
    mean += line.move.block<2, 1>(at, 2) * (2.0 / static_cast<double>(n));
  }
  for (Eigen::Index at = 0; at < n; at += 2) {
    line.move.block<2, 1>(at, 2) -= mean;
    line.reach_mm = std::max(line.reach_mm, line.move.block<2, 1>(at, 2).norm());
  }
  return true;
}

void Estimate(const Innovation& line, Verification& found) {
  const Eigen::LLT<Eigen::MatrixXd> root(line.covariance);
  const Eigen::VectorXd whitened_r = root.matrixL().solve(line.r_mm);
  const Eigen::MatrixXd whitened_A = root.matrixL().solve(line.move);
  const Eigen::Matrix3d normal = whitened_A.transpose() * whitened_A;
  found.chi_square = whitened_r.squaredNorm();
  found.degrees_of_freedom = static_cast<std::size_t>(line.r_mm.size());
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
    if (run[i].kind == LookKind::kStill) {
      looks.push_back(run[i]);
    }
  }
  found.looks = looks.size();
  Innovation line;
  const bool apart =
      std::any_of(looks.begin(), looks.end(), [&](const Measurement& m) { return m.mark != looks[0].mark; });
  if (!apart || !Line(machine, looks, line)) {
    found.explanation =
        std::to_string(looks.size()) + " usable still looks; at least 2 of different marks are needed";
    return found;
  }
  Estimate(line, found);
  const double n = static_cast<double>(looks.size());
  for (std::size_t i = 0; i < looks.size(); ++i) {
    found.mean_shift_C_mm += line.r_mm.segment<2>(static_cast<Eigen::Index>(2 * i)) / n;
  }
  found.rms_mm = std::sqrt(line.r_mm.squaredNorm() / (2.0 * n));
  Judge(options, line.reach_mm, found);
  return found;
}

}  // namespace lambdajet::calibration
