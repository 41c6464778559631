// Holds a run of tool motion while it is being planned: its speeds, its samples in time, and its knots after smoothing.
//
// Model: input time is that of the speeds before they are smoothed; the segments begin earlier than it by what the smoothing
// reaches back. Frames: W. Units: mm, rad, s. Shapes: pace, speeds and times are one a node, knots `knots_per_segment` a
// segment and one more. Threads: a value. Cost: a pass is linear in path length and time; a line is found by bisection.
#pragma once

#include <vector>

#include "trajectory/core/feed/moving_time.hpp"
#include "trajectory/core/feed/slow_down.hpp"
#include "trajectory/core/spatial_feed/spatial_nodes.hpp"
#include "trajectory/core/spatial_feed/spatial_smoothing.hpp"

namespace lambdajet::trajectory {

class SpatialDraft {
 public:
  // `run` with at least one piece; what the machine cannot reach becomes a fault.
  SpatialDraft(const SpatialModel& model, const SpatialRun& run, double begin_s_mm,
               std::vector<ProgramFault>& faults);

  // Speeds under the pace, samples a knot apart, and the smoothed knots. False, and nothing laid out, where that would last
  // longer than kLongestRun_s.
  bool Move();
  // The offset at which most of the time is spent.
  double SlowestOffset_mm() const;
  // Slows the nodes about these places; answers the last offset that is slowed.
  double Slow(std::span<const SlowPlace> places, double widening);

  const SpatialModel& model() const { return model_; }
  const SpatialRun& run() const { return run_; }
  double begin_s_mm() const { return begin_s_mm_; }
  double knot_s() const { return model_.filter.knot_s; }
  std::size_t knots_per_segment() const { return static_cast<std::size_t>(model_.options.knots_per_segment); }
  double segment_s() const { return knot_s() * model_.options.knots_per_segment; }
  std::size_t segment_count() const { return segment_count_; }
  const std::vector<SpatialKnot>& knots() const { return knots_; }
  // Input time of knot n.
  double InputTime_s(std::size_t n) const {
    return (static_cast<double>(n) - static_cast<double>(lead_)) * knot_s();
  }
  const SpatialPiece& PieceAt(double offset_mm) const;
  // As path length counts it: of a tip's and a turn's shift, speed, acceleration or jerk together.
  double Size(const Eigen::Vector3d& tip, const Eigen::Vector3d& turn) const;

 private:
  void SetSpeeds();
  void RememberSpeeds();
  void SampleTime();
  double OffsetAt(double t, std::size_t& cell) const;
  void SmoothKnots();

  const SpatialModel& model_;
  const SpatialRun& run_;
  double begin_s_mm_;
  std::vector<SpatialNode> nodes_;   // caps as found
  std::vector<SpatialNode> solved_;  // of the last pass
  RunPace pace_;
  std::vector<double> free_mm_per_s_;  // speed at the nodes where nothing is slowed
  std::vector<double> node_time_s_;
  std::vector<SpatialSample> samples_;
  std::size_t lead_ = 0;  // knots of rest before the motion begins
  std::size_t segment_count_ = 0;
  std::vector<SpatialKnot> knots_;
};

}  // namespace lambdajet::trajectory
