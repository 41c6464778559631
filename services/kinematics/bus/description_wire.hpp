// Builds a machine description from what calibration says on the bus.
//
// Model: the as-designed file as text, then parameters and covariance in the place of its own.
// Errors: INVALID_ARGUMENT BAD_MACHINE_FILE, or DESCRIPTION_HASH_MISMATCH where the sum of both is not what its writer hashed.
// Threads: pure.
#pragma once

#include "absl/status/statusor.h"
#include "foundation/machine/machine_description.hpp"

namespace lambdajet::idl::calibration::v1 {
class MachineDescription;
}

namespace lambdajet::kinematics {

absl::StatusOr<MachineDescription> FromWire(const idl::calibration::v1::MachineDescription& wire);

}  // namespace lambdajet::kinematics
