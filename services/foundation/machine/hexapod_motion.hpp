// Describes how fast one hexapod may move, and where its part programs begin.
//
// Model: struts alike; along the path the magnitudes count of the tip's acceleration and jerk together with those of the
// tool's turning, a turn as the shift that it makes at the rms radius of the platform's joints. X_MT_zero is the tool's pose
// in the base at X0 Y0 Z0 A0 B0 C0; a program's Z points from the part to the spindle, against the tool's z.
// Frames: M base, T tool. Units: mm, rad, s. Validity: FaultOf() names what is wrong. Threads: values.
#pragma once

#include <string_view>

#include "foundation/geometry/pose.hpp"

namespace lambdajet {

inline constexpr double kFastestSpindle_per_min = 1e6;
inline constexpr double kLongestRunUp_s = 600.0;

struct HexapodMotion {
  double strut_velocity_mm_per_s = 1.0;
  double strut_acceleration_mm_per_s2 = 1.0;
  double strut_jerk_mm_per_s3 = 1.0;
  double feed_mm_per_s = 1.0;   // fastest feed along the path
  double rapid_mm_per_s = 1.0;  // speed of traverses along the path
  double path_acceleration_mm_per_s2 = 1.0;
  double path_jerk_mm_per_s3 = 1.0;
  double corner_tolerance_mm = 0.01;   // of the tip, before a program's first G64 P
  double corner_tolerance_rad = 1e-4;  // of the tool's direction and turn
  Pose X_MT_zero;
  double spindle_least_per_min = 0.0;
  double spindle_most_per_min = 0.0;  // 0: no spindle
  double spindle_run_up_s = 0.0;      // from rest to the fastest; a change of speed takes its share of it
};

// What is wrong, first fault only; empty if nothing is.
std::string_view FaultOf(const HexapodMotion& motion);

}  // namespace lambdajet
