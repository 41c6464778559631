#include "simulated_plant/core/sheet_truth.hpp"

#include <algorithm>

namespace lambdajet::simulated_plant {

std::optional<PlanarPose> SheetTruthHistory::PoseAt(std::int64_t time_ns) const {
  const std::size_t known = std::min(count_, ring_.size());
  if (known == 0 || time_ns > newest_ns()) {
    return std::nullopt;
  }
  // Newest first: what is asked for is recent.
  for (std::size_t back = 1; back <= known; ++back) {
    const SheetSample& a = ring_[(count_ - back) % ring_.size()];
    if (a.time_ns > time_ns) {
      continue;
    }
    if (back == 1 || a.time_ns == time_ns) {
      return a.X_DW;
    }
    const SheetSample& b = ring_[(count_ - back + 1) % ring_.size()];
    const double u = static_cast<double>(time_ns - a.time_ns) / static_cast<double>(b.time_ns - a.time_ns);
    return PlanarPose{a.X_DW.x_mm + u * (b.X_DW.x_mm - a.X_DW.x_mm),
                      a.X_DW.y_mm + u * (b.X_DW.y_mm - a.X_DW.y_mm),
                      a.X_DW.theta_rad + u * (b.X_DW.theta_rad - a.X_DW.theta_rad)};
  }
  return std::nullopt;
}

}  // namespace lambdajet::simulated_plant
