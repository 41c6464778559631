// Reads a plan's points from TrajectoryService, for verbs that print them and verbs that predict from them; and takes the options
// that say what a program is written in and how a drawing is cut, for all verbs that send programs.
//
// Shapes: values has stride kPlanPointStride, as SampleBatch in trajectory.proto. Threads: one.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "clients/cli/connections.hpp"
#include "lambdajet/type/v1/program.pb.h"

namespace lambdajet::cli {

inline constexpr std::size_t kPlanPointStride = 12;
inline constexpr std::size_t kSpatialPointStride = 22;

struct PlanPoints {
  std::vector<double> values;
  std::vector<double> spatial_values;  // of a hexapod's plan instead, stride kSpatialPointStride
  std::vector<std::uint32_t> cutting;
  std::vector<std::uint32_t> source_line;
};

struct FormatOptions {
  std::string format = "file";
  type::v1::ToolpathSettings toolpath;
  bool toolpath_given = false;
};

// `options` outlives the parsing.
void AddFormatOptions(CLI::App& verb, FormatOptions& options);

// As the option says, or else as the file's name ends.
type::v1::ProgramFormat FormatOf(const FormatOptions& options, const std::string& file);

absl::Status ReadPlanPoints(const Connections& connections, std::uint64_t plan_id,
                            std::optional<double> step_s, PlanPoints& points);

}  // namespace lambdajet::cli
