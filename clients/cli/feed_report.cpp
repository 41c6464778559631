#include "clients/cli/feed_report.hpp"

#include <algorithm>

namespace lambdajet::cli {

namespace {

constexpr std::size_t kMostTold = 20;
constexpr double kFullPercent = 100.0;

// How near the plan comes to the limit that is named, or to the nearest where none is reached.
std::string ReachedText(const SlowPlace& place) {
  return place.reached
             ? Fixed(kFullPercent * place.reached->reached_share, 1) + " % of " + place.reached->nearest
             : "";
}

}  // namespace

void TellFeed(const FeedReport& report, Output& output) {
  double total_mm = 0.0;
  for (const LimitedLength& length : report.lengths) {
    total_mm += length.length_mm;
  }
  TextTable lengths{{"what limits the feed", "mm", "%"}, {}};
  for (const LimitedLength& length : report.lengths) {
    lengths.rows.push_back({length.limit, Fixed(length.length_mm, 1),
                            Fixed(total_mm > 0.0 ? kFullPercent * length.length_mm / total_mm : 0.0, 1)});
  }
  output.Table(lengths);
  if (report.slow.empty()) {
    return;
  }
  TextTable stretches{{"line", "from s mm", "to s mm", "programmed mm/s", "lowest mm/s", "because", "reaches",
                       "at s mm", "over %"},
                      {}};
  for (std::size_t i = 0; i < std::min(report.slow.size(), kMostTold); ++i) {
    const SlowPlace& s = report.slow[i];
    stretches.rows.push_back({std::to_string(s.line), Fixed(s.from_s_mm, 1), Fixed(s.to_s_mm, 1),
                              Fixed(s.programmed_mm_per_s, 1), Fixed(s.lowest_mm_per_s, 1), s.limit,
                              ReachedText(s), s.reached ? Fixed(s.reached->at_s_mm, 1) : "",
                              s.reached ? Fixed(kFullPercent * s.reached->share, 0) : ""});
  }
  output.Text("where the programmed feed is not held (first " + std::to_string(stretches.rows.size()) +
              " of " + std::to_string(report.slow_count) + "):");
  output.Table(stretches);
}

}  // namespace lambdajet::cli
