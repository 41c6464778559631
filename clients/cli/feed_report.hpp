// Says what limits the feed of a plan, whatever machine it is for.
//
// Units: in the names. Threads: pure but for the output.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "clients/cli/output.hpp"
#include "trajectory/core/feed/speed_profile.hpp"

namespace lambdajet::cli {

void TellFeed(const std::vector<trajectory::BindingLength>& binding,
              const std::vector<trajectory::SlowStretch>& slow, Output& output);
nlohmann::json BindingJson(const std::vector<trajectory::BindingLength>& binding);
nlohmann::json SlowJson(const std::vector<trajectory::SlowStretch>& slow);

}  // namespace lambdajet::cli
