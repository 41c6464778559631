// Measures how far a planned stretch lies from its programmed contour, and how near it comes to the contour's corners.
//
// Model: the distance of each planned point from the pieces of its own run about the same path length, each in shares of its
// own tolerance; of each corner from the chords of planned points about it, because a plan that turns back on itself may stay
// on the contour and yet miss its corner; and of the contour's places from those chords, because a plan may cut across an arc
// that is smaller than the smoothing is long and yet lie near its neighbours. A corner is met by its own cut only; the end of
// a cut that is left at speed may be met just behind it.
// Frames: W. Units: mm, s. Threads: one object a thread; points in path order. Cost: O(1) a point, near kinks of the pieces
// within a millimetre.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "trajectory/core/feed/stretch_draft.hpp"

namespace lambdajet::trajectory {

struct ContourCorner {
  Eigen::Vector2d p_mm;
  double s_mm = 0.0;
  double last_s_mm = 0.0;  // where it may still be met: an idle move that happens to come by is no cut
  double tolerance_mm = 0.0;
  double nearest_mm = 1e9;
  double time_s = 0.0;  // of the segment's part that is nearest
};

class ContourCheck {
 public:
  explicit ContourCheck(const StretchDraft& draft) : draft_(draft) {}

  // Begins anew: forgets corners and the largest distance.
  void Restart();
  // Goes back to the stretch's begin and keeps what was found.
  void Rewind() { run_at_ = piece_at_ = 0; }

  // Moves on to the run and piece at this path length; false outside of runs.
  bool MoveTo(double s_mm);
  std::size_t run() const { return run_at_; }
  const PathPiece& piece() const { return draft_.elements[run_at_].pieces[piece_at_]; }

  // Distance of the planned point from the programmed contour, with the contour's tolerance there; negative outside of runs. It
  // may be told too large where it is below `exact_from` of the tolerance and of the largest kept so far.
  double Deviation(const Eigen::Vector2d& p_mm, double s_mm, double exact_from, double& tolerance_mm);
  // Distance of the contour's place at this path length, in the run and piece moved to, from what is played within `look_s` of
  // the moment at which the plan is at p; `time_s` counts from the first segment. It may be told too large where it is small.
  double Missed(const Eigen::Vector2d& p_mm, double s_mm, double time_s, double look_s) const;
  // Keeps it for the largest.
  void Keep(double deviation_mm) { largest_mm_ = std::max(largest_mm_, deviation_mm); }
  double largest_mm() const { return largest_mm_; }

  // The plan's chord from a to b, which begins at this path length and input time.
  void NearCorners(double s_mm, const Eigen::Vector2d& a_mm, const Eigen::Vector2d& b_mm, double time_s);
  const std::vector<ContourCorner>& corners() const { return corners_; }

 private:
  void FindCorners();
  Eigen::Vector2d PlayedAt(double time_s) const;

  const StretchDraft& draft_;
  std::vector<ContourCorner> corners_;
  std::size_t corner_at_ = 0;
  std::size_t run_at_ = 0;
  std::size_t piece_at_ = 0;
  double largest_mm_ = 0.0;
};

}  // namespace lambdajet::trajectory
