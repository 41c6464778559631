// Makes the multi-pass grinding program of a pilger die: passes over the groove a step of polar angle apart, each followed by
// an idle zone in which every coordinate moves to the next pass by a smooth law.
//
// Model: seed paper 003. The die turns without end; the groove is under the wheel for the cutting zone of at most half a
// turn, and the rest of the turn is idle. The step is the largest whose crest between two passes stays below Rz anywhere on
// the zone. X, Z and A leave a pass and enter the next with the velocities and accelerations of the passes themselves (by C,
// which turns evenly). Idle laws: kSmooth meets position, velocity and acceleration at both joins; kPaper takes the paper's
// laws (two-zone, mirrored, cycloid, simple harmonic at rest), which begin and end without acceleration whatever the passes
// have there, and says how large the jump is. Either takes the law with the lowest peak of those that exist.
// Frames: the die's, see wheel_path.hpp. Units: mm, rad, s. Threads: pure. Cost: about 50 ms a pass.
// Errors: a refusal by name with the numbers of the place; no operations then.
#pragma once

#include <array>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "trajectory/core/grinding/wheel_path.hpp"
#include "trajectory/core/idle_motion/idle_law.hpp"
#include "trajectory/core/part_program/operation.hpp"

namespace lambdajet::trajectory {

enum class IdleWish : std::uint8_t { kSmooth, kPaper };

struct PilgerDie {
  Groove groove;
  Wheel wheel;
  double alpha_from_rad = 0.0;  // of the first and the last pass
  double alpha_to_rad = 0.0;
  double scallop_mm = 0.0;    // Rz
  double step_rad = 0.0;      // of C between two points of the program
  double turn_s = 0.0;        // time of one turn of the die
  double approach_mm = 10.0;  // above the first and the last point
  IdleWish idle = IdleWish::kSmooth;
};

enum class PilgerRefusal : std::uint8_t {
  kNone,
  kNumberOutOfRange,
  kZoneTooLong,           // more than half a turn is to be cut
  kGrooveNotSound,        // a half-axis is not positive or deeper than the die
  kWheelProfileTooLarge,  // its rounding does not fit into the groove's section
  kWheelTooLarge,         // it does not fit along the groove
  kWheelGouges,           // it fits in both, but not in a direction between
  kWheelHitsGroove,       // its body meets another part of the groove or its edge
  kDieDoesNotAdvance,     // C would have to turn back: the depth changes too fast for so large a wheel
  kTooManyPasses,
};
// UPPER_SNAKE.
std::string_view PilgerRefusalName(PilgerRefusal refusal);

// How one coordinate gets from one pass to the next.
struct IdleMotion {
  IdleChoice choice;
  double acceleration_jump = 0.0;  // largest at the two joins, in the coordinate's unit by rad^2
};

struct GrindingPass {
  double alpha_rad = 0.0;
  double c_from_rad = 0.0;  // of the cutting zone, counted on over the turns
  double c_to_rad = 0.0;
  double scallop_mm = 0.0;         // towards the next pass; 0: the last
  std::array<IdleMotion, 3> idle;  // X, Z, A; not for the last pass
};

// A point of the program.
struct GrindingPoint {
  double c_rad = 0.0;
  double x_mm = 0.0;
  double z_mm = 0.0;
  double a_rad = 0.0;
  bool cutting = true;
};

struct PilgerProgram {
  PilgerRefusal refusal = PilgerRefusal::kNone;
  std::string message;  // what is wrong where, and what would be right
  std::vector<GrindingPass> passes;
  std::vector<GrindingPoint> points;
  double largest_scallop_mm = 0.0;
  double largest_profile_radius_mm = 0.0;  // that the sections of these passes would bear
  double least_clearance_mm =
      0.0;  // of the wheel's body from the rest of the groove, over all looked-at poses
};

// `watch` is told before each pass how much of the way from the first to the last is behind it, 0 to 1.
PilgerProgram PlanPilgerDie(const PilgerDie& die, const std::function<void(double ratio)>& watch = {});

// The program's operations: approach, passes and idle zones at an even turn of the die, retreat. Rounded to 1e-10 mm.
std::vector<Operation> OperationsOf(const PilgerProgram& program, const PilgerDie& die);

}  // namespace lambdajet::trajectory
