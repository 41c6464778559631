// Names why a kinematic question has no plain answer; every answer of this house carries one.
//
// An answer whose reason is not kSolved still carries finite numbers that say how far it is from being
// solved. Threads: values.
#pragma once

#include <cstdint>
#include <string_view>

namespace lambdajet::kinematics {

// The numbers are those of lambdajet.kinematics.v1.Reason on the wire.
enum class Reason : std::uint8_t {
  kSolved = 1,
  kOutOfReach = 2,     // a link or a strut is too short or too long for the pose
  kSingular = 3,       // at a singularity, or nearer to one than the mechanism's singular margin
  kActuatorLimit = 4,  // beyond the travel of a slider or a strut
  kNotFinite = 5,      // NaN or infinity in the question, or numbers too large to calculate with
  kModeMismatch = 6,   // the pose belongs to another working or assembly mode than the one asked for
  kIndeterminate = 7,  // infinitely many poses (L2 = L3 with coincident sliders)
  kNotConverged = 8,   // an iteration ran into its limit
  kJointLimit = 9,     // beyond the cone of a passive joint
  kBadGeometry = 10,   // zero, negative or not finite lengths
};

// UPPER_SNAKE, as on every wire and in every file.
constexpr std::string_view ReasonName(Reason reason) {
  switch (reason) {
    case Reason::kSolved:
      return "SOLVED";
    case Reason::kOutOfReach:
      return "OUT_OF_REACH";
    case Reason::kSingular:
      return "SINGULAR";
    case Reason::kActuatorLimit:
      return "ACTUATOR_LIMIT";
    case Reason::kNotFinite:
      return "NOT_FINITE";
    case Reason::kModeMismatch:
      return "MODE_MISMATCH";
    case Reason::kIndeterminate:
      return "INDETERMINATE";
    case Reason::kNotConverged:
      return "NOT_CONVERGED";
    case Reason::kJointLimit:
      return "JOINT_LIMIT";
    case Reason::kBadGeometry:
      return "BAD_GEOMETRY";
  }
  return "UNKNOWN";
}

}  // namespace lambdajet::kinematics
