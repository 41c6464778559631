// What platform/rpc costs: unary echo through RpcServer, Answer() and the interceptor, as a ratio to the same callback
// service on a bare grpc::Server, both in this process, their calls interleaved one by one so that both see the same host.
#include <grpcpp/grpcpp.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "echo.grpc.pb.h"
#include "platform/rpc/channel.hpp"
#include "platform/rpc/handlers.hpp"
#include "platform/rpc/rpc_server.hpp"
#include "platform/telemetry/log.hpp"
#include "platform/telemetry/metrics.hpp"

namespace lambdajet::test {
namespace {

using v1::EchoRequest;
using v1::EchoResponse;
using v1::EchoService;

class BareEcho final : public EchoService::CallbackService {
  grpc::ServerUnaryReactor* Echo(grpc::CallbackServerContext* context, const EchoRequest* request,
                                 EchoResponse* response) override {
    response->set_x_mm(request->x_mm());
    auto* reactor = context->DefaultReactor();
    reactor->Finish(grpc::Status::OK);
    return reactor;
  }
};

class HouseEcho final : public EchoService::CallbackService {
  grpc::ServerUnaryReactor* Echo(grpc::CallbackServerContext* context, const EchoRequest* request,
                                 EchoResponse* response) override {
    return Answer(context, [&] {
      response->set_x_mm(request->x_mm());
      return absl::OkStatus();
    });
  }
};

double CallMicroseconds(EchoService::Stub& stub) {
  EchoRequest request;
  EchoResponse response;
  request.set_x_mm(1.0);
  grpc::ClientContext context;
  SetDeadline(context, 5.0);
  const auto before = std::chrono::steady_clock::now();
  if (!stub.Echo(&context, request, &response).ok()) {
    std::abort();
  }
  return std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - before).count();
}

double Quantile(std::vector<double>& times, double share) {
  const auto at = static_cast<std::ptrdiff_t>(share * static_cast<double>(times.size() - 1));
  std::nth_element(times.begin(), times.begin() + at, times.end());
  return times[static_cast<std::size_t>(at)];
}

int Main(int calls) {
  BareEcho bare_service;
  int bare_port = 0;
  grpc::ServerBuilder builder;
  builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &bare_port);
  builder.RegisterService(&bare_service);
  const auto bare_server = builder.BuildAndStart();

  Log log({"benchmark"});
  Metrics metrics;
  HouseEcho house_service;
  RpcServer house_server({}, &log, &metrics);
  house_server.Add(house_service, EchoService::service_full_name());
  if (!house_server.Start().ok()) {
    return 1;
  }
  EchoService::Stub bare(
      grpc::CreateChannel("127.0.0.1:" + std::to_string(bare_port), grpc::InsecureChannelCredentials()));
  EchoService::Stub house(grpc::CreateChannel("127.0.0.1:" + std::to_string(house_server.port()),
                                              grpc::InsecureChannelCredentials()));
  std::vector<double> bare_us;
  std::vector<double> house_us;
  for (int i = -calls / 10; i < calls; ++i) {
    const double one = CallMicroseconds(bare);
    const double other = CallMicroseconds(house);
    if (i >= 0) {
      bare_us.push_back(one);
      house_us.push_back(other);
    }
  }
  for (const double share : {0.5, 0.99}) {
    const double base = Quantile(bare_us, share);
    const double ours = Quantile(house_us, share);
    std::printf("unary echo p%.0f: bare gRPC %.1f us, house %.1f us, ratio %.3f\n", 100 * share, base, ours,
                ours / base);
  }
  bare_server->Shutdown();
  return 0;
}

}  // namespace
}  // namespace lambdajet::test

int main(int argc, char** argv) { return lambdajet::test::Main(argc > 1 ? std::atoi(argv[1]) : 10'000); }
