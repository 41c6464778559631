// Holds one look of the camera, and sorts a run of looks into what identification can use and what it must refuse.
//
// Model: a *still* look is taken at a gate after the machine's settling time; *tracking* pictures follow a mark or hole, the
// sheet moving or swinging out at rest; a *hole* is what the jet pierced earlier in the same run.
// Frames: the camera's frame C of foundation/geometry/frames.md; slider readings are encoder readings.
// Units: mm, s; stamps are common time in ns.
// Validity: numbers from outside; SelectUsable() refuses what is not finite, not seen, unknown, out of reach or repeated.
// Threads: values.
// Cost: a sort.
// Errors: answers, one refusal a measurement with its reason.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "foundation/machine/machine_description.hpp"

namespace lambdajet::calibration {

enum class LookKind : std::uint8_t { kStill, kTracking, kHole };

// Holes pierced in the run have the ids kFirstHole + 1, kFirstHole + 2, …
inline constexpr int kFirstHole = 1000;

struct Measurement {
  LookKind kind = LookKind::kStill;
  bool seen = true;
  int mark = 0;
  std::int64_t exposure_ns = 0;
  Eigen::Vector2d p_C_mm = Eigen::Vector2d::Zero();
  Eigen::Vector2d actuator_position_mm = Eigen::Vector2d::Zero();
  Eigen::Vector2d actuator_velocity_mm_per_s = Eigen::Vector2d::Zero();
  Eigen::Vector2d actuator_acceleration_mm_per_s2 = Eigen::Vector2d::Zero();
  Eigen::Vector2d pierce_actuator_position_mm = Eigen::Vector2d::Zero();  // of a hole, while it was pierced
};

// A look at a pierced hole, at rest or followed.
inline bool IsHole(const Measurement& look) { return look.mark > kFirstHole; }

// What the wire says about a look: gate 0 is tracking, ids above kFirstHole are holes.
LookKind KindOf(std::uint32_t gate, int mark);
std::string_view KindName(LookKind kind);

// A tracking run goes on while its pictures follow each other this closely: the sheet's motion between two of them is taken
// as a cubic, good to some micrometres up to here. Shorter runs than kShortestRun tell nothing and are refused.
inline constexpr double kLongestGapS = 0.03;
inline constexpr std::size_t kShortestRun = 8;

// Whether two tracking pictures, neighbours in time, belong to one run.
bool SameRun(const Measurement& earlier, const Measurement& later);

enum class LookRefusal : std::uint8_t {
  kNotSeen,
  kNotFinite,
  kUnknownMark,
  kOutOfReach,
  kDuplicate,
  kSparseTracking
};
std::string_view LookRefusalName(LookRefusal refusal);  // UPPER_SNAKE

struct RefusedLook {
  std::size_t index = 0;  // in the run as given
  LookRefusal refusal = LookRefusal::kNotSeen;
};

struct UsableRun {
  std::vector<std::size_t> order;  // indices into the run as given, by exposure; the rest were refused
  std::vector<RefusedLook> refused;
};

UsableRun SelectUsable(const MachineDescription& machine, const std::vector<Measurement>& run);

}  // namespace lambdajet::calibration
