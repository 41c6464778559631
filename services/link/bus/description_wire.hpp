// Builds a machine description from what calibration says on the bus.
//
// Model: the as-designed file as text, then parameters and covariance in the place of its own.
// Errors: INVALID_ARGUMENT BAD_MACHINE_FILE, or DESCRIPTION_HASH_MISMATCH where both together are not what was hashed.
// Threads: pure; parses YAML, so not in a cyclic loop.
#pragma once

#include "absl/status/statusor.h"
#include "foundation/machine/machine_description.hpp"

namespace lambdajet::idl::calibration::v1 {
class MachineDescription;
}

namespace lambdajet::link {

absl::StatusOr<MachineDescription> FromWire(const idl::calibration::v1::MachineDescription& wire);

}  // namespace lambdajet::link
