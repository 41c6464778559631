// Keeps the order of a machine's versions: who follows whom, what changed, and whether the base drifts.
//
// Model: version 0 is as designed; each identification that holds makes one more, child of the version that was active when
// its looks were taken; activating chooses which version all services use, and rolling back activates the active one's
// parent.
// Drift: the change of the jet's place on the sheet between two versions, against the covariance of both.
// Units: the parameters' own; mm.
// Threads: values.
// Cost: nothing to speak of.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "calibration/core/place_accuracy.hpp"

namespace lambdajet::calibration {

struct Version {
  std::uint32_t number = 0;
  std::uint32_t parent = 0;
  std::string author;
  std::int64_t created_utc_ns = 0;
  std::int64_t valid_until_utc_ns = 0;  // 0: until another is activated
  std::uint64_t run = 0;                // plan of the measuring run; 0 as designed
  std::string hash;
  ParameterVector parameters = ParameterVector::Zero();
  ParameterCovariance covariance = ParameterCovariance::Zero();
};

// Unit of a parameter, from the end of its name: "mm", "rad", "s", "s2".
std::string_view ParameterUnit(Parameter parameter);

struct ParameterChange {
  Parameter parameter = Parameter::kCount;
  double before = 0.0;
  double before_sigma = 0.0;
  double after = 0.0;
  double after_sigma = 0.0;
};

std::vector<ParameterChange> Compare(const Version& before, const Version& after);

struct Drift {
  double mean_mm = 0.0;  // of the jet's place on the sheet, over the sheet
  double largest_mm = 0.0;
  double expected_95_mm = 0.0;  // what both covariances allow at that place
};

// How far the jet lands from where `after` puts it when driven with `before`.
Drift DriftBetween(const MachineDescription& machine, const Version& before, const Version& after);

// The version to go back to from `active`; none from version 0 or with a parent that is not kept.
std::optional<std::uint32_t> RollBackTarget(const std::vector<Version>& versions, std::uint32_t active);

}  // namespace lambdajet::calibration
