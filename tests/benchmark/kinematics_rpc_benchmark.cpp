// Prints what gRPC lets through: batches of lambda poses a second and the median of one unary solve, each beside a bare echo
// of the same bytes with the same kind of server, taken in turns in the same run.
//
// The echo's handlers are callback handlers as ours are, without parsing, computing, metrics or limits: what no service can
// be faster than with this transport.
#include <grpcpp/grpcpp.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <memory>
#include <mutex>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "kinematics/rpc/kinematics_service.hpp"
#include "platform/rpc/channel.hpp"
#include "platform/rpc/rpc_server.hpp"

namespace lambdajet::kinematics {
namespace {

using Clock = std::chrono::steady_clock;
using BatchStub = v1::KinematicsService::Stub;

constexpr int kPosesPerMessage = 8'192;
constexpr int kMessages = 122;  // 10^6 poses
constexpr int kRounds = 9;

double Seconds(Clock::duration time) { return std::chrono::duration<double>(time).count(); }

double Median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<long>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

// The same callback handlers without messages: bytes in, bytes of the real answers' sizes out.
using RawService = v1::KinematicsService::WithRawCallbackMethod_SolveInverse<
    v1::KinematicsService::WithRawCallbackMethod_StreamInverse<v1::KinematicsService::Service>>;

class Echo final : public RawService {
 public:
  Echo(grpc::ByteBuffer unary, grpc::ByteBuffer batch) : unary_(std::move(unary)), batch_(std::move(batch)) {}

  grpc::ServerUnaryReactor* SolveInverse(grpc::CallbackServerContext* context, const grpc::ByteBuffer*,
                                         grpc::ByteBuffer* response) override {
    *response = unary_;
    grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
    reactor->Finish(grpc::Status::OK);
    return reactor;
  }

  grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>* StreamInverse(
      grpc::CallbackServerContext*) override {
    return new Reactor(batch_);
  }

 private:
  class Reactor final : public grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer> {
   public:
    explicit Reactor(const grpc::ByteBuffer& answer) : answer_(answer) { StartRead(&request_); }
    void OnReadDone(bool ok) override {
      const std::lock_guard lock(mutex_);
      if (ok) {
        ++owed_;
        StartRead(&request_);
      } else {
        ended_ = true;
      }
      Continue();
    }
    void OnWriteDone(bool ok) override {
      const std::lock_guard lock(mutex_);
      writing_ = false;
      ended_ = ended_ || !ok;
      Continue();
    }
    void OnDone() override { delete this; }

   private:
    // Reads on while it writes, as the real stream does.
    void Continue() {
      if (writing_ || finished_) {
        return;
      }
      if (owed_ > 0) {
        --owed_;
        writing_ = true;
        StartWrite(&answer_);
      } else if (ended_) {
        finished_ = true;
        Finish(grpc::Status::OK);
      }
    }

    std::mutex mutex_;
    grpc::ByteBuffer request_;
    grpc::ByteBuffer answer_;
    int owed_ = 0;
    bool writing_ = false;
    bool ended_ = false;
    bool finished_ = false;
  };

  grpc::ByteBuffer unary_;
  grpc::ByteBuffer batch_;
};

template <class Message>
grpc::ByteBuffer BytesOf(const Message& message) {
  const std::string text = message.SerializeAsString();
  const grpc::Slice slice(text);
  return grpc::ByteBuffer(&slice, 1);
}

v1::SolveInverseBatchRequest BatchRequest() {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> x(0.0, 800.0), y(300.0, 900.0);
  v1::SolveInverseBatchRequest request;
  request.set_stride(2);
  for (int i = 0; i < kPosesPerMessage; ++i) {
    request.add_pose(x(random));
    request.add_pose(y(random));
  }
  return request;
}

v1::SolveInverseRequest UnaryRequest() {
  v1::SolveInverseRequest request;
  request.mutable_p_de()->set_x(500.0);
  request.mutable_p_de()->set_y(700.0);
  return request;
}

MachineDescription PaperMachine() {
  MachineDescription machine;
  machine.machine_id = "demo-1";
  machine.hash = "0123456789ab";
  machine.parameters.head<kMechanismParameterCount>() = IdealLambda(1200, 600, 700);
  machine.actuators[0] = machine.actuators[1] = {-1600.0, 2600.0, 1500.0, 15000.0, 400000.0};
  machine.singular_margin_mm = 20.0;
  return machine;
}

// One server of ours, one that echoes, and a client for each: the client is the same generated code for both.
struct Pair {
  explicit Pair(KinematicsRpc& rpc, Echo& echo) : ours({}, nullptr, nullptr) {
    ours.Add(rpc, v1::KinematicsService::service_full_name());
    if (!ours.Start().ok()) {
      std::abort();
    }
    int port = 0;
    grpc::ServerBuilder builder;
    builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
    builder.SetMaxReceiveMessageSize(16 << 20);
    builder.RegisterService(&echo);
    bare = builder.BuildAndStart();
    solving = Connect(ours.port());
    echoing = Connect(port);
  }

