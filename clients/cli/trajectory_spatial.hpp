// Checks, plans, draws and plays part programs for a hexapod: what `lambdajet trajectory check|plan|draw --hexapod FILE` and
// `lambdajet trajectory play` do.
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
  std::string out;               // plan: CSV
  std::string picture;           // draw, play
  std::string colour = "speed";  // draw: "speed" or "limit"
  double step_s = 0.004;         // plan: distance of the CSV's points
  double feed_scale = 1.0;
  double rate_hz = 10000.0;  // play
};

absl::Status CheckSpatial(const SpatialVerb& verb, Output& output);
absl::Status PlanSpatial(const SpatialVerb& verb, Output& output);
absl::Status DrawSpatial(const SpatialVerb& verb, Output& output);
// Cycle by cycle through the forward kinematics, against the program's own words; with `picture` one.
absl::Status PlaySpatial(const SpatialVerb& verb, Output& output);

}  // namespace lambdajet::cli
