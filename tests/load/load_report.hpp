// Says what a load run measured: a table, JSON, and one HTML page with the percentiles drawn.
//
// Threads: one. Errors: the file's, with reason REPORT_NOT_WRITTEN.
#pragma once

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "tests/load/open_loop.hpp"

namespace lambdajet::load {

std::string ToText(const Measured& measured);
std::string ToJson(const std::vector<Measured>& runs);
absl::Status WriteHtml(const std::string& path, const std::vector<Measured>& runs);

}  // namespace lambdajet::load
