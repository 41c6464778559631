#include "link/bus/description_wire.hpp"

#include "foundation/contract/trouble.hpp"
#include "lambdajet/calibration/v1/machine_description.h"
#include "platform/machine_file/machine_file.hpp"

namespace lambdajet::link {

absl::StatusOr<MachineDescription> FromWire(const idl::calibration::v1::MachineDescription& wire) {
  auto machine =
      ParseMachine(std::string(wire.as_designed_yaml().c_str()), "calibration/machine_description");
  if (!machine.ok()) {
    return machine.status();
  }
  constexpr auto kCount = static_cast<Eigen::Index>(kParameterCount);
  for (Eigen::Index i = 0; i < kCount; ++i) {
    machine->parameters[i] = wire.parameters()[static_cast<std::size_t>(i)];
    for (Eigen::Index j = 0; j < kCount; ++j) {
      machine->covariance(i, j) = wire.covariance()[static_cast<std::size_t>(i * kCount + j)];
    }
  }
  machine->version = wire.version();
  if (const auto faults = Validate(*machine); !faults.empty()) {
    return Trouble(absl::StatusCode::kInvalidArgument, "BAD_MACHINE_FILE",
                   faults[0].key + " must be " + faults[0].should);
  }
  machine->hash = MachineHash(*machine);
  if (machine->hash != std::string(wire.hash().c_str())) {
    return Trouble(
        absl::StatusCode::kInvalidArgument, "DESCRIPTION_HASH_MISMATCH",
        "the description says hash " + std::string(wire.hash().c_str()) + " but is " + machine->hash);
  }
  return machine;
}

}  // namespace lambdajet::link
