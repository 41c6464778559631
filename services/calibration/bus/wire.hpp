// Translates between the bus types of looks and machine descriptions and the core's.
//
// Threads: pure.
// Errors: FromWire gives nothing for a look that holds a number that is not finite.
#pragma once

#include <optional>
#include <string>

#include "calibration/store/calibration_store.hpp"

namespace lambdajet::idl::calibration::v1 {
class MachineDescription;
}
namespace lambdajet::idl::main_motion::v1 {
class Measurement;
}

namespace lambdajet::calibration {

std::optional<RecordedLook> FromWire(const idl::main_motion::v1::Measurement& wire);

// The text must fit the type: at most 32768 bytes.
void ToWire(const MachineDescription& machine, const std::string& as_designed_yaml,
            idl::calibration::v1::MachineDescription& wire);

}  // namespace lambdajet::calibration
