// Gives points of a planned program at any distance in time, with what the actuators do there.
//
// Model: between the planner's own samples the quintic that meets position, velocity and acceleration at both; actuators from
// the segments, elastic lead included, at rate 1. Frames: W. Units: mm, s. Threads: pure. Cost: about 0.1 us a point.
#pragma once

#include <array>

#include "trajectory/core/feed/plan_program.hpp"

namespace lambdajet::trajectory {

struct FullSample {
  PlanSample jet;
  std::array<double, kActuatorCount> actuator_mm{};
  std::array<double, kActuatorCount> actuator_mm_per_s{};
};

// tau within the plan; beyond its ends the end is given.
FullSample SampleAt(const PlannedProgram& planned, double tau_s);

}  // namespace lambdajet::trajectory
