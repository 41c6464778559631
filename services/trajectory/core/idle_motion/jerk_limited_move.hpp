// Moves one coordinate, or a pair of actuators on a straight line of theirs, in the shortest time that velocity,
// acceleration and jerk limits permit, from one velocity to another.
//
// Model: jerk is +j, 0 or -j; acceleration is zero at both ends. Let d0 be the way of the direct change of velocity. A
// longer way needs a peak velocity p above both end velocities, a shorter one the mirrored move: at a given time the
// longest way is the one with the highest peak, so the first time at which the way is reached is the optimum. A change of
// velocity x takes x/a + a/j where x >= a^2/j, else 2 sqrt(x/j). Peak velocity in closed form: full cruise; both changes
// reach the acceleration limit (quadratic); none does and the end velocities are equal (cubic, at rest a cube root).
// Between them Newton's method on a convex function, at most 60 steps.
// Validity: end velocities within the limit. Units: mm, s; a pair's move counts its way from 0 to 1. Threads: values.
// Cost: rest to rest about 20 ns, other velocities about 100 ns. Errors: a verdict, never NaN.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

namespace lambdajet::trajectory {

struct MoveLimits {
  double velocity_mm_per_s = 0.0;
  double acceleration_mm_per_s2 = 0.0;
  double jerk_mm_per_s3 = 0.0;
};

struct MoveEnds {
  double distance_mm = 0.0;
  double start_mm_per_s = 0.0;
  double end_mm_per_s = 0.0;
};

enum class MoveVerdict : std::uint8_t { kMoves, kLimitNotPositive, kVelocityBeyondLimit, kNotFinite };
// UPPER_SNAKE.
std::string_view MoveVerdictName(MoveVerdict verdict);

struct MovePoint {
  double way_mm = 0.0;
  double velocity_mm_per_s = 0.0;
  double acceleration_mm_per_s2 = 0.0;
};

// Seven stretches of constant jerk: change to the peak (3), cruise, change to the end (3).
struct JerkLimitedMove {
  MoveVerdict verdict = MoveVerdict::kMoves;
  std::array<double, 7> stretch_s{};
  std::array<double, 7> jerk_mm_per_s3{};
  double start_mm_per_s = 0.0;
  double peak_mm_per_s = 0.0;
  double duration_s = 0.0;

  MovePoint At(double t_s) const;  // outside of the move: at its ends
};

JerkLimitedMove SolveMove(const MoveEnds& ends, const MoveLimits& limits);

// Both actuators from rest to rest on the straight line between; the way runs from 0 to 1 (so its "mm" are of the line),
// limits of both are kept and one of them is used to the full.
JerkLimitedMove SolvePairMove(const std::array<double, 2>& distance_mm,
                              const std::array<MoveLimits, 2>& limits);

}  // namespace lambdajet::trajectory
