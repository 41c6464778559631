#include "calibration/core/identification.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <numbers>

#include "calibration/core/chi_square.hpp"
#include "calibration/core/look_solver.hpp"

namespace lambdajet::calibration {
namespace {

constexpr int kMostRounds = 8;         // of naming outliers and fitting again
constexpr double kMovingMmPerS = 5.0;  // above what encoder steps make of standing sliders
constexpr double kChanceOfInflation = 1e-3;
constexpr double kElasticityKnown = 0.3;  // of the prior's sigma

std::string Text(const char* format, ...) {
  char text[512];
  va_list arguments;
  va_start(arguments, format);
  std::vsnprintf(text, sizeof text, format, arguments);
  va_end(arguments);
  return text;
}

// One identification at work; the steps of Identify() in order.
class Fit {
 public:
  Fit(const MachineDescription& machine, const std::vector<Measurement>& run,
      const IdentificationOptions& options);
  Identification Run();

 private:
  bool GoOn(double progress, const char* phase);
  bool Solve(const std::vector<char>& active, RobustLoss loss, LookUnknowns& at);
  bool FitWithoutOutliers();
  double NoiseScale(bool tracking) const;
  double TrackingNoise() const;
  std::size_t NameOutliers(std::vector<char>& active) const;
  std::vector<char> AtRest() const;
  bool HoldOut();
  void Account();
  void Judge();
  Identification Stop(IdentificationReason reason, std::string explanation);

