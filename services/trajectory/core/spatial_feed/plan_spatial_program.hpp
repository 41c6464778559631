// Plans a part program for a hexapod: from canonical operations in six axes to segments that the six struts play.
//
// Model: (1) geometry: runs of lines, arcs and helices with turns about fixed axes, between standstills
// (spatial_feed/spatial_path); (2) speed along each run, time-optimal under feed, path acceleration, curvature, corners and the
// six struts' velocity and acceleration (spatial_feed/spatial_nodes, feed/speed_profile); (3) smoothing in time, which bounds
// jerk and keeps the path (spatial_feed/spatial_smoothing); (4) inverse kinematics and its derivatives to quintic segments.
// The final polynomials are measured against every strut's velocity, acceleration and jerk between samples, path acceleration
// and jerk and both tolerances at knots; where one is exceeded that stretch is slowed and planned again. Strut lengths, joint
// cones and singular margin are checked along the programmed path and along the planned one.
// Tolerance: for every planned pose there is a programmed one within corner tolerance of the tip and of the turn, and every
// programmed corner is come as near to.
// Frames: W in, struts' encoders out. Units: mm, rad, s. Threads: pure; the same inputs give the same plan bit for bit.
// Cost: about 5 us a millisecond of program time. Errors: faults with line and reason; no plan then. Neither where `progress`
// stopped it.
#pragma once

#include <string>
#include <vector>

#include "trajectory/core/feed/plan_program.hpp"
#include "trajectory/core/spatial_feed/spatial_stretch.hpp"

namespace lambdajet::trajectory {

struct PlannedSpatialProgram {
  SpatialPlan plan;
  std::vector<SpatialPlanSample> samples;
  std::vector<ProgramFault> faults;
  std::vector<BindingLength> binding;  // longest first
  std::vector<SlowStretch> slow;
  double tip_deviation_mm = 0.0;  // largest, from the programmed path
  double turn_deviation_rad = 0.0;
  double cutting_length_mm = 0.0;  // of feed moves, along the path length
  double cutting_time_s = 0.0;
  double gate_time_s = 0.0;
  double singular_margin_ratio = 0.0;  // singular, over the samples, mm/mm
  StrutVector shortest_mm = StrutVector::Zero();
  StrutVector longest_mm = StrutVector::Zero();
};

PlannedSpatialProgram PlanSpatialProgram(const std::vector<Operation>& operations,
                                         const std::string& machine_id, const HexapodGeometry& geometry,
                                         const HexapodMotion& motion, const SpatialOptions& options,
                                         const PlanProgress& progress = {});

// Struts' readings and speeds at tau; beyond the ends the end.
StrutState StrutsAt(const SpatialPlan& plan, double tau_s);

}  // namespace lambdajet::trajectory
