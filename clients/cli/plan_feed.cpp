#include "clients/cli/plan_feed.hpp"

#include <nlohmann/json.hpp>

namespace lambdajet::cli {

FeedReport FeedOf(const std::vector<trajectory::BindingLength>& binding,
                  const std::vector<trajectory::SlowStretch>& slow) {
  FeedReport report;
  for (const auto& b : binding) {
    report.lengths.push_back({std::string(FeedLimitName(b.limit)), b.length_mm});
  }
  for (const auto& s : slow) {
    SlowPlace place{s.line,
                    s.from_s_mm,
                    s.to_s_mm,
                    s.programmed_mm_per_s,
                    s.lowest_mm_per_s,
                    std::string(FeedLimitName(s.limit)),
                    std::nullopt};
    if (s.reached_share > 0.0) {
      place.reached = {std::string(FeedLimitName(s.nearest)), s.reached_share, s.at_s_mm, s.share};
    }
    report.slow.push_back(std::move(place));
  }
  report.slow_count = slow.size();
  return report;
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
    nlohmann::json& one = all.emplace_back();
    one = {{"line", s.line},
           {"limit", std::string(FeedLimitName(s.limit))},
           {"from_s_mm", s.from_s_mm},
           {"to_s_mm", s.to_s_mm},
           {"programmed_mm_per_s", s.programmed_mm_per_s},
           {"lowest_mm_per_s", s.lowest_mm_per_s}};
    if (s.reached_share > 0.0) {  // measured
      one.update({{"nearest", std::string(FeedLimitName(s.nearest))},
                  {"reached_share", s.reached_share},
                  {"at_s_mm", s.at_s_mm},
                  {"share", s.share}});
    }
  }
  return all;
}

}  // namespace lambdajet::cli
