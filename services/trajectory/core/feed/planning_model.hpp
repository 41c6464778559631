// What every stretch of a program is planned with: the machine, the wishes, the smoothing, and limits with planning margin.
//
// Model: the smoothing is as wide as the path's jerk limit and, with elastic lead, the actuators' ask for. Speeds are planned a
// little below the limits, because what is smoothed and bent through the mechanism is measured only afterwards.
// Units: mm, s. Threads: const. Cost: some 0.1 ms, for the corner rule's table.
#pragma once

#include "trajectory/core/feed/corner_speed.hpp"
#include "trajectory/core/feed/plan_program.hpp"
#include "trajectory/core/feed/sheet_motion.hpp"
#include "trajectory/core/feed/smoothing.hpp"
#include "trajectory/core/feed/speed_profile.hpp"

namespace lambdajet::trajectory {

struct PlanningModel {
  explicit PlanningModel(const MachineDescription& machine, const PlanOptions& options);

  const MachineDescription& machine;
  const PlanOptions& options;
  SheetMotion sheet;
  SmoothingFilter filter;
  double overshoot = 1.0;         // of the filter, on normal acceleration
  double kink_deviation_s = 0.0;  // of the filter
  double path_acceleration_mm_per_s2 = 0.0;
  CornerRule corner;
  ActuatorBounds bounds;        // with planning margin
  double elastic_lag_s2 = 0.0;  // 0: not compensated
  double damping_time_s = 0.0;
};

}  // namespace lambdajet::trajectory