  Identification found_;  // first: the members below fill it while they are made
  const IdentificationOptions& options_;
  std::vector<std::size_t> order_;
  Prior prior_;
  std::vector<Measurement> looks_;
  LookSystem system_;
  LookUnknowns at_;
  std::vector<char> active_;
  std::vector<Eigen::Vector2d> before_mm_;
  SolveEnd end_ = SolveEnd::kConverged;
  double progress_ = 0.0;
  const char* phase_ = "";
};

std::vector<Measurement> Pick(const std::vector<Measurement>& run, const std::vector<std::size_t>& order) {
  std::vector<Measurement> picked;
  for (const std::size_t i : order) {
    picked.push_back(run[i]);
  }
  return picked;
}

Fit::Fit(const MachineDescription& machine, const std::vector<Measurement>& run,
         const IdentificationOptions& options)
    : options_(options),
      order_([&] {
        UsableRun usable = SelectUsable(machine, run);
        found_.refused = std::move(usable.refused);
        return std::move(usable.order);
      }()),
      prior_(Prior::Of(machine.parameters, machine.covariance)),
      looks_(Pick(run, order_)),
      system_(machine, prior_, looks_),
      at_(system_.Start()),
      active_(looks_.size(), 1) {}

bool Fit::GoOn(double progress, const char* phase) {
  progress_ = progress;
  phase_ = phase;
  if (options_.watch && !options_.watch(progress_, phase_)) {
    end_ = SolveEnd::kCancelled;
    return false;
  }
  return true;
}

bool Fit::Solve(const std::vector<char>& active, RobustLoss loss, LookUnknowns& at) {
  system_.Relinearise(at.z);
  const SolveReport report = SolveLooks(
      system_, active, loss, options_.max_iterations,
      [this] { return !options_.watch || options_.watch(progress_, phase_); }, at);
  found_.iterations += report.iterations;
  end_ = report.end;
  return end_ == SolveEnd::kConverged;
}

// How much larger than stated the noise of looks at rest or of tracking pictures is, by the median of their squared residuals,
// which gross errors hardly move; never below 1.
double Fit::NoiseScale(bool tracking) const {
  std::vector<double> squared;
  for (std::size_t i = 0; i < looks_.size(); ++i) {
    if ((looks_[i].kind == LookKind::kTracking) == tracking) {
      squared.push_back(system_.row(i).residual.squaredNorm());
    }
  }
  if (squared.empty()) {
    return 1.0;
  }
  const auto middle = squared.begin() + static_cast<std::ptrdiff_t>(squared.size() / 2);
  std::nth_element(squared.begin(), middle, squared.end());
  return std::max(1.0,
                  *middle / (2.0 * std::numbers::ln2));  // median of chi-square with two degrees of freedom
}

// Mean square of the good tracking pictures' residuals, per reading; never below 1. What the spring-mass model does not know
// of a moving machine (servo, stamps, backlash on reversal) comes out here and must not pass for knowledge of the base.
double Fit::TrackingNoise() const {
  double sum = 0.0;
  double count = 0.0;
  for (std::size_t i = 0; i < looks_.size(); ++i) {
    if (active_[i] && looks_[i].kind == LookKind::kTracking) {
      sum += system_.row(i).residual.squaredNorm();
      count += 2.0;
    }
  }
  return count > 0.0 && sum > count * (1.0 + 3.0 * std::sqrt(2.0 / count)) ? sum / count : 1.0;
}

// Judges every look at the point last evaluated, those left out before too; returns how many changed sides.
std::size_t Fit::NameOutliers(std::vector<char>& active) const {
  const double quantile = -2.0 * std::log(options_.outlier_probability);  // of two degrees of freedom
  const std::array<double, 2> limit = {quantile * NoiseScale(false), quantile * NoiseScale(true)};
  std::size_t changed = 0;
  for (std::size_t i = 0; i < active.size(); ++i) {
    const bool tracking = looks_[i].kind == LookKind::kTracking;
    const char good = system_.row(i).residual.squaredNorm() <= limit[tracking ? 1 : 0];
    changed += good != active[i];
    active[i] = good;
  }
  return changed;
}

bool Fit::FitWithoutOutliers() {
  if (!GoOn(0.1, "fitting with gross errors bounded") || !Solve(active_, RobustLoss::kHuber, at_)) {
    return false;
  }
  std::vector<char> judged = active_;
  if (NameOutliers(judged) > 0) {
    if (!GoOn(0.3, "letting go of gross errors") || !Solve(active_, RobustLoss::kCauchy, at_)) {
      return false;
    }
    NameOutliers(active_);
  }
  found_.tracking_noise_ratio = TrackingNoise();
  system_.SetTrackingNoise(found_.tracking_noise_ratio);
  for (int round = 0; round < kMostRounds; ++round) {
    if (!GoOn(0.4 + 0.02 * round, "least squares without outliers")) {
      return false;
    }
    const ParameterVector last = at_.z;
    if (!Solve(active_, RobustLoss::kNone, at_)) {
      return false;
    }
    const bool settled = (at_.z - last).cwiseAbs().maxCoeff() < 1e-3;
    std::vector<char> again = active_;
    if (NameOutliers(again) == 0 && settled) {
      break;
    }
    active_ = again;
  }
  return true;
}

// Looks at marks and holes while the sliders stood, most of the time in a tracking run: only these are predicted in the hold-out.
std::vector<char> Fit::AtRest() const {
  std::vector<char> at_rest(looks_.size(), 1);
  std::vector<int> moving(system_.run_count(), 0);  // pictures in motion less those at rest
  for (std::size_t i = 0; i < looks_.size(); ++i) {
    if (system_.run_of(i) >= 0) {
      const bool moves = looks_[i].actuator_velocity_mm_per_s.norm() > kMovingMmPerS;
      moving[static_cast<std::size_t>(system_.run_of(i))] += moves ? 1 : -1;
    }
  }
  for (std::size_t i = 0; i < looks_.size(); ++i) {
    at_rest[i] =
        active_[i] && (system_.run_of(i) < 0 || moving[static_cast<std::size_t>(system_.run_of(i))] < 0);
  }
  return at_rest;
}

// Every mark and hole in turn is predicted by a fit that has not seen it; its looks' mean counts, so that swing averages out.
bool Fit::HoldOut() {
  const std::vector<char> at_rest = AtRest();
  std::vector<char> held(system_.mark_count(), 0);
  for (std::size_t i = 0; i < looks_.size(); ++i) {
    held[system_.mark_of(i)] |= at_rest[i];
  }
  if (options_.hold_out_folds < 2 || std::count(held.begin(), held.end(), 1) < 8) {
    return true;
  }
  const std::size_t folds = static_cast<std::size_t>(options_.hold_out_folds);
  double before = 0.0;
  double after = 0.0;
  for (std::size_t fold = 0; fold < folds; ++fold) {
    if (!GoOn(0.6 + 0.3 * static_cast<double>(fold) / static_cast<double>(folds),
              "predicting looks held out")) {
      return false;
    }
    std::vector<char> training = active_;
    for (std::size_t i = 0; i < looks_.size(); ++i) {
      training[i] = held[system_.mark_of(i)] && system_.mark_of(i) % folds == fold ? 0 : training[i];
    }
    LookUnknowns at = at_;
    if (!Solve(training, RobustLoss::kNone, at)) {
      return false;
    }
    std::vector<Eigen::Vector3d> sum_before(system_.mark_count(), Eigen::Vector3d::Zero());  // x, y, count
    std::vector<Eigen::Vector3d> sum_after = sum_before;
    for (std::size_t i = 0; i < looks_.size(); ++i) {
      if (at_rest[i] && !training[i]) {
        sum_before[system_.mark_of(i)] += Eigen::Vector3d(before_mm_[i].x(), before_mm_[i].y(), 1.0);
        sum_after[system_.mark_of(i)] +=
            Eigen::Vector3d(system_.row(i).miss_mm.x(), system_.row(i).miss_mm.y(), 1.0);
      }
    }
    for (std::size_t m = 0; m < sum_after.size(); ++m) {
      if (sum_after[m].z() > 0.0) {
        before += (sum_before[m].head<2>() / sum_before[m].z()).squaredNorm();
        after += (sum_after[m].head<2>() / sum_after[m].z()).squaredNorm();
        ++found_.held_out;
      }
    }
  }
  const double readings = 2.0 * static_cast<double>(found_.held_out);
  found_.hold_out_before_mm = std::sqrt(before / readings);
  found_.hold_out_after_mm = std::sqrt(after / readings);
  system_.Relinearise(at_.z);
  return system_.Evaluate(at_);
}

void Fit::Account() {
  const std::size_t used = static_cast<std::size_t>(std::count(active_.begin(), active_.end(), 1));
  // A tracking run's deflection at its first picture has so wide a prior that the pictures alone decide it: four numbers a run.
  found_.degrees_of_freedom = 2 * used - std::min(2 * used, 4 * system_.run_count());
  found_.chi_square = SumOfSquares(system_, active_, at_);
  found_.p_value = ChiSquareUpperTail(found_.chi_square, static_cast<double>(found_.degrees_of_freedom));
  if (used > 0 && found_.p_value < kChanceOfInflation) {
    found_.covariance_inflation = found_.chi_square / static_cast<double>(found_.degrees_of_freedom);
  }
  const ParameterCovariance information = InformationOfLooks(system_, active_);
  const ParameterCovariance of_z =
      (ParameterCovariance::Identity() + information).llt().solve(ParameterCovariance::Identity());
  const ParameterCovariance covariance =
      found_.covariance_inflation * (prior_.scale * of_z * prior_.scale.transpose());
  found_.covariance = 0.5 * (covariance + covariance.transpose());
  found_.parameters = prior_.At(at_.z);
  found_.observability = Observe(prior_, information);
  const int lag = At(Parameter::kElasticLagS2);
  const double lag_before = (prior_.scale.row(lag)).squaredNorm();
  found_.elasticity_identified =
      found_.covariance(lag, lag) < kElasticityKnown * kElasticityKnown * lag_before;

  double before = 0.0;
  double after = 0.0;
  for (std::size_t i = 0; i < looks_.size(); ++i) {
    const LookRow& row = system_.row(i);
    found_.residuals.push_back({order_[i], looks_[i].mark, looks_[i].kind, before_mm_[i], row.miss_mm,
                                row.residual.squaredNorm(), !active_[i]});
    before += active_[i] ? before_mm_[i].squaredNorm() : 0.0;
    after += active_[i] ? row.miss_mm.squaredNorm() : 0.0;
  }
  found_.rms_before_mm = std::sqrt(before / std::max(1.0, 2.0 * static_cast<double>(used)));
  found_.rms_after_mm = std::sqrt(after / std::max(1.0, 2.0 * static_cast<double>(used)));
}

void Fit::Judge() {
  const MachineDescription& machine = system_.machine();
  const auto before = PredictPlaces(machine, machine.parameters, machine.covariance, options_.place_columns,
                                    options_.place_rows);
  found_.worst_place_before_mm = WorstRadius95(before);
  found_.places = PredictPlaces(machine, found_.parameters, found_.covariance, options_.place_columns,
                                options_.place_rows);
  found_.worst_place_mm = WorstRadius95(found_.places);
  if (found_.places.empty()) {
    found_.reason = IdentificationReason::kNotObservable;
    found_.explanation =
        "no place of the sheet is within the jet's reach: check sheet_x_mm, sheet_y_mm and the base";
    return;
  }
  if (found_.worst_place_mm > options_.needed_place_mm) {
    found_.reason = IdentificationReason::kNotObservable;
    found_.explanation =
        Text("the jet's place on the sheet stays uncertain by %.3f mm (95 %%), %.3f mm is needed; ",
             found_.worst_place_mm, options_.needed_place_mm);
    found_.explanation += found_.observability.weak.empty()
                              ? "take more looks"
                              : "weakest: " + found_.observability.weak.front().words;
    return;
  }
  found_.reason = IdentificationReason::kIdentified;
  found_.explanation =
      Text("the jet's place on the sheet is known to %.3f mm (95 %%, worst over the sheet; %.3f before)",
           found_.worst_place_mm, found_.worst_place_before_mm);
}

Identification Fit::Stop(IdentificationReason reason, std::string explanation) {
  found_.reason = reason;
  found_.explanation = std::move(explanation);
  return std::move(found_);
}

Identification Fit::Run() {
  found_.parameters = prior_.mean;
  found_.covariance = system_.machine().covariance;
  // Pictures of one tracking run show one place.
  const std::size_t places =
      system_.run_count() +
      static_cast<std::size_t>(std::count_if(
          looks_.begin(), looks_.end(), [](const Measurement& m) { return m.kind != LookKind::kTracking; }));
  if (2 * places < kParameterCount) {
    return Stop(IdentificationReason::kTooFew,
                Text("%zu usable looks give %zu readings for %zu parameters (%zu looks refused); at least "
                     "%zu looks are "
                     "needed",
                     places, 2 * places, kParameterCount, found_.refused.size(), (kParameterCount + 1) / 2));
  }
  if (!system_.Evaluate(at_)) {
    return Stop(IdentificationReason::kNotConverged, "the mechanism cannot be assembled at the readings");
  }
  for (std::size_t i = 0; i < looks_.size(); ++i) {
    before_mm_.push_back(system_.row(i).miss_mm);
  }
  const bool fitted = FitWithoutOutliers() && HoldOut();
  if (end_ == SolveEnd::kCancelled) {
    return Stop(IdentificationReason::kCancelled, "cancelled");
  }
  if (!fitted) {
    return Stop(IdentificationReason::kNotConverged,
                Text("no minimum within %d iterations: the looks contradict the machine file by far more "
                     "than its sigmas",
                     options_.max_iterations));
  }
  Account();
  const double left_out = static_cast<double>(std::count(active_.begin(), active_.end(), 0));
  if (left_out > options_.largest_outlier_share * static_cast<double>(looks_.size())) {
    return Stop(IdentificationReason::kNotConverged,
                Text("%.0f of %zu looks contradict the others, at most %.0f %% may", left_out, looks_.size(),
                     100.0 * options_.largest_outlier_share));
  }
  Judge();
  if (!GoOn(1.0, "done")) {
    return Stop(IdentificationReason::kCancelled, "cancelled");
  }
  return std::move(found_);
}

}  // namespace

std::string_view IdentificationReasonName(IdentificationReason reason) {
  constexpr std::array<std::string_view, 5> kNames = {"IDENTIFIED", "TOO_FEW", "NOT_OBSERVABLE",
                                                      "NOT_CONVERGED", "CANCELLED"};
  return kNames[static_cast<std::size_t>(reason)];
}

Identification Identify(const MachineDescription& machine, const std::vector<Measurement>& run,
                        const IdentificationOptions& options) {
  return Fit(machine, run, options).Run();
}

}  // namespace lambdajet::calibration
