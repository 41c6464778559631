// Remembers what the drive has said of late, and answers where the path was, is, and when it will be somewhere.
//
// Model: a ring of drive states. Between two states the path length is the cubic Hermite of s and ds/dt; after the newest
// it is s + s' dt + s''/2 dt^2, for no longer than the caller's deadline. With the s(tau) polynomials of the plan at hand
// the instant of a path length is found in program time, tau(t) = tau0 + w dt + w'/2 dt^2, which is exact at a steady rate
// whatever the feed does; without them from s, s', s''.
// Units: mm, s; common time in ns. Threads: one. Cost: a search over a few hundred states; no allocation.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "foundation/motion/link_samples.hpp"

namespace lambdajet::main_motion {

struct ActuatorPoint {
  std::array<double, kActuatorCount> position_mm{};
  std::array<double, kActuatorCount> velocity_mm_per_s{};
  std::array<double, kActuatorCount> acceleration_mm_per_s2{};
};

class DriveTrack {
 public:
  DriveTrack();

  void Clear();  // another plan
  void Heard(const DriveState& state);
  void LearnSegments(const SegmentBatch& batch);

  bool empty() const { return count_ == 0; }
  const DriveState& newest() const { return states_[(count_ - 1) % kStates]; }

  // Path length at a time inside the record or after its newest state.
  std::optional<double> PathLengthAt(std::int64_t time_ns) const;
  std::optional<double> PathRateAt(std::int64_t time_ns) const;
  // True once a state newer than the time has come: interpolation, not extrapolation.
  bool Covers(std::int64_t time_ns) const { return count_ > 0 && newest().header.time_ns >= time_ns; }
  std::optional<ActuatorPoint> ActuatorsAt(std::int64_t time_ns) const;

  // When the path reaches s, if the newest state says that it will within the horizon; a time in the past if it has.
  std::optional<std::int64_t> ArrivalTime(double s_mm, double horizon_s) const;

 private:
  struct PathSegment {
    std::uint32_t index = 0;
    double start_s = 0.0;
    double duration_s = 0.0;
    Polynomial s_mm;
  };
  static constexpr std::size_t kStates = 1024;
  static constexpr std::uint32_t kSegments = 8192;

  const DriveState* Before(std::int64_t time_ns, const DriveState** after) const;
  std::optional<double> TauOf(double s_mm, double horizon_s) const;

  std::vector<DriveState> states_;
  std::size_t count_ = 0;
  std::vector<PathSegment> segments_;
  std::uint32_t next_segment_ = 0;
};

}  // namespace lambdajet::main_motion
