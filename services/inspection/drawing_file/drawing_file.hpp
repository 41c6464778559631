// Reads a drawing from YAML, refusing what it does not know with line and key.
//
// Units: mm and degrees in the file. Shapes: see services/inspection/README.md.
// Threads: pure. Errors: INVALID_ARGUMENT with reason BAD_DRAWING and a field violation for each fault; no exception leaves.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "inspection/core/drawing.hpp"

namespace lambdajet::inspection {

inline constexpr std::size_t kLargestDrawingBytes = 4u << 20;

absl::StatusOr<Drawing> ReadDrawing(const std::string& yaml);

}  // namespace lambdajet::inspection
