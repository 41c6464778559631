// Says what limits the feed of a plan: the same words and table for a plan made here and for one that the service has.
//
// Units: in the names. Threads: pure but for the output.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "clients/cli/output.hpp"

namespace lambdajet::cli {

struct LimitedLength {
  std::string limit;
  double length_mm = 0.0;
};

// Where the programmed feed is not held.
struct SlowPlace {
  std::uint32_t line = 0;
  double from_s_mm = 0.0;
  double to_s_mm = 0.0;
  double programmed_mm_per_s = 0.0;
  double lowest_mm_per_s = 0.0;
  std::string limit;
  // Measured on the plan; not of a hexapod's.
  struct Reached {
    std::string nearest;
    double reached_share = 0.0;
    double at_s_mm = 0.0;
    double share = 0.0;
  };
  std::optional<Reached> reached;
};

struct FeedReport {
  std::vector<LimitedLength> lengths;
  std::vector<SlowPlace> slow;
  std::size_t slow_count = 0;  // as many there are, `slow` may be the first of them
};

void TellFeed(const FeedReport& report, Output& output);

}  // namespace lambdajet::cli
