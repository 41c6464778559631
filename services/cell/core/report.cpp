#include "cell/core/report.hpp"

#include <algorithm>
#include <cmath>

#include "foundation/contract/expects.hpp"

namespace lambdajet::cell {

double Percentile(std::vector<double> values, double share) {
  Expects(share > 0.0 && share <= 1.0, "a percentile's share lies in (0, 1]");
  if (values.empty()) {
    return 0.0;
  }
  const auto rank = static_cast<std::size_t>(std::ceil(share * static_cast<double>(values.size())));
  const auto place = values.begin() + static_cast<std::ptrdiff_t>(std::max<std::size_t>(rank, 1) - 1);
  std::nth_element(values.begin(), place, values.end());
  return *place;
}

DeviationSummary Summarise(const std::vector<EventDeviation>& events) {
  std::vector<double> deviations;
  std::vector<double> ages;
  for (const EventDeviation& event : events) {
    if (event.s_rate_mm_per_s >= kMotion_mm_per_s) {
      deviations.push_back(std::abs(event.deviation_mm));
      ages.push_back(event.message_age_s);
    }
  }
  return {Percentile(deviations, 0.5), Percentile(deviations, 0.99), Percentile(ages, 0.5),
          Percentile(ages, 0.99)};
}

}  // namespace lambdajet::cell
