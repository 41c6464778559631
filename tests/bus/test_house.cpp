// A house for tests of the platform: echoes over gRPC how many samples it has heard, and writes to the bus.
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <thread>

#include "echo.grpc.pb.h"
#include "platform/bus/participant.hpp"
#include "platform/bus/reader.hpp"
#include "platform/bus/writer.hpp"
#include "platform/house/house.hpp"
#include "platform/rpc/handlers.hpp"
#include "platform/rpc/rpc_server.hpp"
#include "tests/bus/plain_sample.hpp"

namespace lambdajet::test {
namespace {

using PlainWriter = Writer<PlainSamplePubSubType>;
using PlainReader = Reader<PlainSamplePubSubType>;

class HeardRpc final : public v1::EchoService::CallbackService {
 public:
  explicit HeardRpc(const std::atomic<int>& heard) : heard_(heard) {}
  grpc::ServerUnaryReactor* Echo(grpc::CallbackServerContext* context, const v1::EchoRequest*,
                                 v1::EchoResponse* response) override {
    return Answer(context, [&] {
      response->set_x_mm(heard_.load());
      return absl::OkStatus();
    });
  }

 private:
  const std::atomic<int>& heard_;
};

// Writes a state sample every 2 ms until it is destroyed.
class Ticker {
 public:
  explicit Ticker(PlainWriter& writer) : thread_([this, &writer] { Tick(writer); }) {}
  ~Ticker() {
    {
      const std::lock_guard lock(mutex_);
      stop_ = true;
    }
    changed_.notify_one();
    thread_.join();
  }

 private:
  void Tick(PlainWriter& writer) {
    std::unique_lock lock(mutex_);
    for (std::uint64_t number = 0; !stop_; ++number) {
      writer.Write({number, {}});
      changed_.wait_for(lock, std::chrono::milliseconds(2));
    }
  }
  std::mutex mutex_;
  std::condition_variable changed_;
  bool stop_ = false;
  std::thread thread_;
};

int Main(int argc, char** argv) {
  House house("test_house", "hears and is heard");
  if (const auto exit_code = house.Open(argc, argv)) {
    return *exit_code;
  }
  std::atomic<int> heard = 0;
  auto reader = PlainReader::Open(house.bus(), {"test/setpoint", "abc123", "setpoint"},
                                  [&](const PlainSample&, const Arrival&) { ++heard; });
  auto state = PlainWriter::Open(house.bus(), {"test/state", "abc123", "state"});
  auto description = PlainWriter::Open(house.bus(), {"test/description", "abc123", "description"});
  if (!reader.ok() || !state.ok() || !description.ok()) {
    return house.Refuse(reader.status());
  }
  description->Write({42, {}});
  HeardRpc rpc(heard);
  house.rpc().Add(rpc, v1::EchoService::service_full_name());
  auto ticker = std::make_unique<Ticker>(*state);
  house.OnStop([&] { ticker.reset(); });
  return house.Run();
}

}  // namespace
}  // namespace lambdajet::test

int main(int argc, char** argv) { return lambdajet::test::Main(argc, argv); }
