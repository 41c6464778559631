// Finds the fastest speed along a path under bounds on speed, on the magnitude of acceleration and on the actuators.
//
// Model: time-optimal path parametrisation in the phase plane (s, x = s'^2) on a grid, acceleration u = s'' constant over a
// cell: a backward pass gives the largest x from which the rest of the path can still be run, a forward pass takes the
// largest step below it. Path: u^2 + (k x)^2 <= a^2, k the curvature with the smoothing's overshoot; actuator j of N:
// |A_j u + B_j x| <= a_j, |A_j| sqrt(x) <= v_j, where q_j' = A_j s', q_j'' = A_j s'' + B_j s'^2. At a given x every bound
// leaves an interval of u, so that all bounds have a u in common if every two of them have.
// Units: mm, s. Shapes: one node a grid point, cell i from node i to i + 1; N is 2 (sliders) or 6 (struts). Threads: pure.
// Cost: a few tens of ns a node; tests/benchmark/trajectory_benchmark.cpp prints it.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>
#include <vector>

namespace lambdajet::trajectory {

enum class FeedLimit : std::uint8_t {
  kFeed,
  kCurvature,
  kCorner,
  kPathAcceleration,
  kActuator1Velocity,
  kActuator2Velocity,
  kActuator1Acceleration,
  kActuator2Acceleration,
  kContourTolerance,
  kPredictedError,
  kActuatorJerk,
  kPathJerk,
  kActuator3Velocity,
  kActuator4Velocity,
  kActuator5Velocity,
  kActuator6Velocity,
  kActuator3Acceleration,
  kActuator4Acceleration,
  kActuator5Acceleration,
  kActuator6Acceleration,
  kSmoothing,  // none is reached: the smoothing in time keeps the plan below them
};
inline constexpr std::size_t kFeedLimitCount = 21;

// UPPER_SNAKE.
std::string_view FeedLimitName(FeedLimit limit);
// Of actuator j, 0 to 5.
FeedLimit ActuatorVelocityLimit(std::size_t j);
FeedLimit ActuatorAccelerationLimit(std::size_t j);

// Length over which a limit governs the feed of cutting moves.
struct BindingLength {
  FeedLimit limit = FeedLimit::kFeed;
  double length_mm = 0.0;
};

// A stretch of cutting path where the programmed feed is not held, for one reason; where another limit takes over, another
// stretch begins. What is said of the limit is measured on the plan that is given away (feed/binding).
struct SlowStretch {
  double from_s_mm = 0.0;
  double to_s_mm = 0.0;
  std::uint32_t line = 0;
  FeedLimit limit = FeedLimit::kFeed;
  double programmed_mm_per_s = 0.0;
  double lowest_mm_per_s = 0.0;
  double reached_share = 0.0;            // of the nearest limit, at most
  double at_s_mm = 0.0;                  // there
  double share = 0.0;                    // of the stretch's length where the limit is reached
  FeedLimit nearest = FeedLimit::kFeed;  // the same limit; SMOOTHING: the one that it stays below
};

template <std::size_t N>
struct ProfileNodeOf {
  double offset_mm = 0.0;
  double speed_cap_mm_per_s = 0.0;      // feed, corner, predicted error, slow-down
  double curvature = 0.0;               // magnitude, with the smoothing's overshoot
  double acceleration_mm_per_s2 = 0.0;  // path limit here
  std::array<double, N> A{};
  std::array<double, N> B{};
  double x = 0.0;  // answer: speed squared
  FeedLimit cap_reason = FeedLimit::kFeed;
  FeedLimit binding = FeedLimit::kFeed;  // answer
};
using ProfileNode = ProfileNodeOf<2>;

template <std::size_t N>
struct ActuatorBoundsOf {
  std::array<double, N> velocity_mm_per_s{};
  std::array<double, N> acceleration_mm_per_s2{};
};
using ActuatorBounds = ActuatorBoundsOf<2>;

// Fills x and binding of every node; begins and ends at the given speeds at most.
void SolveSpeedProfile(std::vector<ProfileNode>& nodes, const ActuatorBounds& bounds,
                       double begin_speed_mm_per_s, double end_speed_mm_per_s);
void SolveSpeedProfile(std::vector<ProfileNodeOf<6>>& nodes, const ActuatorBoundsOf<6>& bounds,
                       double begin_speed_mm_per_s, double end_speed_mm_per_s);

// Time to run the profile.
double ProfileDuration(const std::vector<ProfileNode>& nodes);
double ProfileDuration(const std::vector<ProfileNodeOf<6>>& nodes);

}  // namespace lambdajet::trajectory
