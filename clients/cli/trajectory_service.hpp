// Reads a plan's points from TrajectoryService, for verbs that print them and verbs that predict from them.
//
// Shapes: values has stride kPlanPointStride, as SampleBatch in trajectory.proto. Threads: one.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "clients/cli/connections.hpp"

namespace lambdajet::cli {

inline constexpr std::size_t kPlanPointStride = 12;

struct PlanPoints {
  std::vector<double> values;
  std::vector<std::uint32_t> cutting;
  std::vector<std::uint32_t> source_line;
};

absl::Status ReadPlanPoints(const Connections& connections, std::uint64_t plan_id,
                            std::optional<double> step_s, PlanPoints& points);

}  // namespace lambdajet::cli
