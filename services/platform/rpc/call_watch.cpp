#include "platform/rpc/call_watch.hpp"

#include <grpcpp/support/server_interceptor.h>

#include <array>
#include <atomic>
#include <chrono>
#include <mutex>
#include <shared_mutex>
#include <string>
#include <unordered_map>

#include "foundation/contract/trouble.hpp"
#include "platform/rpc/status_mapping.hpp"
#include "platform/telemetry/log.hpp"
#include "platform/telemetry/metrics.hpp"

namespace lambdajet {
namespace {

using grpc::experimental::InterceptionHookPoints;
using grpc::experimental::Interceptor;
using grpc::experimental::InterceptorBatchMethods;
using grpc::experimental::ServerRpcInfo;

constexpr int kCodes = 17;

// Metrics and log of one method.
class MethodWatch {
 public:
  MethodWatch(std::string method, Log* log, Metrics* metrics)
      : method_(std::move(method)), log_(log), metrics_(metrics) {
    if (metrics_ != nullptr) {
      seconds_ = metrics_->AddHistogram(
          "lambdajet_rpc_duration_seconds", "From the call's arrival to its status.",
          {0.0001, 0.0003, 0.001, 0.003, 0.01, 0.03, 0.1, 0.3, 1, 3, 10, 30}, {{"method", method_}});
      running_ = metrics_->AddGauge("lambdajet_rpc_running", "Calls that run now.", {{"method", method_}});
      ok_ = CounterOf(grpc::StatusCode::OK);
    }
  }

  void Began() { running_.Add(1.0); }
  void Ended() { running_.Add(-1.0); }

  void Answered(const grpc::Status& status, double seconds) {
    seconds_.Observe(seconds);
    if (status.ok()) [[likely]] {
      ok_.Increment();
      return;
    }
    CounterOf(status.error_code()).Increment();
    if (log_ != nullptr) {
      log_->Warning("rpc_failed", status.error_message().substr(0, 1024),
                    {{"method", method_},
                     {"code", absl::StatusCodeToString(static_cast<absl::StatusCode>(status.error_code()))},
                     {"reason", TroubleReason(FromWire(status))},
                     {"duration_s", seconds}});
    }
  }

 private:
  Counter CounterOf(grpc::StatusCode code) {
    if (metrics_ == nullptr) {
      return {};
    }
    const int bounded = code >= 0 && code < kCodes ? static_cast<int>(code) : static_cast<int>(grpc::UNKNOWN);
    return metrics_->AddCounter(
        "lambdajet_rpc_calls_total", "Calls answered, by method and status code.",
        {{"method", method_}, {"code", absl::StatusCodeToString(static_cast<absl::StatusCode>(bounded))}});
  }

  const std::string method_;
  Log* log_;
  Metrics* metrics_;
  Histogram seconds_;
  Gauge running_;
  Counter ok_;
};

class CallWatch final : public Interceptor {
 public:
  explicit CallWatch(MethodWatch& method) : method_(method), began_(std::chrono::steady_clock::now()) {
    method_.Began();
  }
  ~CallWatch() override { method_.Ended(); }

  void Intercept(InterceptorBatchMethods* methods) override {
    if (methods->QueryInterceptionHookPoint(InterceptionHookPoints::PRE_SEND_STATUS)) {
      const std::chrono::duration<double> took = std::chrono::steady_clock::now() - began_;
      method_.Answered(methods->GetSendStatus(), took.count());
    }
    methods->Proceed();
  }

 private:
  MethodWatch& method_;
  const std::chrono::steady_clock::time_point began_;
};

class CallWatchFactory final : public grpc::experimental::ServerInterceptorFactoryInterface {
 public:
  CallWatchFactory(Log* log, Metrics* metrics) : log_(log), metrics_(metrics) {}

  Interceptor* CreateServerInterceptor(ServerRpcInfo* call) override {
    return new CallWatch(Method(call->method()));
  }

 private:
  // gRPC keeps a registered method's name for the server's life, so its address names the method.
  MethodWatch& Method(const char* name) {
    {
      const std::shared_lock lock(mutex_);
      if (const auto found = methods_.find(name); found != methods_.end()) {
        return *found->second;
      }
    }
    const std::unique_lock lock(mutex_);
    auto& watch = methods_[name];
    if (watch == nullptr) {
      watch = std::make_unique<MethodWatch>(name != nullptr ? name : "unknown", log_, metrics_);
    }
    return *watch;
  }

  Log* log_;
  Metrics* metrics_;
  std::shared_mutex mutex_;
  std::unordered_map<const char*, std::unique_ptr<MethodWatch>> methods_;
};

}  // namespace

std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface> MakeCallWatch(Log* log,
                                                                                     Metrics* metrics) {
  return std::make_unique<CallWatchFactory>(log, metrics);
}

}  // namespace lambdajet
