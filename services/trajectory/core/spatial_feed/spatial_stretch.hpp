// Plans one run of tool motion, from standstill to standstill, to segments that six struts can play.
//
// Model: as told in spatial_feed/plan_spatial_program.hpp. Frames: W in, struts out. Units: mm, rad, s. Threads: one object a
// thread. Cost: linear in path length and time; a few passes. Errors: faults with line and reason.
#pragma once

#include <vector>

#include "foundation/motion/spatial_plan.hpp"
#include "trajectory/core/spatial_feed/spatial_nodes.hpp"
#include "trajectory/core/spatial_feed/spatial_smoothing.hpp"

namespace lambdajet::trajectory {

// One point of the plan as people see it.
struct SpatialPlanSample {
  double tau_s = 0.0;
  double s_mm = 0.0;
  Eigen::Vector3d p_W_mm = Eigen::Vector3d::Zero();
  Eigen::Quaterniond q_W = Eigen::Quaterniond::Identity();  // as the rotary words mean it
  double tip_speed_mm_per_s = 0.0;
  double path_speed_mm_per_s = 0.0;
  FeedLimit limit = FeedLimit::kFeed;
  bool cutting = false;
  std::uint32_t line = 0;
};

struct SpatialStretchPlan {
  std::vector<SpatialSegment> segments;  // start_s from the stretch's begin
  std::vector<SpatialPlanSample> samples;
  std::array<double, kFeedLimitCount> binding_mm{};
  std::vector<SlowStretch> slow;
  std::vector<ProgramFault> faults;
  double duration_s = 0.0;
  double tip_deviation_mm = 0.0;
  double turn_deviation_rad = 0.0;
};

// `run` with at least one piece. `begin_s_mm`: path length at its begin.
SpatialStretchPlan PlanSpatialStretch(const SpatialModel& model, const SpatialRun& run, double begin_s_mm);
// A rest of one segment.
SpatialStretchPlan RestAt(const SpatialModel& model, const SpatialPoint& at, double begin_s_mm);

}  // namespace lambdajet::trajectory
