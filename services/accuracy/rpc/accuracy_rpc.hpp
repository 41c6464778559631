// Answers AccuracyService from the active machine description.
//
// Threads: gRPC's; predictions and maps run on a pool of their own and stop when the client has gone.
// Errors: FAILED_PRECONDITION NO_MACHINE_DESCRIPTION until one has come; those of wire.hpp; an unreachable or senseless
// plan is an answer with its reason.
#pragma once

#include <functional>
#include <memory>

#include "foundation/machine/machine_description.hpp"
#include "lambdajet/accuracy/v1/accuracy.grpc.pb.h"
#include "platform/rpc/work_pool.hpp"

namespace lambdajet::accuracy {

using ActiveMachine = std::function<std::shared_ptr<const MachineDescription>()>;  // null: none yet

class AccuracyRpc final : public v1::AccuracyService::CallbackService {
 public:
  explicit AccuracyRpc(ActiveMachine active_machine);
  ~AccuracyRpc() override;  // out of line: whoever owns a service need not compile gRPC's classes below it

  grpc::ServerUnaryReactor* PredictContour(grpc::CallbackServerContext* context,
                                           const v1::PredictContourRequest* request,
                                           v1::PredictContourResponse* response) override;
  grpc::ServerUnaryReactor* Budget(grpc::CallbackServerContext* context, const v1::BudgetRequest* request,
                                   v1::BudgetResponse* response) override;
  grpc::ServerUnaryReactor* ErrorMap(grpc::CallbackServerContext* context, const v1::ErrorMapRequest* request,
                                     v1::ErrorMapResponse* response) override;

 private:
  ActiveMachine active_machine_;
  WorkPool pool_;
};

}  // namespace lambdajet::accuracy
