// Makes the toolpath of a drawing: compensated cuts with leads, pierces and tabs, in the order they are cut.
//
// Model: every contour is moved by half the kerf to its waste side (outlines outside, holes inside) and checked against all
// contours of the drawing; a lead comes from a pierce in the waste and touches the path tangentially (arc) or at an angle
// (line), on a straight or convex place where there is one, and is no nearer to any contour than the path itself; at the end
// the path overlaps its start and leads out, with the jet off on the way. A tab is a stretch that is not cut: the jet is off
// over the tab's length and one kerf. Outlines of skipped parts are still kept clear of.
// Frames: W. Units: mm, mm/s, rad. Threads: pure. Cost: n log n in the pieces, and OrderCuts.
// Errors: findings KERF_GOUGE, RADIUS_BELOW_KERF, NO_ROOM_FOR_LEAD, NO_SUCH_PART; told without blocking: INNER_CORNER_ROUNDED,
// LEAD_SHORTENED, NO_ROOM_FOR_TAB. Their places are the drawing's, not those of placed contours.
#pragma once

#include <string>
#include <vector>

#include "trajectory/core/toolpath/contours.hpp"

namespace lambdajet::trajectory {

enum class LeadKind { kNone, kLine, kArc };
// Stationary: standing until the sheet is through. Moving: along the lead, slowly. Pre-pierced: there is a hole already.
enum class PierceKind { kStationary, kMoving, kPrePierced };

struct ToolpathOptions {
  double kerf_mm = 0.8;  // width
  LeadKind lead = LeadKind::kArc;
  double lead_mm =
      4.0;  // radius of an arc, length of a line; halved where there is no room, down to one kerf
  double lead_angle_rad = 0.785;  // line: between it and the path
  double overlap_mm = 1.0;
  PierceKind pierce = PierceKind::kStationary;
  double pierce_time_s = 0.0;         // 0: the machine's own
  double pierce_clearance_mm = 0.3;   // how much farther a pierce is from every contour than the path
  double pierce_feed_mm_per_s = 5.0;  // moving pierce
  double feed_mm_per_s = 60.0;
  double mark_feed_mm_per_s = 100.0;
  int tab_count = 0;            // on each outline
  double tab_spacing_mm = 0.0;  // instead of a count, if above 0
  double tab_mm = 0.5;          // what stays of the sheet
  bool shortest_order = true;
  std::vector<int> skip_parts;
  Eigen::Vector2d home_W_mm = Eigen::Vector2d::Zero();  // where the first idle move begins
};

enum class CutKind { kMark, kHole, kOutline };

struct Tab {
  double from_mm = 0.0;  // along the path: where the jet goes off
  double to_mm = 0.0;    // and on
};

struct Cut {
  CutKind kind = CutKind::kOutline;
  int part = 0;
  std::size_t contour = 0;  // of the set; mark: of its marks
  Pieces lead_in;
  Pieces path;  // once around and the overlap
  Pieces lead_out;
  std::vector<Tab> tabs;

  const Eigen::Vector2d& pierce() const {
    return lead_in.empty() ? path.front().from_mm : lead_in.front().from_mm;
  }
  const Eigen::Vector2d& end() const { return lead_out.empty() ? path.back().to_mm : lead_out.back().to_mm; }
};

struct Toolpath {
  std::vector<Cut> cuts;  // in order; none if blocked
  std::vector<Finding> findings;
  double idle_mm = 0.0;
  double drawing_idle_mm = 0.0;  // in the drawing's order
  double cut_mm = 0.0;           // jet on, leads included
  int pierce_count = 0;

  bool blocked() const;
};

Toolpath MakeToolpath(const Drawing& drawing, const ContourSet& contours, const ToolpathOptions& options);

// Turns all contours and marks, then moves them so that the lower left corner of all is at a place.
void PlaceContours(ContourSet& contours, double turn_rad, const Eigen::Vector2d& corner_W_mm);

}  // namespace lambdajet::trajectory
