#include "calibration/core/version.hpp"

#include <algorithm>
#include <cmath>

namespace lambdajet::calibration {

std::string_view ParameterUnit(Parameter parameter) {
  const std::string_view name = ParameterName(parameter);
  return name.substr(name.rfind('_') + 1);
}

std::vector<ParameterChange> Compare(const Version& before, const Version& after) {
  std::vector<ParameterChange> changes;
  for (int i = 0; i < kAll; ++i) {
    changes.push_back({static_cast<Parameter>(i), before.parameters[i],
                       std::sqrt(std::max(0.0, before.covariance(i, i))), after.parameters[i],
                       std::sqrt(std::max(0.0, after.covariance(i, i)))});
  }
  return changes;
}

Drift DriftBetween(const MachineDescription& machine, const Version& before, const Version& after) {
  Drift drift;
  const auto places = PredictPlaces(machine, before.parameters, before.covariance + after.covariance);
  for (const PlaceAccuracy& place : places) {
    const auto miss = JetMiss(machine, before.parameters, after.parameters, place.p_W_mm);
    const double length = miss ? miss->norm() : 0.0;
    drift.mean_mm += length / static_cast<double>(places.size());
    if (length >= drift.largest_mm) {
      drift.largest_mm = length;
      drift.expected_95_mm = place.radius_95_mm;
    }
  }
  return drift;
}

std::optional<std::uint32_t> RollBackTarget(const std::vector<Version>& versions, std::uint32_t active) {
  const auto numbered = [&versions](std::uint32_t number) {
    return std::find_if(versions.begin(), versions.end(),
                        [number](const Version& v) { return v.number == number; });
  };
  const auto now = numbered(active);
  if (active == 0 || now == versions.end() || numbered(now->parent) == versions.end()) {
    return std::nullopt;
  }
  return now->parent;
}

}  // namespace lambdajet::calibration
