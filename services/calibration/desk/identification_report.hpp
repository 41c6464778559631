// What is kept of an identification for people and machines, and how it is written down.
//
// Units: in the names.
// Threads: values.
// Errors: DATA_LOSS STORE_DAMAGED for a text that ReportToText has not written.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "calibration/core/identification.hpp"

namespace lambdajet::calibration {

struct IdentificationReport {
  std::uint32_t version = 0;  // it made
  double rms_before_mm = 0.0;
  double rms_after_mm = 0.0;
  double rms_hold_out_mm = 0.0;
  double chi_square = 0.0;
  std::uint32_t degrees_of_freedom = 0;
  double p_value = 1.0;
  double covariance_inflation = 1.0;
  std::uint32_t rank = 0;
  double condition = 0.0;
  std::vector<std::string> weak_directions;  // gauges first
  std::vector<std::string> outliers;
  double place_bound_95_mm = 0.0;
  double place_bound_before_95_mm = 0.0;
  double stiffness_n_per_mm = 0.0;
  bool elasticity_identified = false;
  std::string explanation;
};

IdentificationReport ReportOf(const Identification& found, const MachineDescription& machine,
                              std::uint32_t version);

std::string ReportToText(const IdentificationReport& report);  // JSON
absl::StatusOr<IdentificationReport> ReportFromText(const std::string& text);

}  // namespace lambdajet::calibration
