// Takes what a plan of the core knows of its feed for the report that people read and for JSON.
//
// Units: in the names. Threads: pure.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "clients/cli/feed_report.hpp"
#include "trajectory/core/feed/speed_profile.hpp"

namespace lambdajet::cli {

FeedReport FeedOf(const std::vector<trajectory::BindingLength>& binding,
                  const std::vector<trajectory::SlowStretch>& slow);
nlohmann::json BindingJson(const std::vector<trajectory::BindingLength>& binding);
nlohmann::json SlowJson(const std::vector<trajectory::SlowStretch>& slow);

}  // namespace lambdajet::cli
