#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <thread>

#include "echo.grpc.pb.h"
#include "foundation/contract/trouble.hpp"
#include "platform/rpc/argument_checks.hpp"
#include "platform/rpc/channel.hpp"
#include "platform/rpc/handlers.hpp"
#include "platform/rpc/rpc_server.hpp"
#include "platform/rpc/streams.hpp"
#include "platform/telemetry/metrics.hpp"
#include "tests/support/eventually.hpp"
#include "tests/support/temporary_folder.hpp"

namespace lambdajet::test {
namespace {

using ::testing::HasSubstr;
using v1::EchoRequest;
using v1::EchoResponse;
using v1::EchoService;

class EchoRpc final : public EchoService::CallbackService {
 public:
  grpc::ServerUnaryReactor* Echo(grpc::CallbackServerContext* context, const EchoRequest* request,
                                 EchoResponse* response) override {
    if (request->behaviour() == "slow") {
      return AnswerOn(pool_, context, [this](const Cancelled& cancelled) {
        ++slow_began;
        const bool seen = Eventually([&] { return cancelled(); });
        slow_cancelled += seen ? 1 : 0;
        return absl::CancelledError("given up");
      });
    }
    if (request->behaviour() == "pooled") {
      return AnswerOn(pool_, context, [this](const Cancelled&) { return ++pooled, absl::OkStatus(); });
    }
    return Answer(context, [&]() -> absl::Status {
      ++computed;
      ArgumentChecks checks;
      checks.Finite("x_mm", request->x_mm(), "mm");
      if (!checks.ok()) {
        return checks.status();
      }
      if (request->behaviour() == "throw") {
        throw std::runtime_error("boom");
      }
      if (request->behaviour() == "trouble") {
        return Trouble(absl::StatusCode::kNotFound, "UNKNOWN_MACHINE", "no such machine",
                       {{"machine_id", "m-1"}});
      }
      response->set_x_mm(request->x_mm());
      return absl::OkStatus();
    });
  }

  grpc::ServerWriteReactor<EchoResponse>* Count(grpc::CallbackServerContext*,
                                                const EchoRequest* request) override {
    if (request->x_mm() < 0) {
      return RefuseStream<EchoResponse>(absl::InvalidArgumentError("below 0"));
    }
    return NewPullStream<EchoResponse>(
        [i = 0.0, end = request->x_mm()](EchoResponse& row) mutable -> absl::StatusOr<bool> {
          row.set_x_mm(i);
          return i++ < end;
        });
  }

  grpc::ServerWriteReactor<EchoResponse>* Watch(grpc::CallbackServerContext*, const EchoRequest*) override {
    const std::lock_guard lock(mutex);
    watched = PushStream<EchoResponse>::New(4);
    return watched->Begin();
  }

  std::shared_ptr<PushStream<EchoResponse>> Watched() {
    const std::lock_guard lock(mutex);
    return watched;
  }

  std::atomic<int> computed = 0;
  std::atomic<int> pooled = 0;
  std::atomic<int> slow_began = 0;
  std::atomic<int> slow_cancelled = 0;

 private:
  std::mutex mutex;
  std::shared_ptr<PushStream<EchoResponse>> watched;
  WorkPool pool_{1, 1};
};

EchoResponse Number(double x_mm) {
  EchoResponse response;
  response.set_x_mm(x_mm);
  return response;
}

class Rpc : public ::testing::Test {
 protected:
  void Serve(RpcOptions options = {}) {
    server_ = std::make_unique<RpcServer>(options, nullptr, &metrics_);
    server_->Add(rpc_, EchoService::service_full_name());
    const absl::Status status = server_->Start();
    ASSERT_TRUE(status.ok()) << status.ToString();
    stub_ = std::make_unique<EchoService::Stub>(Channel({}));
  }
  std::shared_ptr<grpc::Channel> Channel(ChannelOptions options) {
    options.address = "127.0.0.1:" + std::to_string(server_->port());
    auto channel = OpenChannel(options);
    EXPECT_TRUE(channel.ok()) << channel.status().ToString();
    return *channel;
  }
  absl::Status Echo(double x_mm, const std::string& behaviour = "", double deadline_s = 20.0) {
    EchoRequest request;
    request.set_x_mm(x_mm);
    request.set_behaviour(behaviour);
    return Call(&EchoService::Stub::Echo, *stub_, request, response_, deadline_s);
  }

