#include "platform/rpc/handlers.hpp"

#include <chrono>

#include "foundation/contract/trouble.hpp"

namespace lambdajet {

absl::Status CheckStillWanted(const grpc::CallbackServerContext& context) {
  if (context.deadline() <= std::chrono::system_clock::now()) {
    return Trouble(absl::StatusCode::kDeadlineExceeded, "EXPIRED_ON_ARRIVAL",
                   "the call's deadline had passed before work on it could begin");
  }
  if (context.IsCancelled()) {
    return Trouble(absl::StatusCode::kCancelled, "CANCELLED", "the client has given the call up");
  }
  return absl::OkStatus();
}

absl::Status Unexpected(const char* what) {
  return Trouble(absl::StatusCode::kInternal, "UNEXPECTED", std::string("a library has thrown: ") + what);
}

}  // namespace lambdajet
