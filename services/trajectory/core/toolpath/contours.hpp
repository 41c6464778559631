// Joins the curves of a drawing to closed contours, nests them into parts with holes, and flags what cannot be cut.
//
// Model: ends that lie within the gap are joined and moved onto each other; whole duplicates are dropped and told, partly
// overlapping pieces refused. A contour inside an odd number of others is a hole, else the outline of a part.
// Frames: the drawing's. Units: mm. Threads: pure. Cost: n log n in the pieces where they are short against the drawing.
// Errors: findings OPEN_CONTOUR, GAP_TOO_WIDE, BRANCHING_CONTOUR, DUPLICATE_ENTITY, CROSSING_CONTOURS, CURVE_NOT_FOLLOWED,
// NO_AREA, NOTHING_TO_CUT, DRAWING_TOO_DENSE, UNKNOWN_UNITS and those the drawing brings along, in mm.
#pragma once

#include <string>
#include <vector>

#include "trajectory/core/toolpath/drawing.hpp"

namespace lambdajet::trajectory {

struct ContourOptions {
  double gap_mm = 0.02;                 // ends this near are joined
  double curve_tolerance_mm = 0.005;    // of ellipses and splines from their arcs
  double unit_mm = 0.0;                 // overrides what the file says; 0: the file's
  std::vector<std::string> cut_layers;  // none: all that are neither ignored nor marks
  std::vector<std::string> ignore_layers;
  std::vector<std::string> mark_layers;  // scribed along the line, closed or not
  std::vector<std::string>
      ignore_types;  // TEXT, DIMENSION, …: what may stand on a cut layer without meaning a cut
};

struct Contour {
  Pieces pieces;  // closed, counter-clockwise; a piece's source is its entity
  std::string layer;
  int depth = 0;    // 0: outside all others
  int parent = -1;  // the contour right around it
  int part = 0;     // number of the part it belongs to, from 1, in the order of the drawing
  bool hole = false;
};

struct ContourSet {
  std::vector<Contour> contours;
  std::vector<Pieces> marks;  // open or closed lines to scribe
  std::vector<Finding> findings;
  int part_count = 0;
  AffineMap placed;  // a turn and a shift, from the drawing, where findings tell their places

  bool blocked() const;
};

ContourSet FindContours(const Drawing& drawing, const ContourOptions& options);

}  // namespace lambdajet::trajectory