  Metrics metrics_;
  EchoRpc rpc_;
  std::unique_ptr<RpcServer> server_;
  std::unique_ptr<EchoService::Stub> stub_;
  EchoResponse response_;
};

TEST_F(Rpc, AnswersOnAPortOfItsOwn) {
  Serve();
  EXPECT_GT(server_->port(), 0);
  ASSERT_TRUE(Echo(1.5).ok());
  EXPECT_EQ(response_.x_mm(), 1.5);
}

TEST_F(Rpc, BringsTroubleToTheClient) {
  Serve();
  const absl::Status status = Echo(0, "trouble");
  EXPECT_EQ(status.code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(TroubleReason(status), "UNKNOWN_MACHINE");
  EXPECT_EQ(TroubleDetailsOf(status).at("machine_id"), "m-1");
  const absl::Status nan = Echo(std::nan(""));
  EXPECT_EQ(TroubleReason(nan), "NOT_FINITE");
  ASSERT_EQ(TroubleViolations(nan).size(), 1u);
  EXPECT_EQ(TroubleViolations(nan)[0].field, "x_mm");
}

TEST_F(Rpc, CatchesWhatALibraryThrows) {
  Serve();
  const absl::Status status = Echo(0, "throw");
  EXPECT_EQ(status.code(), absl::StatusCode::kInternal);
  EXPECT_EQ(TroubleReason(status), "UNEXPECTED");
  EXPECT_TRUE(Echo(1).ok());
}

// The one worker is busy for longer than the call behind it may wait.
TEST_F(Rpc, DoesNotComputeForAnExpiredDeadline) {
  Serve();
  std::thread first([&] {
    EchoRequest request;
    request.set_behaviour("slow");
    EchoResponse response;
    EXPECT_FALSE(Call(&EchoService::Stub::Echo, *stub_, request, response, 1.0).ok());
  });
  ASSERT_TRUE(Eventually([&] { return rpc_.slow_began == 1; }));
  EXPECT_EQ(Echo(1, "pooled", 0.1).code(), absl::StatusCode::kDeadlineExceeded);
  first.join();
  ASSERT_TRUE(Eventually([&] { return Echo(1, "pooled").ok(); }));
  EXPECT_EQ(rpc_.pooled, 1);
}

TEST_F(Rpc, TellsLongWorkThatItsClientHasGoneAndShedsWhatDoesNotFit) {
  Serve();
  std::vector<std::thread> clients;
  std::atomic<int> overloaded = 0;
  std::atomic<int> ended = 0;
  clients.emplace_back([&] { EXPECT_FALSE(Echo(0, "slow", 2.0).ok()); });
  ASSERT_TRUE(Eventually([&] { return rpc_.slow_began == 1; }));
  for (int i = 0; i < 4; ++i) {
    clients.emplace_back([&] {
      EchoRequest request;
      request.set_behaviour("slow");
      EchoResponse response;
      const absl::Status status = Call(&EchoService::Stub::Echo, *stub_, request, response, 3.0);
      overloaded += TroubleReason(status) == "OVERLOADED" ? 1 : 0;
      ++ended;
    });
  }
  EXPECT_TRUE(Eventually([&] { return overloaded == 3; }));
  EXPECT_TRUE(Eventually([&] { return rpc_.slow_cancelled >= 1; }));
  for (std::thread& client : clients) {
    client.join();
  }
}

TEST_F(Rpc, IsNotServingUntilTheHouseSaysSo) {
  Serve();
  const auto channel = Channel({});
  const std::string name = EchoService::service_full_name();
  EXPECT_EQ(*AskServing(channel, "", 20), false);
  EXPECT_EQ(*AskServing(channel, name, 20), false);
  server_->SetServing(true);
  EXPECT_EQ(*AskServing(channel, "", 20), true);
  EXPECT_EQ(*AskServing(channel, name, 20), true);
  EXPECT_EQ(AskServing(channel, "no.such.Service", 20).status().code(), absl::StatusCode::kNotFound);
  server_->SetServing(false);
  EXPECT_EQ(*AskServing(channel, name, 20), false);
}

TEST_F(Rpc, CountsCallsByMethodAndCode) {
  Serve();
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE(Echo(1).ok());
  }
  ASSERT_FALSE(Echo(0, "trouble").ok());
  EXPECT_TRUE(Eventually([&] {
    const std::string text = metrics_.Text();
    return text.find(
               "lambdajet_rpc_calls_total{code=\"OK\",method=\"/lambdajet.test.v1.EchoService/Echo\"} 3") !=
               std::string::npos &&
           text.find(
               "lambdajet_rpc_calls_total{code=\"NOT_FOUND\",method=\"/lambdajet.test.v1.EchoService/Echo\"} "
               "1") != std::string::npos &&
           text.find(
               "lambdajet_rpc_duration_seconds_count{method=\"/lambdajet.test.v1.EchoService/Echo\"} 4") !=
               std::string::npos;
  })) << metrics_.Text();
}

TEST_F(Rpc, RefusesAMessageThatIsTooLarge) {
  RpcOptions options;
  options.most_message_mib = 1;
  Serve(options);
  EchoRequest request;
  request.set_payload(std::string((1 << 20) + 1, 'x'));
  EXPECT_EQ(Call(&EchoService::Stub::Echo, *stub_, request, response_, 20.0).code(),
            absl::StatusCode::kResourceExhausted);
  EXPECT_TRUE(Echo(1).ok());
}

TEST_F(Rpc, StreamsWhatIsPulled) {
  Serve();
  EchoRequest request;
  request.set_x_mm(1000);
  grpc::ClientContext context;
  SetDeadline(context, 20);
  auto reader = stub_->Count(&context, request);
  double expected = 0;
  while (reader->Read(&response_)) {
    EXPECT_EQ(response_.x_mm(), expected++);
  }
  EXPECT_TRUE(reader->Finish().ok());
  EXPECT_EQ(expected, 1000);
  request.set_x_mm(-1);
  grpc::ClientContext refused;
  SetDeadline(refused, 20);
  EXPECT_EQ(stub_->Count(&refused, request)->Finish().error_code(), grpc::StatusCode::INVALID_ARGUMENT);
}

TEST_F(Rpc, PushesToAWatcherAndDropsTheOldestOfASlowOne) {
  Serve();
  grpc::ClientContext context;
  SetDeadline(context, 20);
  auto reader = stub_->Watch(&context, {});
  ASSERT_TRUE(Eventually([&] { return rpc_.Watched() != nullptr; }));
  const auto stream = rpc_.Watched();
  const std::string ballast;
  for (int i = 0; i < 100'000; ++i) {
    ASSERT_TRUE(stream->Push(Number(i)));
  }
  stream->Finish(absl::OkStatus());
  double last = -1;
  std::uint64_t received = 0;
  while (reader->Read(&response_)) {
    EXPECT_GT(response_.x_mm(), last);
    last = response_.x_mm();
    ++received;
  }
  EXPECT_TRUE(reader->Finish().ok());
  EXPECT_EQ(last, 99'999);
  EXPECT_EQ(received + stream->dropped(), 100'000u);
  EXPECT_FALSE(stream->Push(Number(1)));
}

TEST_F(Rpc, EndsAWatchWhoseClientIsGone) {
  Serve();
  auto context = std::make_unique<grpc::ClientContext>();
  auto reader = stub_->Watch(context.get(), {});
  ASSERT_TRUE(Eventually([&] { return rpc_.Watched() != nullptr; }));
  context->TryCancel();
  EXPECT_TRUE(Eventually([&] { return rpc_.Watched()->over(); }));
  reader->Finish();
}

TEST_F(Rpc, EndsInOrderWithinItsDeadline) {
  RpcOptions options;
  options.shutdown_deadline_s = 0.2;
  Serve(options);
  grpc::ClientContext context;
  auto reader = stub_->Watch(&context, {});
  ASSERT_TRUE(Eventually([&] { return rpc_.Watched() != nullptr; }));
  const auto before = std::chrono::steady_clock::now();
  server_->Shutdown();
  EXPECT_LT(std::chrono::steady_clock::now() - before, kPatience);
  EXPECT_FALSE(reader->Finish().ok());
  EXPECT_FALSE(Echo(1, "", 1.0).ok());
}

TEST_F(Rpc, SaysThatItsPortIsTaken) {
  Serve();
  RpcOptions options;
  options.address = "127.0.0.1:" + std::to_string(server_->port());
  RpcServer second(options, nullptr, nullptr);
  const absl::Status status = second.Start();
  EXPECT_EQ(TroubleReason(status), "ADDRESS_IN_USE");
  EXPECT_THAT(std::string(status.message()), HasSubstr(options.address));
}

TEST_F(Rpc, RefusesPlaintextBeyondLoopback) {
  RpcOptions options;
  options.address = "0.0.0.0:0";
  EXPECT_EQ(TroubleReason(RpcServer(options, nullptr, nullptr).Start()), "PLAINTEXT_REFUSED");
  options.allow_plaintext = true;
  EXPECT_TRUE(RpcServer(options, nullptr, nullptr).Start().ok());
}

// A certificate authority and certificates of it, made by openssl for one test.
class Authority {
 public:
  explicit Authority(const TemporaryFolder& folder) : folder_(folder) {
    Run("openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:P-256 -nodes -days 2 -subj /CN=test-ca "
        "-keyout " +
        folder.File("ca.key") + " -out " + folder.File("ca.pem"));
  }
  void Issue(const std::string& name) {
    folder_.Write("san.cnf", "subjectAltName=IP:127.0.0.1,DNS:localhost\n");
    Run("openssl req -newkey ec -pkeyopt ec_paramgen_curve:P-256 -nodes -subj /CN=" + name + " -keyout " +
        folder_.File(name + ".key") + " -out " + folder_.File(name + ".csr"));
    Run("openssl x509 -req -days 1 -in " + folder_.File(name + ".csr") + " -CA " + folder_.File("ca.pem") +
        " -CAkey " + folder_.File("ca.key") + " -CAcreateserial -extfile " + folder_.File("san.cnf") +
        " -out " + folder_.File(name + ".pem"));
  }

 private:
  static void Run(const std::string& command) {
    if (std::system((command + " >/dev/null 2>&1").c_str()) != 0) {
      throw std::runtime_error("failed: " + command);
    }
  }
  const TemporaryFolder& folder_;
};

TEST_F(Rpc, ServesMutualTlsAndRefusesWhoShowsNothing) {
  const TemporaryFolder folder;
  Authority authority(folder);
  authority.Issue("server");
  authority.Issue("client");
  const TemporaryFolder foreign;
  Authority(foreign).Issue("client");
  RpcOptions options;
  options.certificate_file = folder.File("server.pem");
  options.key_file = folder.File("server.key");
  options.client_ca_file = folder.File("ca.pem");
  Serve(options);
  const auto call = [&](const std::string& certificate, const std::string& key, const std::string& ca) {
    ChannelOptions channel;
    channel.ca_file = ca;
    channel.certificate_file = certificate;
    channel.key_file = key;
    EchoService::Stub stub(Channel(channel));
    return Call(&EchoService::Stub::Echo, stub, EchoRequest(), response_, 20.0);
  };
  const absl::Status good = call(folder.File("client.pem"), folder.File("client.key"), folder.File("ca.pem"));
  EXPECT_TRUE(good.ok()) << good.ToString();
  EXPECT_FALSE(call("", "", folder.File("ca.pem")).ok());
  EXPECT_FALSE(call(foreign.File("client.pem"), foreign.File("client.key"), folder.File("ca.pem")).ok());
  EXPECT_FALSE(call(folder.File("client.pem"), folder.File("client.key"), foreign.File("ca.pem")).ok());
  EXPECT_FALSE(Echo(1, "", 2.0).ok()) << "plaintext to a TLS port";
  EXPECT_TRUE(call(folder.File("client.pem"), folder.File("client.key"), folder.File("ca.pem")).ok());
}

TEST_F(Rpc, SaysWhatIsWrongWithACertificate) {
  const TemporaryFolder folder;
  Authority authority(folder);
  authority.Issue("server");
  authority.Issue("other");
  RpcOptions options;
  const auto reason = [&] { return TroubleReason(RpcServer(options, nullptr, nullptr).Start()); };
  options.certificate_file = folder.File("none.pem");
  options.key_file = folder.File("server.key");
  EXPECT_EQ(reason(), "NO_SUCH_FILE");
  options.certificate_file = folder.Write("junk.pem", "junk");
  EXPECT_EQ(reason(), "BAD_CERTIFICATE");
  options.certificate_file = folder.File("server.pem");
  options.key_file = folder.File("other.key");
  EXPECT_EQ(reason(), "KEY_MISMATCH");
  options.key_file = folder.File("junk.pem");
  EXPECT_EQ(reason(), "BAD_KEY");
}

TEST(MetricsExporter, TakesAFreePortAndSaysThatOneIsTaken) {
  Metrics metrics;
  metrics.AddBuildInfo("test", "1.2.3");
  const auto exporter = MetricsExporter::Start(metrics, "127.0.0.1:0");
  ASSERT_TRUE(exporter.ok()) << exporter.status().ToString();
  EXPECT_GT((*exporter)->port(), 0);
  const std::string taken = "127.0.0.1:" + std::to_string((*exporter)->port());
  EXPECT_EQ(TroubleReason(MetricsExporter::Start(metrics, taken).status()), "ADDRESS_IN_USE");
  EXPECT_THAT(metrics.Text(), HasSubstr("lambdajet_build_info{house=\"test\",version=\"1.2.3\"} 1"));
}

}  // namespace
}  // namespace lambdajet::test
