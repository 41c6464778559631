// Measures how far a planned run lies from its programmed poses, and how near it comes to the programmed corners.
//
// Model: distances are shares of two tolerances, of the tip and of the turn; the nearest programmed pose is that with the
// least larger share, found by Gauss-Newton on the sum of both squares, on the piece at the same path length and on those
// within a millimetre. A corner is met by the motion about a knot within half a knot of it.
// Frames: W. Units: mm, rad, s. Threads: one object a thread; knots in path order. Cost: O(1) a knot away from corners.
#pragma once

#include <vector>

#include "trajectory/core/spatial_feed/spatial_draft.hpp"

namespace lambdajet::trajectory {

// How far a pose lies from another one.
struct Nearness {
  double tip_mm = 1e9;
  double turn_rad = 1e9;
  double ratio = 1e9;  // the larger share of tolerance
};

struct SpatialCorner {
  SpatialPoint at;
  double offset_mm = 0.0;
  double tolerance_mm = 0.0;
  Nearness nearest;
  double time_s = 0.0;  // input time where it is nearest
};

class PoseCheck {
 public:
  explicit PoseCheck(const SpatialDraft& draft) : draft_(draft) {}

  // Begins anew: forgets corners and the largest distances.
  void Restart();
  // Goes back to the run's begin and keeps what was found, corners in the order of time.
  void Rewind();

  Nearness Deviation(const SpatialKnot& knot);
  // Lets knot n come near to the corners about it.
  void NearCorners(std::size_t n);
  const std::vector<SpatialCorner>& corners() const { return corners_; }

  // Keeps it for the largest.
  void Keep(const Nearness& nearness);
  double largest_mm() const { return largest_mm_; }
  double largest_rad() const { return largest_rad_; }

 private:
  void FindCorners();
  Nearness NearnessTo(const SpatialPiece& piece, const SpatialKnot& knot) const;
  void Meet(const SpatialKnot& knot, double time_s, SpatialCorner& corner) const;

  const SpatialDraft& draft_;
  std::vector<SpatialCorner> corners_;
  std::size_t corner_at_ = 0;
  std::size_t piece_at_ = 0;
  double largest_mm_ = 0.0;
  double largest_rad_ = 0.0;
};

}  // namespace lambdajet::trajectory
