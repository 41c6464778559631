// Plans one stretch of motion, from standstill to standstill: runs and idle moves in sequence.
//
// Model: as told in feed/plan_program.hpp. Frames: W. Units: mm, s. Threads: one object a thread.
// Cost: linear in path length and time; a few passes. Errors: faults with line and reason.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "trajectory/core/feed/planning_model.hpp"
#include "trajectory/core/feed/program_path.hpp"

namespace lambdajet::trajectory {

// Where the elements of a planned stretch lie in path length and how they were limited.
struct ElementPlace {
  double begin_s_mm = 0.0;
  double end_s_mm = 0.0;
};

struct StretchPlan {
  std::vector<Segment> segments;  // start_s counted from the stretch's begin
  std::vector<PlanSample> samples;
  std::vector<ElementPlace> places;  // one an element
  std::vector<BindingLength> binding;
  std::vector<SlowStretch> slow;
  std::vector<IdleReport> idle;
  std::vector<ProgramFault> faults;
  double duration_s = 0.0;
  double end_s_mm = 0.0;
  double contour_deviation_mm = 0.0;
};

// `elements`: runs and idle moves without gates; may be empty: a rest at `at_W_mm` of one segment. `cancelled` is asked
// some times a pass; true ends planning with CANCELLED.
StretchPlan PlanStretch(const PlanningModel& model, std::span<const PathElement> elements,
                        const Eigen::Vector2d& at_W_mm, double begin_s_mm,
                        const std::function<bool()>& cancelled = {});

}  // namespace lambdajet::trajectory
