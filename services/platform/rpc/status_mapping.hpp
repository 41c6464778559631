// Maps absl::Status to grpc::Status and back: the one place where trouble meets the wire.
//
// Model: the codes are the same numbers. Reason, details and violations of foundation/contract/trouble travel as
// google.rpc.Status with ErrorInfo and BadRequest in the trailer grpc-status-details-bin. A status without a reason gets
// one from its code, so every failure has a machine-readable reason.
// Threads: any. Cost: nothing for OK.
#pragma once

#include "absl/status/status.h"

namespace grpc {
class Status;
}

namespace lambdajet {

grpc::Status ToWire(const absl::Status& status);
absl::Status FromWire(const grpc::Status& status);

}  // namespace lambdajet
