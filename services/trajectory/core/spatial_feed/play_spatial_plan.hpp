// Plays a hexapod's plan cycle by cycle, as struts would, and measures what the tool does against what the program says.
//
// Model: every cycle the segments' polynomials give six readings; the forward kinematics give the tool. Its distance is taken
// from the programmed blocks themselves (lines, arcs, helices, turns about one axis), laid out here again from the canonical
// operations without the planner's geometry; the plan's path length only says which blocks are near. Beside it six simulated
// drives follow the same readings: position gain, full velocity feed-forward, speed that answers with a lag. A gate begins when
// they have settled and lasts as long as the program says; played_s is the time they took for all.
// Tip and turn belong together: at the place of the path that is nearest in shares of both tolerances.
// Frames: W, M base, P platform. Units: mm, rad, s. Threads: pure. Cost: 5 us a cycle.
// Errors: a cycle whose readings no pose has is told in `unsolved`.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "trajectory/core/spatial_feed/spatial_program.hpp"

namespace lambdajet::trajectory {

struct SpatialPlayOptions {
  double cycle_s = 1e-4;
  double trace_s = 0.02;  // distance of the trace's points
  double drive_gain_per_s = 100.0;
  double drive_lag_s = 0.001;
  double settled_mm = 0.001;                     // largest difference of any strut at which a gate begins
  std::function<void(double ratio)> watch = {};  // told at the trace's points how much of the plan was played
};

// The worst of something, and where.
struct WorstPlace {
  double value = 0.0;
  double tau_s = 0.0;
  std::uint32_t line = 0;
};

// The worst since the point before.
struct PlayedPoint {
  double tau_s = 0.0;
  double tip_error_mm = 0.0;
  double turn_error_rad = 0.0;
  double drives_tip_error_mm = 0.0;
};

struct SpatialPlayReport {
  std::uint64_t cycles = 0;
  std::uint64_t unsolved = 0;
  double predicted_s = 0.0;  // program time and gates
  double played_s = 0.0;
  WorstPlace tip_error_mm;  // of the readings, from the programmed path
  WorstPlace turn_error_rad;
  WorstPlace tolerance_share;      // the larger of both shares
  WorstPlace missed_end_mm;        // of a block's programmed end, from the tool's way
  WorstPlace drives_tip_error_mm;  // of the drives that follow
  WorstPlace following_mm;         // of a strut
  WorstPlace strut_speed_share;    // of the machine's limit
  WorstPlace strut_acceleration_share;
  WorstPlace strut_jerk_share;
  WorstPlace path_acceleration_share;
  std::vector<PlayedPoint> trace;
};

// `planned` was made of `programmed` for this hexapod and has no faults.
SpatialPlayReport PlaySpatialPlan(const PlannedSpatialProgram& planned,
                                  const std::vector<Operation>& programmed, const HexapodModel& hexapod,
                                  const SpatialPlayOptions& options = {});

}  // namespace lambdajet::trajectory
