// Finds the largest rectangle with sides along the axes inside a region of polygons.
//
// Model: the best rectangle of a raster (largest rectangle under a histogram, row by row) names the place; then bottom, top
// and middle are moved by a shrinking pattern search in which left and right follow exactly from the polygons. The result
// lies inside the polygons; it is the largest near the raster's best.
// Units: mm. Threads: pure. Cost: some 10 ms for outlines of a thousand vertices.
#pragma once

#include <span>

#include "kinematics/core/workspace.hpp"

namespace lambdajet::kinematics {

// Outer outlines counter-clockwise, holes clockwise; an empty rectangle if there is no inside.
Rectangle LargestRectangle(std::span<const Outline> outlines);

}  // namespace lambdajet::kinematics
