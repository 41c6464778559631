// Chooses how an idle move is made: as quick as path and actuator limits allow.
//
// Model: from standstill a trapezoid along the straight line, which the smoothing that every motion passes makes jerk-limited:
// some hundredths longer than the quickest such move (idle_motion/jerk_limited_move), which smoothed once more would be
// slower still. From the speed at the end of a cut one idle law a coordinate (seed paper 003), its duration the shortest whose
// speed, acceleration and actuator motion stay within their limits.
// Frames: W. Units: mm, s. Threads: pure. Cost: about 0.1 ms a move.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string_view>

#include "trajectory/core/feed/planning_model.hpp"
#include "trajectory/core/idle_motion/idle_law.hpp"

namespace lambdajet::trajectory {

struct IdleMove {
  bool straight = true;  // trapezoid along the line; else one law a coordinate
  double duration_s = 0.0;
  double speed_mm_per_s = 0.0;  // trapezoid: cruise
  double ramp_s = 0.0;
  std::array<IdleLaw, 2> laws;
  std::string_view name;
  std::string_view reason;
  double start_speed_mm_per_s = 0.0;
  double peak_acceleration_mm_per_s2 = 0.0;
};

// `slow` in (0, 1] scales speed and, squared, acceleration. Nothing if no law stays within reach.
std::optional<IdleMove> PlanIdleMove(const PlanningModel& model, const Eigen::Vector2d& from_mm,
                                     const Eigen::Vector2d& velocity_mm_per_s, const Eigen::Vector2d& to_mm,
                                     double slow);

Eigen::Vector2d IdlePosition(const IdleMove& move, const Eigen::Vector2d& from_mm,
                             const Eigen::Vector2d& to_mm, double t);

}  // namespace lambdajet::trajectory
