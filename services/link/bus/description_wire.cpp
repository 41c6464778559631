#include "link/bus/description_wire.hpp"

#include "lambdajet/calibration/v1/machine_description.h"
#include "platform/machine_file/machine_file.hpp"

namespace lambdajet::link {

absl::StatusOr<MachineDescription> FromWire(const idl::calibration::v1::MachineDescription& wire) {
  return DescribedMachine({wire.as_designed_yaml().to_string(), wire.parameters(), wire.covariance(),
                           wire.version(), wire.hash().to_string()});
}

}  // namespace lambdajet::link
