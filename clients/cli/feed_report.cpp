#include "clients/cli/feed_report.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string>

namespace lambdajet::cli {

namespace {

// What binds; where nothing does, what the plan comes nearest to.
std::string Because(const trajectory::SlowStretch& s) {
  const std::string limit(FeedLimitName(s.limit));
  return s.limit == trajectory::FeedLimit::kSmoothing ? limit + ", at " + Fixed(100.0 * s.reached_share, 0) +
                                                            " % of " + std::string(FeedLimitName(s.nearest))
                                                      : limit;
}

}  // namespace

void TellFeed(const std::vector<trajectory::BindingLength>& binding,
              const std::vector<trajectory::SlowStretch>& slow, Output& output) {
  constexpr std::size_t kMostTold = 20;
  TextTable lengths{{"what limits the feed", "mm"}, {}};
  for (const auto& b : binding) {
    lengths.rows.push_back({std::string(FeedLimitName(b.limit)), Fixed(b.length_mm, 1)});
  }
  output.Table(lengths);
  if (slow.empty()) {
    return;
  }
  TextTable stretches{{"line", "from s mm", "to s mm", "programmed mm/s", "lowest mm/s", "because"}, {}};
  for (std::size_t i = 0; i < std::min(slow.size(), kMostTold); ++i) {
    const auto& s = slow[i];
    stretches.rows.push_back({std::to_string(s.line), Fixed(s.from_s_mm, 1), Fixed(s.to_s_mm, 1),
                              Fixed(s.programmed_mm_per_s, 1), Fixed(s.lowest_mm_per_s, 1), Because(s)});
  }
  output.Text("where the programmed feed is not held (first " + std::to_string(stretches.rows.size()) +
              " of " + std::to_string(slow.size()) + "):");
  output.Table(stretches);
}

nlohmann::json BindingJson(const std::vector<trajectory::BindingLength>& binding) {
  nlohmann::json all = nlohmann::json::array();
  for (const auto& b : binding) {
    all.push_back({{"limit", std::string(FeedLimitName(b.limit))}, {"length_mm", b.length_mm}});
  }
  return all;
}

nlohmann::json SlowJson(const std::vector<trajectory::SlowStretch>& slow) {
  nlohmann::json all = nlohmann::json::array();
  for (const auto& s : slow) {
    all.push_back({{"line", s.line},
                   {"limit", std::string(FeedLimitName(s.limit))},
                   {"from_s_mm", s.from_s_mm},
                   {"to_s_mm", s.to_s_mm},
                   {"programmed_mm_per_s", s.programmed_mm_per_s},
                   {"lowest_mm_per_s", s.lowest_mm_per_s},
                   {"nearest", std::string(FeedLimitName(s.nearest))},
                   {"reached_share", s.reached_share},
                   {"at_s_mm", s.at_s_mm},
                   {"share", s.share}});
  }
  return all;
}

}  // namespace lambdajet::cli
