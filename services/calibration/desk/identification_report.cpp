#include "calibration/desk/identification_report.hpp"

#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "foundation/contract/trouble.hpp"

namespace lambdajet::calibration {
namespace {

// One list of fields for both ways.
template <typename Visit>
void EachField(IdentificationReport& r, Visit&& visit) {
  visit("version", r.version);
  visit("rms_before_mm", r.rms_before_mm);
  visit("rms_after_mm", r.rms_after_mm);
  visit("rms_hold_out_mm", r.rms_hold_out_mm);
  visit("chi_square", r.chi_square);
  visit("degrees_of_freedom", r.degrees_of_freedom);
  visit("p_value", r.p_value);
  visit("covariance_inflation", r.covariance_inflation);
  visit("rank", r.rank);
  visit("condition", r.condition);
  visit("weak_directions", r.weak_directions);
  visit("outliers", r.outliers);
  visit("place_bound_95_mm", r.place_bound_95_mm);
  visit("place_bound_before_95_mm", r.place_bound_before_95_mm);
  visit("stiffness_n_per_mm", r.stiffness_n_per_mm);
  visit("elasticity_identified", r.elasticity_identified);
  visit("explanation", r.explanation);
}

std::string Words(const LookResidual& r) {
  char text[160];
  std::snprintf(text, sizeof text, "%s look at mark %d: off by x %+.3f, y %+.3f mm",
                std::string(KindName(r.kind)).c_str(), r.mark, r.after_mm.x(), r.after_mm.y());
  return text;
}

}  // namespace

IdentificationReport ReportOf(const Identification& found, const MachineDescription& machine,
                              std::uint32_t version) {
  IdentificationReport r;
  r.version = version;
  r.rms_before_mm = found.rms_before_mm;
  r.rms_after_mm = found.rms_after_mm;
  r.rms_hold_out_mm = found.hold_out_after_mm;
  r.chi_square = found.chi_square;
  r.degrees_of_freedom = static_cast<std::uint32_t>(found.degrees_of_freedom);
  r.p_value = found.p_value;
  r.covariance_inflation = found.covariance_inflation;
  r.rank = static_cast<std::uint32_t>(found.observability.rank);
  r.condition = found.observability.condition;
  for (const std::string& gauge : found.observability.gauges) {
    r.weak_directions.push_back("free choice: " + gauge);
  }
  for (const WeakDirection& weak : found.observability.weak) {
    r.weak_directions.push_back(weak.words);
  }
  for (const LookResidual& residual : found.residuals) {
    if (residual.outlier) {
      r.outliers.push_back(Words(residual));
    }
  }
  r.place_bound_95_mm = found.worst_place_mm;
  r.place_bound_before_95_mm = found.worst_place_before_mm;
  MachineDescription identified = machine;
  identified.parameters = found.parameters;
  const double stiffness = identified.stiffness_n_per_mm();
  r.stiffness_n_per_mm = std::isfinite(stiffness) ? stiffness : 0.0;
  r.elasticity_identified = found.elasticity_identified;
  r.explanation = found.explanation;
  return r;
}

std::string ReportToText(const IdentificationReport& report) {
  nlohmann::json json;
  IdentificationReport copy = report;
  EachField(copy, [&json](const char* key, const auto& value) { json[key] = value; });
  return json.dump();
}

absl::StatusOr<IdentificationReport> ReportFromText(const std::string& text) {
  IdentificationReport report;
  try {
    const nlohmann::json json = nlohmann::json::parse(text);
    EachField(report, [&json](const char* key, auto& value) { json.at(key).get_to(value); });
  } catch (const nlohmann::json::exception& error) {
    return Trouble(absl::StatusCode::kDataLoss, "STORE_DAMAGED",
                   std::string("an identification's report: ") + error.what());
  }
  return report;
}

}  // namespace lambdajet::calibration
