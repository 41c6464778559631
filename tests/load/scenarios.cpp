#include "tests/load/scenarios.hpp"

#include <grpcpp/grpcpp.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <thread>

#include "foundation/contract/trouble.hpp"
#include "lambdajet/cell/v1/cell.grpc.pb.h"
#include "lambdajet/kinematics/v1/kinematics.grpc.pb.h"
#include "platform/rpc/channel.hpp"

namespace lambdajet::load {
namespace {

namespace cell_wire = cell::v1;
namespace kinematics_wire = kinematics::v1;
using cell_wire::CellService;
using kinematics_wire::KinematicsService;
using Answered = std::function<void(const absl::Status&)>;

constexpr double kQuestionDeadline_s = 10.0;

// One question on its way; lives until its answer.
template <typename Request, typename Response>
struct Asked {
  grpc::ClientContext context;
  Request request;
  Response response;
};

// `call` starts the asynchronous call; `check` looks at an answer.
template <typename Request, typename Response, typename Call>
void Ask(Request request, Answered answered, Call&& call,
         std::function<absl::Status(const Response&)> check = nullptr) {
  auto asked = std::make_shared<Asked<Request, Response>>();
  asked->request = std::move(request);
  SetDeadline(asked->context, kQuestionDeadline_s);
  call(&asked->context, &asked->request, &asked->response,
       [asked, answered, check](const grpc::Status& status) {
         answered(!status.ok() ? FromWire(status) : check ? check(asked->response) : absl::OkStatus());
       });
}

// Open WatchJobs streams with a thread each, ended by Stop().
class Watchers {
 public:
  Watchers(const Channels& channels, int count) {
    for (int i = 0; i < count; ++i) {
      contexts_.push_back(std::make_unique<grpc::ClientContext>());
      threads_.emplace_back([this, channel = channels[static_cast<std::size_t>(i) % channels.size()],
                             context = contexts_.back().get()] {
        CellService::Stub stub(channel);
        cell_wire::WatchJobsRequest request;
        request.set_period_s(0.5);
        const auto stream = stub.WatchJobs(context, request);
        cell_wire::JobEvent event;
        while (stream->Read(&event)) {
          ++events_;
        }
        const grpc::Status end = stream->Finish();
        broken_ += end.error_code() == grpc::StatusCode::CANCELLED ? 0 : 1;
      });
    }
  }
  ~Watchers() { Stop(); }

  void Stop() {
    for (const auto& context : contexts_) {
      context->TryCancel();
    }
    for (std::thread& thread : threads_) {
      thread.join();
    }
    threads_.clear();
  }
  std::uint64_t events() const { return events_; }
  std::uint64_t broken() const { return broken_; }

 private:
  std::vector<std::unique_ptr<grpc::ClientContext>> contexts_;
  std::vector<std::thread> threads_;
  std::atomic<std::uint64_t> events_ = 0;
  std::atomic<std::uint64_t> broken_ = 0;
};

// A job to ask about: one that is there, or one submitted for it, which needs no machine.
absl::StatusOr<std::string> AnyJob(CellService::Stub& stub) {
  cell_wire::ListJobsResponse jobs;
  absl::Status status = Call(&CellService::Stub::ListJobs, stub, cell_wire::ListJobsRequest(), jobs);
  if (!status.ok() || jobs.jobs_size() > 0) {
    return status.ok() ? absl::StatusOr<std::string>(jobs.jobs(0).job_id()) : status;
  }
  cell_wire::SubmitJobRequest submit;
  submit.set_request_id("load-" +
                        std::to_string(std::chrono::system_clock::now().time_since_epoch().count()));
  submit.set_name("asked about by the load test");
  submit.set_program("G21 G90 G17\nG0 X10 Y10\nM30\n");
  cell_wire::SubmitJobResponse submitted;
  status = Call(&CellService::Stub::SubmitJob, stub, submit, submitted);
  if (!status.ok()) {
    return status;
  }
  return submitted.job().job_id();
}

}  // namespace

absl::StatusOr<Measured> RunMesPolling(const Channels& channels, const Pace& pace, int watchers) {
  std::vector<std::unique_ptr<CellService::Stub>> stubs;
  for (const auto& channel : channels) {
    stubs.push_back(CellService::NewStub(channel));
  }
  const auto job_id = AnyJob(*stubs.front());
  if (!job_id.ok()) {
    return job_id.status();
  }
  Watchers watching(channels, watchers);
  Measured measured = RunOpenLoop(
      "MES polling with " + std::to_string(watchers) + " watchers", pace,
      [&](std::uint64_t n, Answered answered) {
        auto* stub = stubs[n % stubs.size()]->async();
        if (n % 10 < 6) {
          cell_wire::GetJobRequest request;
          request.set_job_id(*job_id);
          Ask<cell_wire::GetJobRequest, cell_wire::GetJobResponse>(
              request, std::move(answered), [stub](auto... arguments) { stub->GetJob(arguments...); });
        } else if (n % 10 < 8) {
          Ask<cell_wire::ListJobsRequest, cell_wire::ListJobsResponse>(
              {}, std::move(answered), [stub](auto... arguments) { stub->ListJobs(arguments...); });
        } else {
          Ask<cell_wire::GetMachineStateRequest, cell_wire::GetMachineStateResponse>(
              {}, std::move(answered), [stub](auto... arguments) { stub->GetMachineState(arguments...); });
        }
      });
  watching.Stop();
  measured.further["watchers' events"] = static_cast<double>(watching.events());
  if (watching.broken() > 0) {
    measured.errors["WATCH_BROKEN"] += watching.broken();
  }
  return measured;
}

absl::StatusOr<Measured> RunCamBatches(const Channels& channels, const Pace& pace, int batch_poses) {
  std::vector<std::unique_ptr<KinematicsService::Stub>> stubs;
  for (const auto& channel : channels) {
    stubs.push_back(KinematicsService::NewStub(channel));
  }
  // Poses over the middle of the demonstration machine's reach, on a spiral.
  kinematics_wire::SolveInverseBatchRequest request;
  request.set_stride(2);
  for (int i = 0; i < batch_poses; ++i) {
    const double turn = 0.05 * i;
    const double radius = 150.0 * static_cast<double>(i) / batch_poses;
    request.add_pose(450.0 + radius * std::cos(turn));
    request.add_pose(650.0 + radius * std::sin(turn));
  }
  const auto check = [batch_poses](const kinematics_wire::SolveInverseBatchResponse& response) {
    if (response.reason_size() != batch_poses || response.refused_count() != 0) {
      return Trouble(absl::StatusCode::kInternal, "WRONG_ANSWER", "a pose of the batch was not solved");
    }
    return absl::OkStatus();
  };
  kinematics_wire::SolveInverseBatchResponse first;
  absl::Status status = Call(&KinematicsService::Stub::SolveInverseBatch, *stubs.front(), request, first);
  status = status.ok() ? check(first) : status;
  if (!status.ok()) {
    return status;
  }
  Measured measured = RunOpenLoop(
      "CAM, batches of " + std::to_string(batch_poses) + " poses", pace,
      [&](std::uint64_t n, Answered answered) {
        auto* stub = stubs[n % stubs.size()]->async();
        Ask<kinematics_wire::SolveInverseBatchRequest, kinematics_wire::SolveInverseBatchResponse>(
            request, std::move(answered),
            [stub](auto... arguments) { stub->SolveInverseBatch(arguments...); }, check);
      });
  measured.further["poses a second"] =
      static_cast<double>(measured.latency.count()) * batch_poses / pace.duration_s;
  return measured;
}

}  // namespace lambdajet::load
