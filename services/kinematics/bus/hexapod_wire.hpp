// Turns one sample of strut readings into one pose sample of a hexapod.
//
// Model: Newton starts where the last pose was found, which follows a moving platform in three steps; after a refusal it starts
// at home again. Frames: tool T in base M. Numbers that do not hold are 0, never NaN.
// Threads: one a follower. Cost: about 8 us, most of it the singular values; no allocation but the hash's text.
#pragma once

#include "kinematics/core/active_machine.hpp"

namespace lambdajet::idl::kinematics::v1 {
class StrutReadings;
class SpatialPose;
}  // namespace lambdajet::idl::kinematics::v1

namespace lambdajet::kinematics {

class HexapodFollower {
 public:
  explicit HexapodFollower(const OwnHexapod& own) : own_(own), start_(own.hexapod.geometry().X_MP_home) {}

  // Everything but the header's session and sequence number, which are the writer's.
  void ToWire(const idl::kinematics::v1::StrutReadings& readings, idl::kinematics::v1::SpatialPose& wire);

 private:
  const OwnHexapod& own_;
  Pose start_;
};

}  // namespace lambdajet::kinematics
