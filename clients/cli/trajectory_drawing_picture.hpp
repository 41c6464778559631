// Draws a toolpath over its drawing: contours, compensated path, leads, pierces, order, idle moves, and what was found wrong.
//
// Frames: W. Units: mm. Threads: one. Errors: those of picture.hpp.
#pragma once

#include <string>

#include "absl/status/status.h"
#include "trajectory/core/toolpath/toolpath.hpp"

namespace lambdajet::cli {

absl::Status DrawToolpath(const trajectory::ContourSet& contours, const trajectory::Toolpath& toolpath,
                          const trajectory::ToolpathOptions& options, const std::string& path);

}  // namespace lambdajet::cli
