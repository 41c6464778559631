#include "accuracy/rpc/accuracy_rpc.hpp"

#include "accuracy/rpc/wire.hpp"
#include "foundation/contract/trouble.hpp"
#include "platform/rpc/handlers.hpp"

namespace lambdajet::accuracy {
namespace {

constexpr std::size_t kThreads = 2;
constexpr std::size_t kMostWaiting = 16;

absl::Status NoMachine() {
  return Trouble(absl::StatusCode::kFailedPrecondition, "NO_MACHINE_DESCRIPTION",
                 "no machine description has come from calibration yet; activate a version first");
}

}  // namespace

AccuracyRpc::~AccuracyRpc() = default;

AccuracyRpc::AccuracyRpc(ActiveMachine active_machine)
    : active_machine_(std::move(active_machine)), pool_(kThreads, kMostWaiting) {}

grpc::ServerUnaryReactor* AccuracyRpc::PredictContour(grpc::CallbackServerContext* context,
                                                      const v1::PredictContourRequest* request,
                                                      v1::PredictContourResponse* response) {
  return AnswerOn(pool_, context, [this, request, response](const Cancelled& cancelled) -> absl::Status {
    auto question = FromWire(*request);
    if (!question.ok()) {
      return question.status();
    }
    const auto machine = active_machine_();
    if (machine == nullptr) {
      return NoMachine();
    }
    question->options.cancelled = cancelled;
    const ContourPrediction prediction =
        Predict(*machine, question->samples, question->compensated, question->options);
    if (prediction.reason == PredictionReason::kCancelled) {
      return Trouble(absl::StatusCode::kCancelled, "CANCELLED", "the client has given the call up");
    }
    ToWire(*machine, *response->mutable_model_version());
    ToWire(prediction, *response);
    return absl::OkStatus();
  });
}

grpc::ServerUnaryReactor* AccuracyRpc::Budget(grpc::CallbackServerContext* context,
                                              const v1::BudgetRequest* request,
                                              v1::BudgetResponse* response) {
  return Answer(context, [request, response]() -> absl::Status {
    const auto question = FromWire(*request);
    if (!question.ok()) {
      return question.status();
    }
    const double base_mm = SetUpError(question->shares);
    response->set_base_mm(base_mm);
    response->set_total_mm(TotalError(base_mm, question->drive_mm, question->jet_mm));
    return absl::OkStatus();
  });
}

grpc::ServerUnaryReactor* AccuracyRpc::ErrorMap(grpc::CallbackServerContext* context,
                                                const v1::ErrorMapRequest* request,
                                                v1::ErrorMapResponse* response) {
  return AnswerOn(pool_, context, [this, request, response](const Cancelled&) -> absl::Status {
    const auto options = FromWire(*request);
    if (!options.ok()) {
      return options.status();
    }
    const auto machine = active_machine_();
    if (machine == nullptr) {
      return NoMachine();
    }
    ToWire(*machine, *response->mutable_model_version());
    ToWire(MapErrors(*machine, *options), RankParameters(*machine, *options), *options, *response);
    return absl::OkStatus();
  });
}

}  // namespace lambdajet::accuracy
