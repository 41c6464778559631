// Writes toolpaths and operations as part programs in the G-code of this house, and the drawing a toolpath should give.
//
// Model: absolute millimetres in W with six decimals, arcs by I J from the coordinates as written, so that reading the text
// gives the path to 1e-6 mm; a comment before every part and contour. Frames: W. Threads: pure. Cost: about 1 us a line.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "trajectory/core/part_program/operation.hpp"
#include "trajectory/core/toolpath/toolpath.hpp"

namespace lambdajet::trajectory {

std::string ProgramText(const ContourSet& contours, const Toolpath& toolpath, const ToolpathOptions& options,
                        std::string_view title);

// YAML of the finished geometry, as inspection reads it: every contour that is cut.
std::string ReferenceDrawingText(const ContourSet& contours, const Toolpath& toolpath,
                                 const ToolpathOptions& options, std::string_view name, double tolerance_mm);

// Operations as a program of their own: absolute millimetres in W, whatever units, offsets and modes they came from. Nothing
// where one of them has no such words: arcs outside G17. Motions that carry a kerf offset stand between G41.1 or G42.1 and G40.
std::optional<std::string> OperationsText(const std::vector<Operation>& operations, std::string_view title);

}  // namespace lambdajet::trajectory
