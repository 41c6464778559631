// Identifies all 19 parameters of the machine from a run of camera looks, with covariance, outliers and what stays unknown.
//
// Model: the most probable parameters under the machine file's sigmas as priors,
//     min |z|^2 + |marks|^2 + |runs|^2 + sum rho(|r_i|^2),
// with the residuals of core/look_system.hpp. Three stages, each by Levenberg-Marquardt (Ceres): Huber's loss brings the
// fit near with gross errors present, Cauchy's lets go of them, and the last stage is plain least squares without the looks
// named as outliers (chance of a good look below `outlier_probability`), so that covariance and chi-square mean what they
// say.
// Covariance: (I + information)^-1 in z, marks and runs eliminated, carried to the parameters' units; inflated by
// chi-square over its degrees of freedom where chance would give less than one such run in a thousand. chi-square is the
// whole minimum, priors included: its expectation is the number of residuals.
// Validity: a fit is answered with IDENTIFIED only if the jet's place on the sheet comes out within `needed_place_mm` (95
// %).
// Threads: pure function; `watch` is called between iterations on the caller's thread.
// Cost: 60 looks some milliseconds, see tests/benchmark. Deterministic; independent of the looks' order.
// Errors: the answer's reason.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "calibration/core/measurement.hpp"
#include "calibration/core/observability.hpp"
#include "calibration/core/place_accuracy.hpp"

namespace lambdajet::calibration {

enum class IdentificationReason : std::uint8_t {
  kIdentified,
  kTooFew,         // fewer readings than parameters
  kNotObservable,  // the looks leave the jet's place on the sheet too uncertain
  kNotConverged,   // the solver ran into its limit, or too many looks contradict each other
  kCancelled
};
std::string_view IdentificationReasonName(IdentificationReason reason);  // UPPER_SNAKE

struct IdentificationOptions {
  double outlier_probability = 1e-5;
  double largest_outlier_share = 0.3;
  double needed_place_mm = 0.15;
  int max_iterations = 100;  // of each stage
  int hold_out_folds = 4;    // 0: none
  int place_columns = 7;
  int place_rows = 5;
  // Progress 0 … 1 and what is being done; false cancels.
  std::function<bool(double progress, const char* phase)> watch;
};

struct LookResidual {
  std::size_t index = 0;  // in the run as given
  int mark = 0;
  LookKind kind = LookKind::kStill;
  Eigen::Vector2d before_mm = Eigen::Vector2d::Zero();  // predicted minus seen, with the prior's parameters
  Eigen::Vector2d after_mm = Eigen::Vector2d::Zero();   // with the identified ones, mark taken as drawn
  double squared = 0.0;  // whitened: chi-square of two degrees of freedom if the look is good
  bool outlier = false;
};

struct Identification {
  IdentificationReason reason = IdentificationReason::kTooFew;
  std::string explanation;  // for people: what was found, or what is missing and what to do
  ParameterVector parameters = ParameterVector::Zero();
  ParameterCovariance covariance = ParameterCovariance::Zero();
  double covariance_inflation = 1.0;
  double tracking_noise_ratio =
      1.0;  // variance of tracking pictures against the stated one, as found and then used
  std::vector<LookResidual> residuals;  // usable looks, by exposure
  std::vector<RefusedLook> refused;
  double chi_square = 0.0;
  std::size_t degrees_of_freedom = 0;
  double p_value = 1.0;
  double rms_before_mm = 0.0;  // of the looks used, each coordinate
  double rms_after_mm = 0.0;
  std::size_t held_out = 0;  // marks and holes predicted by fits that did not contain them
  double hold_out_before_mm = 0.0;
  double hold_out_after_mm = 0.0;
  Observability observability;
  bool elasticity_identified = false;
  std::vector<PlaceAccuracy> places;   // over the sheet
  double worst_place_before_mm = 0.0;  // 95 %
  double worst_place_mm = 0.0;         // 95 %
  int iterations = 0;
};

// The machine's own parameters and covariance are the prior.
Identification Identify(const MachineDescription& machine, const std::vector<Measurement>& run,
                        const IdentificationOptions& options = {});

}  // namespace lambdajet::calibration
