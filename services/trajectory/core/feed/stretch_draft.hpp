// Holds a stretch while it is being planned: the speeds and shapes of its elements, and their places on the path and in time.
//
// Model: input time is that of the speeds before they are smoothed; the segments begin earlier than it by what the smoothing
// reaches back. Frames: W. Units: mm, s. Shapes: `planned` is one an element, `played` one a segment.
// Threads: a value. Cost: a line is found by bisection in its run.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "trajectory/core/feed/idle_planner.hpp"
#include "trajectory/core/feed/program_path.hpp"
#include "trajectory/core/feed/quintic.hpp"
#include "trajectory/core/feed/slow_down.hpp"
#include "trajectory/core/feed/speed_profile.hpp"

namespace lambdajet::trajectory {

struct PlannedRun {
  std::vector<ProfileNode> nodes;  // caps as found; x of the last pass
  std::vector<ProfileNode> solved;
  RunPace pace;
  std::vector<double> free_mm_per_s;  // speed at the nodes where nothing is slowed
  std::vector<double> node_time_s;    // from the run's begin
  double end_speed_mm_per_s = 0.0;
};

struct PlannedElement {
  PlannedRun run;
  IdleMove idle;
  double idle_factor = 1.0;
  double begin_time_s = 0.0;
  double end_time_s = 0.0;
  double begin_s_mm = 0.0;
  double length_mm = 0.0;

  double end_s_mm() const { return begin_s_mm + length_mm; }
};

struct StretchDraft {
  std::span<const PathElement> elements;
  std::vector<PlannedElement> planned;
  std::vector<PlanarQuintic>
      played;  // what the segments make the jet do on the sheet, as the actuators' own quintics do
  double knot_s = 0.0;
  int knots_per_segment = 1;
  std::ptrdiff_t first_knot = 0;  // in input time

  double segment_s() const { return knot_s * knots_per_segment; }
  // Input time of the segment's begin.
  double SegmentTime_s(std::size_t segment) const;
  bool IsRun(std::size_t i) const { return elements[i].kind == ElementKind::kRun; }
  // A run that is left at speed: an idle move follows without a stop.
  bool FlowsOn(std::size_t i) const;

  // Lines of the program: by place on the path, by input time, within a run.
  std::uint32_t LineAt(double s_mm) const;
  std::uint32_t LineAtTime(double time_s) const;
  std::uint32_t LineInRun(std::size_t run, double offset_mm) const;
};

}  // namespace lambdajet::trajectory
