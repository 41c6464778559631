// Writes toolpaths as part programs in the G-code of this house, and the drawing a toolpath should give.
//
// Model: absolute millimetres in W with six decimals, arcs by I J from the coordinates as written, so that reading the text
// gives the path to 1e-6 mm; a comment before every part and contour. Frames: W. Threads: pure. Cost: about 1 us a line.
#pragma once

#include <string>
#include <string_view>

#include "trajectory/core/toolpath/toolpath.hpp"

namespace lambdajet::trajectory {

std::string ProgramText(const ContourSet& contours, const Toolpath& toolpath, const ToolpathOptions& options,
                        std::string_view title);

// YAML of the finished geometry, as inspection reads it: every contour that is cut.
std::string ReferenceDrawingText(const ContourSet& contours, const Toolpath& toolpath,
                                 const ToolpathOptions& options, std::string_view name, double tolerance_mm);

}  // namespace lambdajet::trajectory
