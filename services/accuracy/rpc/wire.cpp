#include "accuracy/rpc/wire.hpp"

#include <string>

#include "platform/rpc/argument_checks.hpp"

namespace lambdajet::accuracy {
namespace {

constexpr int kPlanStride = 8;
constexpr double kLargestMm = 1e6;

std::string Word(std::string_view text) { return std::string(text); }

std::vector<PlanSample> SamplesFromWire(const v1::PredictContourRequest& request) {
  std::vector<PlanSample> samples(static_cast<std::size_t>(request.cutting_size()));
  for (int i = 0; i < request.cutting_size(); ++i) {
    const double* v = request.values().data() + kPlanStride * i;
    samples[static_cast<std::size_t>(i)] = {
        v[0], v[1], v[2], v[3], v[4], v[5], v[6], v[7], request.cutting(i) != 0, request.source_line(i)};
  }
  return samples;
}

}  // namespace

absl::StatusOr<PredictQuestion> FromWire(const v1::PredictContourRequest& request) {
  ArgumentChecks checks;
  const auto points = static_cast<std::size_t>(request.cutting_size());
  checks.CountInRange("cutting", points, 2, kMostPlanPoints);
  checks.Require(static_cast<std::size_t>(request.values_size()) == kPlanStride * points, "values",
                 "WRONG_COUNT",
                 std::to_string(request.values_size()) + " numbers; must be 8 for each of " +
                     std::to_string(points) + " points");
  checks.Require(static_cast<std::size_t>(request.source_line_size()) == points, "source_line", "WRONG_COUNT",
                 std::to_string(request.source_line_size()) + " lines; must be one for each of " +
                     std::to_string(points) + " points");
  checks.AllFinite("values", request.values());
  checks.CountInRange("draws", request.draws(), 0, static_cast<std::size_t>(kMostDraws));
  if (request.has_tolerance_mm()) {
    checks.Positive("tolerance_mm", request.tolerance_mm(), "mm");
  }
  if (!checks.ok()) {
    return checks.status();
  }
  PredictQuestion question;
  question.samples = SamplesFromWire(request);
  question.compensated = request.compensated();
  question.options.draws = request.has_draws() ? static_cast<int>(request.draws()) : question.options.draws;
  question.options.seed = request.has_seed() ? request.seed() : question.options.seed;
  question.options.tolerance_mm = request.tolerance_mm();
  return question;
}

absl::StatusOr<BudgetQuestion> FromWire(const v1::BudgetRequest& request) {
  ArgumentChecks checks;
  checks.CountInRange("shift_mm", static_cast<std::size_t>(request.shift_mm_size()), 4, 4);
  checks.AllFinite("shift_mm", request.shift_mm());
  checks.InRange("alpha_rad", request.alpha_rad(), -1.6, 1.6, "rad");
  checks.InRange("beta_rad", request.beta_rad(), -1.6, 1.6, "rad");
  checks.InRange("radius_a_mm", request.radius_a_mm(), 0.0, kLargestMm, "mm");
  checks.InRange("radius_b_mm", request.radius_b_mm(), 0.0, kLargestMm, "mm");
  checks.InRange("drive_mm", request.drive_mm(), 0.0, kLargestMm, "mm");
  checks.InRange("jet_mm", request.jet_mm(), 0.0, kLargestMm, "mm");
  for (const double shift : request.shift_mm()) {
    checks.InRange("shift_mm", shift, -kLargestMm, kLargestMm, "mm");
  }
  if (!checks.ok()) {
    return checks.status();
  }
  BudgetQuestion question;
  for (int i = 0; i < 4; ++i) {
    question.shares.shift_mm[static_cast<std::size_t>(i)] = request.shift_mm(i);
  }
  question.shares.alpha_rad = request.alpha_rad();
  question.shares.beta_rad = request.beta_rad();
  question.shares.radius_a_mm = request.radius_a_mm();
  question.shares.radius_b_mm = request.radius_b_mm();
  question.drive_mm = request.drive_mm();
  question.jet_mm = request.jet_mm();
  return question;
}

absl::StatusOr<ErrorMapOptions> FromWire(const v1::ErrorMapRequest& request) {
  ErrorMapOptions options;
  ArgumentChecks checks;
  if (request.has_columns()) {
    checks.CountInRange("columns", request.columns(), 2, 400);
    options.columns = static_cast<int>(request.columns());
  }
  if (request.has_rows()) {
    checks.CountInRange("rows", request.rows(), 2, 400);
    options.rows = static_cast<int>(request.rows());
  }
  checks.InRange("acceleration_mm_per_s2", request.acceleration_mm_per_s2(), 0.0, 1e5, "mm/s^2");
  options.acceleration_mm_per_s2 = request.acceleration_mm_per_s2();
  options.compensated = request.compensated();
  if (!checks.ok()) {
    return checks.status();
  }
  return options;
}

void ToWire(const MachineDescription& machine, machine::v1::ModelVersion& wire) {
  wire.set_machine_id(machine.machine_id);
  wire.set_version(machine.version);
  wire.set_hash(machine.hash);
}

void ToWire(const ContourPrediction& prediction, v1::PredictContourResponse& wire) {
  wire.set_reason(Word(Name(prediction.reason)));
  wire.set_blame_line(prediction.blame_line);
  wire.set_predicted_95_mm(prediction.predicted_95_mm);
  wire.set_predicted_95_linear_mm(prediction.predicted_95_linear_mm);
  wire.set_expected_95_mm(prediction.expected_95_mm);
  wire.set_conformity(prediction.conformity);
  for (const SourceShare& share : prediction.budget) {
    v1::SourceShare& to = *wire.add_budget();
    to.set_source(Word(SourceName(share.source)));
    to.set_contribution_95_mm(share.contribution_95_mm);
    to.set_share(share.share);
  }
  for (const PredictedPoint& point : prediction.worst) {
    v1::WorstPlace& to = *wire.add_worst();
    to.set_source_line(point.source_line);
    to.set_x_w_mm(point.p_W_mm.x());
    to.set_y_w_mm(point.p_W_mm.y());
    to.set_bound_95_mm(point.bound_95_mm);
    to.set_source(Word(SourceName(point.dominant)));
  }
  for (const FeaturePrediction& feature : prediction.features) {
    v1::FeaturePrediction& to = *wire.add_features();
    to.set_feature(feature.feature);
    to.set_first_line(feature.first_line);
    to.set_last_line(feature.last_line);
    to.set_length_mm(feature.length_mm);
    to.set_predicted_95_mm(feature.predicted_95_mm);
    to.set_conformity(feature.conformity);
  }
  for (const PredictedPoint& p : prediction.points) {
    for (const double v : {p.s_mm, p.p_W_mm.x(), p.p_W_mm.y(), p.bias_mm, p.sigma_mm, p.bound_95_mm}) {
      wire.add_points(v);
    }
  }
}

void ToWire(const std::vector<PlaceError>& map, const std::vector<ParameterShare>& ranking,
            const ErrorMapOptions& options, v1::ErrorMapResponse& wire) {
  wire.set_columns(static_cast<std::uint32_t>(options.columns));
  wire.set_rows(static_cast<std::uint32_t>(options.rows));
  wire.mutable_values()->Reserve(static_cast<int>(4 * map.size()));
  for (const PlaceError& place : map) {
    wire.add_values(place.p_W_mm.x());
    wire.add_values(place.p_W_mm.y());
    wire.add_values(place.valid ? place.sigma_mm : -1.0);
    wire.add_values(place.valid ? place.bound_95_mm : -1.0);
    wire.set_mean_mm(place.valid ? place.mean_mm : wire.mean_mm());
  }
  for (const ParameterShare& share : ranking) {
    v1::ParameterShare& to = *wire.add_parameters();
    to.set_parameter(Word(ParameterName(share.parameter)));
    to.set_sensitivity(share.sensitivity);
    to.set_contribution_mm(share.contribution_mm);
  }
}

}  // namespace lambdajet::accuracy
