// Plans and draws part programs for a hexapod: what `lambdajet trajectory plan|draw --hexapod FILE` does.
//
// Threads: one. Errors: those of the files; faults of the program are told as by the other verbs, exit code of a refusal.
#pragma once

#include <string>

#include "absl/status/status.h"
#include "clients/cli/output.hpp"

namespace lambdajet::cli {

struct SpatialVerb {
  std::string program;
  std::string hexapod;           // YAML file
  std::string out;               // plan: CSV; draw: picture
  std::string colour = "speed";  // draw: "speed" or "limit"
  double step_s = 0.004;         // plan: distance of the CSV's points
  double feed_scale = 1.0;
};

absl::Status PlanSpatial(const SpatialVerb& verb, Output& output);
absl::Status DrawSpatial(const SpatialVerb& verb, Output& output);

}  // namespace lambdajet::cli
