// Makes a callback-API handler one line: refuse, compute, answer.
//
// Model: a house derives from v1::XService::CallbackService and overrides each unary method as
//     grpc::ServerUnaryReactor* SolveInverse(grpc::CallbackServerContext* context, const v1::Request* request,
//                                            v1::Response* response) override {
//       return Answer(context, [&] { return core_door_.SolveInverse(*request, *response); });   // absl::Status
//     }
// Answer() computes on gRPC's own thread: for work below about a millisecond. AnswerOn(pool, …) computes on a WorkPool;
// its function captures by value (request and response stay valid until the answer) and may ask `cancelled()`.
// A call whose deadline has passed, or that its client has given up, is refused before any work. What a library throws
// out of the function becomes INTERNAL UNEXPECTED.
// Server streams: PullStream and PushStream in streams.hpp.
// Threads: as gRPC calls. Cost: some 100 ns above a bare handler.
#pragma once

#include <grpcpp/server_context.h>
#include <grpcpp/support/server_callback.h>

#include <exception>
#include <functional>
#include <utility>

#include "absl/status/status.h"
#include "platform/rpc/status_mapping.hpp"
#include "platform/rpc/work_pool.hpp"

namespace lambdajet {

using Cancelled = std::function<bool()>;

// OK, or why this call is not worth starting: DEADLINE_EXCEEDED EXPIRED_ON_ARRIVAL or CANCELLED.
absl::Status CheckStillWanted(const grpc::CallbackServerContext& context);

absl::Status Unexpected(const char* what);

// Calls `compute`, with whatever it throws made a status.
template <typename Compute>
absl::Status Guarded(Compute&& compute) {
  try {
    return compute();
  } catch (const std::exception& error) {
    return Unexpected(error.what());
  } catch (...) {
    return Unexpected("not a std::exception");
  }
}

template <typename Compute>
grpc::ServerUnaryReactor* Answer(grpc::CallbackServerContext* context, Compute&& compute) {
  grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
  absl::Status status = CheckStillWanted(*context);
  if (status.ok()) [[likely]] {
    status = Guarded(std::forward<Compute>(compute));
  }
  reactor->Finish(ToWire(status));
  return reactor;
}

// `compute` is called as compute(cancelled) on a thread of the pool.
template <typename Compute>
grpc::ServerUnaryReactor* AnswerOn(WorkPool& pool, grpc::CallbackServerContext* context, Compute compute) {
  grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
  const absl::Status queued = pool.Submit([context, reactor, compute = std::move(compute)]() mutable {
    absl::Status status = CheckStillWanted(*context);
    if (status.ok()) {
      status = Guarded([&] { return compute(Cancelled([context] { return context->IsCancelled(); })); });
    }
    reactor->Finish(ToWire(status));
  });
  if (!queued.ok()) {
    reactor->Finish(ToWire(queued));
  }
  return reactor;
}

}  // namespace lambdajet
