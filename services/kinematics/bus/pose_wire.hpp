// Turns one drive sample into one pose sample.
//
// Frames: p_DE in D, p_WJ in W (foundation/geometry/frames.md). Numbers that do not hold are 0, never NaN.
// Threads: pure. Cost: below a microsecond.
#pragma once

#include "kinematics/core/active_machine.hpp"

namespace lambdajet::idl::drive::v1 {
class State;
}
namespace lambdajet::idl::kinematics::v1 {
class Pose;
}

namespace lambdajet::kinematics {

// Everything but the header's session and sequence number, which are the writer's.
void ToWire(const ActiveMachine& machine, const idl::drive::v1::State& drive,
            idl::kinematics::v1::Pose& wire);

}  // namespace lambdajet::kinematics