  static std::unique_ptr<BatchStub> Connect(int port) {
    ChannelOptions options;
    options.address = "127.0.0.1:" + std::to_string(port);
    return v1::KinematicsService::NewStub(*OpenChannel(options));
  }

  RpcServer ours;
  std::unique_ptr<grpc::Server> bare;
  std::unique_ptr<BatchStub> solving;
  std::unique_ptr<BatchStub> echoing;
};

// Poses a second over one stream, both directions counted: sent and answered. The client parses every answer.
double PosesPerSecond(BatchStub& stub, const v1::SolveInverseBatchRequest& request) {
  grpc::ClientContext context;
  auto stream = stub.StreamInverse(&context);
  v1::SolveInverseBatchResponse response;
  stream->Write(request);
  stream->Read(&response);  // the connection stands, buffers are there
  const auto start = Clock::now();
  std::thread writer([&] {
    for (int i = 0; i < kMessages; ++i) {
      stream->Write(request);
    }
    stream->WritesDone();
  });
  int received = 0;
  while (stream->Read(&response)) {
    ++received;
  }
  writer.join();
  const double seconds = Seconds(Clock::now() - start);
  stream->Finish();
  return received == kMessages ? 1.0 * kMessages * kPosesPerMessage / seconds : 0.0;
}

double UnaryMedianMicroseconds(BatchStub& stub, const v1::SolveInverseRequest& request) {
  std::vector<double> times;
  v1::SolveInverseResponse response;
  for (int i = 0; i < 2'000; ++i) {
    grpc::ClientContext context;
    const auto start = Clock::now();
    if (!stub.SolveInverse(&context, request, &response).ok()) {
      return 0.0;
    }
    times.push_back(1e6 * Seconds(Clock::now() - start));
  }
  return Median(times);
}

int Run() {
  MachineSlot slot;
  slot.Publish(PaperMachine());
  KinematicsRpc rpc(slot);
  const KinematicsAnswers answers(slot);
  const auto batch = BatchRequest();
  const auto unary = UnaryRequest();
  v1::SolveInverseBatchResponse batch_answer;
  v1::SolveInverseResponse unary_answer;
  if (!answers.AnswerBatch(batch, batch_answer).ok() || !answers.SolveInverse(unary, unary_answer).ok()) {
    return 1;
  }
  Echo echo(BytesOf(unary_answer), BytesOf(batch_answer));
  Pair pair(rpc, echo);
  std::vector<double> solved, echoed, solve_us, echo_us;
  for (int i = 0; i < kRounds; ++i) {
    echoed.push_back(PosesPerSecond(*pair.echoing, batch));
    solved.push_back(PosesPerSecond(*pair.solving, batch));
    echo_us.push_back(UnaryMedianMicroseconds(*pair.echoing, unary));
    solve_us.push_back(UnaryMedianMicroseconds(*pair.solving, unary));
  }
  std::printf(
      "batch of %d messages of %d poses (%zu B out, %zu B back): solved %.2f million poses/s, bare echo "
      "%.2f, ratio %.3f\n",
      kMessages, kPosesPerMessage, batch.ByteSizeLong(), batch_answer.ByteSizeLong(), 1e-6 * Median(solved),
      1e-6 * Median(echoed), Median(solved) / Median(echoed));
  std::printf("unary SolveInverse: median %.1f us, bare echo %.1f us, ratio %.3f\n", Median(solve_us),
              Median(echo_us), Median(solve_us) / Median(echo_us));
  return 0;
}

}  // namespace
}  // namespace lambdajet::kinematics

int main() { return lambdajet::kinematics::Run(); }
