// Reads a DXF drawing into exact curves, insertions exploded, with a finding for everything that is no contour.
//
// Model: LINE, ARC, CIRCLE, LWPOLYLINE and POLYLINE with bulges, ELLIPSE, SPLINE (B-spline, rational too), INSERT (nested,
// scaled, mirrored, turned, arrayed), $INSUNITS, layers; "0" in a block is the layer of its insertion. libdime takes the
// groups apart, behind a guard of our own (drawing/dxf_guard). Frames: the drawing's X and Y; what does not lie in a plane
// of constant Z is refused. Units: the file's; Drawing::unit_mm says which. Threads: pure. Cost: about 0.5 us a group.
// Errors: findings, those of dxf_guard and UNKNOWN_BLOCK, BLOCK_TOO_DEEP, DXF_TOO_LARGE, ENTITY_NOT_IN_PLANE, ENTITY_TOO_FAR,
// BAD_CURVE; told without blocking: LAYER_HIDDEN, NO_LENGTH. Nothing is thrown and nothing is skipped without being told.
#pragma once

#include <string_view>

#include "trajectory/core/toolpath/drawing.hpp"

namespace lambdajet::trajectory {

Drawing ReadDxf(std::string_view file);

}  // namespace lambdajet::trajectory
