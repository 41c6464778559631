// Moves a chain of lines and arcs sideways by exactly the given distance, and names what a jet of that radius cannot cut.
//
// Model: the parallel of a line is a line, of an arc an arc about the same centre (radius r - d for a left offset d of a
// counter-clockwise arc). At a corner that the path goes round outside, the jet rolls: an arc about the drawn corner. It is
// preferred to lines extended to a point because every place of the path is then at the offset distance, no more material is
// cut than needed, and sharp corners need no limit on how far the lines may run out. At a corner on the inside both parallels
// end where they cross; the jet leaves material of its own radius there, which is told and not hidden. An arc whose parallel
// has radius 0 becomes a corner. Nothing is clipped: what vanishes or would cut into the contour is a fault.
// Frames: the pieces'. Units: mm. Threads: pure. Cost: about 1 us a piece.
// Errors: RADIUS_BELOW_KERF, KERF_GOUGE; told without blocking: INNER_CORNER_ROUNDED.
#pragma once

#include <cstddef>
#include <string_view>
#include <vector>

#include "trajectory/core/toolpath/piece.hpp"

namespace lambdajet::trajectory {

struct OffsetFault {
  std::string_view reason;
  bool blocks = true;
  std::size_t piece = 0;  // of the input
  Eigen::Vector2d at_mm = Eigen::Vector2d::Zero();
  double size_mm = 0.0;   // radius or width that would be right; rounded corner: height of what remains
  std::size_t other = 0;  // gouge: the contours' piece that is cut into
};

struct OffsetChain {
  Pieces pieces;  // a piece's source is the place of the piece it comes from in the input
  std::vector<OffsetFault> faults;

  bool blocked() const;
};

// Left positive. Closed: the last piece ends where the first begins.
OffsetChain OffsetPieces(const Pieces& pieces, bool closed, double offset_mm);

// Checks a path against finished contours: faults KERF_GOUGE where it comes nearer to one of them than the distance, one for
// each contour piece cut into. `piece` names the piece of the path, `at_mm` is on the path, `size_mm` the distance found.
std::vector<OffsetFault> FindGouges(const Pieces& path, const Pieces& contours, const PieceIndex& index,
                                    double distance_mm);

}  // namespace lambdajet::trajectory
