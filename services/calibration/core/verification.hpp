// Compares new looks with what the active version predicts: does the electronic base still stand where it was identified?
//
// Model: innovation r = seen - predicted, of covariance S = J C J^T + noise (marks common to their looks); chi-square r^T
// S^-1 r judges the looks as a whole. A move changes the looks by A (x, y, turn): the main-motion module shifted, the sheet
// turned against it about the middle of the marks looked at. Its generalised least-squares estimate and covariance (A^T
// S^-1 A)^-1 say by how much, and r^T S^-1 r falls by the estimate's own chi-square of three degrees of freedom. A turn of
// the module about its own camera moves no mark that stands in the middle of the picture: only a trial hole shows it.
// How the sheet swung while it was looked at is no part of the question: elasticity and swing are first moved to what the
// pictures say (Gauss-Newton) and then left free, and the pictures count for as noisy as they are about that swing, never
// for better than stated.
//     MOVED      the move is significant (chance below `false_alarm`) and displaces the sheet under the jet by more than
//                `tolerance_mm` somewhere among the marks looked at
//     UNCERTAIN  the version is known too coarsely to tell a move of `tolerance_mm`; or the looks contradict it in a way
//                that no move explains
//     PASS       neither
// Frames: the shift is X_DJ's translation, in D.
// Units: mm, rad.
// Threads: pure.
// Cost: a dense solve of twice the looks.
// Errors: the verdict TOO_FEW below two usable still looks.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "calibration/core/measurement.hpp"

namespace lambdajet::calibration {

enum class Verdict : std::uint8_t { kPass, kMoved, kUncertain, kTooFew };
std::string_view VerdictName(Verdict verdict);  // UPPER_SNAKE

struct VerificationOptions {
  double false_alarm = 1e-3;
  double tolerance_mm = 0.02;
};

struct Verification {
  Verdict verdict = Verdict::kTooFew;
  std::string explanation;
  std::size_t looks = 0;
  std::vector<RefusedLook> refused;
  double chi_square = 0.0;
  std::size_t degrees_of_freedom = 0;
  double p_value = 1.0;
  Eigen::Vector3d move = Eigen::Vector3d::Zero();  // x, y in mm; turn of the sheet in rad
  Eigen::Matrix3d move_covariance = Eigen::Matrix3d::Zero();
  double shift_mm = 0.0;
  double shift_sigma_mm = 0.0;  // along the shift
  double move_p_value = 1.0;
  double remainder_p_value = 1.0;                             // of what the move leaves
  Eigen::Vector2d mean_shift_C_mm = Eigen::Vector2d::Zero();  // seen minus predicted, mean over the looks
  double rms_mm = 0.0;
  double tracking_noise_ratio =
      1.0;  // variance of tracking pictures against the stated one, as found and then used
};

// Uses the looks at marks, still and tracking; the machine's own parameters and covariance are the version compared with.
Verification VerifyBase(const MachineDescription& machine, const std::vector<Measurement>& run,
                        const VerificationOptions& options = {});

}  // namespace lambdajet::calibration
