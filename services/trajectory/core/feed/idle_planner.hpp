// Chooses how an idle move is made: as quick as path and actuator limits allow.
//
// Model: from standstill a trapezoid along the straight line; from the speed at the end of a cut one idle law a coordinate
// (seed paper 003), its duration the shortest whose speed, acceleration and actuator motion stay within their limits.
// Frames: W. Units: mm, s. Threads: pure. Cost: about 0.1 ms a move.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "trajectory/core/feed/stretch.hpp"

namespace lambdajet::trajectory {

// `slow` in (0, 1] scales speed and, squared, acceleration. Nothing if no law stays within reach.
std::optional<IdleMove> PlanIdleMove(const PlanningModel& model, const Eigen::Vector2d& from_mm,
                                     const Eigen::Vector2d& velocity_mm_per_s, const Eigen::Vector2d& to_mm,
                                     double slow);

Eigen::Vector2d IdlePosition(const IdleMove& move, const Eigen::Vector2d& from_mm,
                             const Eigen::Vector2d& to_mm, double t);

}  // namespace lambdajet::trajectory
