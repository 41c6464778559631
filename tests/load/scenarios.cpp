#include "tests/load/scenarios.hpp"

#include <grpcpp/grpcpp.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <thread>

#include "foundation/contract/trouble.hpp"
#include "lambdajet/cell/v1/cell.grpc.pb.h"
#include "lambdajet/kinematics/v1/kinematics.grpc.pb.h"
#include "lambdajet/trajectory/v1/trajectory.grpc.pb.h"
#include "platform/rpc/channel.hpp"

namespace lambdajet::load {
namespace {

namespace cell_wire = cell::v1;
namespace kinematics_wire = kinematics::v1;
namespace trajectory_wire = trajectory::v1;
using cell_wire::CellService;
using kinematics_wire::KinematicsService;
using trajectory_wire::TrajectoryService;
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

// A plate with a bore, small enough that planning it takes some hundredths of a second.
constexpr const char* kPlate =
    "G21 G90 G17\nF3600\nG0 X300 Y300\nM3 P0.3\nG1 X309.6\nG3 X309.6 Y300 I-9.6 J0\nM5\nG0 X262 Y300\nM3 "
    "P0.3\nG1 X269.6 Y300\n"
    "G1 Y320\nG2 X270 Y320.4 I0.4 J0\nG1 X330\nG2 X330.4 Y320 I0 J-0.4\nG1 Y280\nG2 X330 Y279.6 I-0.4 J0\nG1 "
    "X270\n"
    "G2 X269.6 Y280 I0 J0.4\nG1 Y301\nM5\nM2\n";

// Reads a stream to its end; lives until then.
template <typename Request, typename Message>
class StreamAsked final : public grpc::ClientReadReactor<Message> {
 public:
  using Look = std::function<void(const Message&)>;

  template <typename Open>
  static void Start(Request request, Answered answered, Look look, Open&& open) {
    auto* stream = new StreamAsked(std::move(request), std::move(answered), std::move(look));
    SetDeadline(stream->context_, kQuestionDeadline_s);
    open(&stream->context_, &stream->request_, stream);
    stream->StartRead(&stream->message_);
    stream->StartCall();
  }
  void OnReadDone(bool ok) override {
    if (ok) {
      look_(message_);
      this->StartRead(&message_);
    }
  }
  void OnDone(const grpc::Status& status) override {
    answered_(status.ok() ? absl::OkStatus() : FromWire(status));
    delete this;
  }

 private:
  StreamAsked(Request request, Answered answered, Look look)
      : request_(std::move(request)), answered_(std::move(answered)), look_(std::move(look)) {}

  grpc::ClientContext context_;
  Request request_;
  Message message_;
  Answered answered_;
  Look look_;
};

// What the questions about programs share; held by every question on its way, as the run may end before the last answer.
class Planning : public std::enable_shared_from_this<Planning> {
 public:
  explicit Planning(const Channels& channels) {
    for (const auto& channel : channels) {
      stubs_.push_back(TrajectoryService::NewStub(channel));
    }
  }

  // Admits the program and makes the first plan.
  absl::Status Begin() {
    trajectory_wire::AdmitProgramRequest request;
    request.set_program(kPlate);
    trajectory_wire::AdmitProgramResponse admitted;
    absl::Status status = Call(&TrajectoryService::Stub::AdmitProgram, *stubs_.front(), request, admitted);
    if (status.ok() && !admitted.admitted()) {
      return Trouble(absl::StatusCode::kFailedPrecondition, "PROGRAM_REFUSED", admitted.ShortDebugString());
    }
    trajectory_wire::PlanProgramResponse planned;
    status.Update(Call(&TrajectoryService::Stub::PlanProgram, *stubs_.front(), PlanRequest(0), planned));
    grpc::ClientContext context;
    trajectory_wire::WatchPlanRequest watch;
    watch.set_plan_id(planned.plan_id());
    const auto stream = stubs_.front()->WatchPlan(&context, watch);
    for (trajectory_wire::GetPlanResponse plan; stream->Read(&plan);) {
      newest_ = plan.has_summary() ? plan.summary().plan_id() : newest_.load();
    }
    status.Update(FromWire(stream->Finish()));
    return status.ok() && newest_ == 0
               ? Trouble(absl::StatusCode::kFailedPrecondition, "NOT_PLANNED", "the first plan has failed")
               : status;
  }

  void Ask(std::uint64_t n, Answered answered) {
    auto* stub = stubs_[n % stubs_.size()]->async();
    switch (n % 10) {
      case 2:
      case 7:
        return List(*stub, std::move(answered));
      case 3:
      case 8:
        return Sample(*stub, std::move(answered));
      case 4:
      case 9:
        return Plan(*stub, n, std::move(answered));
      default:
        return Admit(*stub, std::move(answered));
    }
  }

  double points() const { return static_cast<double>(points_); }
  double plans() const { return static_cast<double>(plans_); }

 private:
  using Async = class TrajectoryService::Stub::async;

  // Every n its own feed, so its own plan.
  static trajectory_wire::PlanProgramRequest PlanRequest(std::uint64_t n) {
    trajectory_wire::PlanProgramRequest request;
    request.set_program(kPlate);
    request.mutable_options()->set_feed_scale(1.0 - 1e-6 * static_cast<double>(n % 500'000));
    return request;
  }

  static absl::Status Wrong(const char* what) {
    return Trouble(absl::StatusCode::kInternal, "WRONG_ANSWER", what);
  }

  void Admit(Async& stub, Answered answered) {
    trajectory_wire::AdmitProgramRequest request;
    request.set_program(kPlate);
    load::Ask<trajectory_wire::AdmitProgramRequest, trajectory_wire::AdmitProgramResponse>(
        request, std::move(answered), [&stub](auto... arguments) { stub.AdmitProgram(arguments...); },
        [](const auto& response) { return response.admitted() ? absl::OkStatus() : Wrong("not admitted"); });
  }

  void List(Async& stub, Answered answered) {
    trajectory_wire::ListOperationsRequest request;
    request.set_program(kPlate);
    load::Ask<trajectory_wire::ListOperationsRequest, trajectory_wire::ListOperationsResponse>(
        request, std::move(answered), [&stub](auto... arguments) { stub.ListOperations(arguments...); },
        [](const auto& response) {
          return response.operations_size() > 10 ? absl::OkStatus() : Wrong("operations are missing");
        });
  }

  void Sample(Async& stub, Answered answered) {
    trajectory_wire::StreamSamplesRequest request;
    request.set_plan_id(newest_);
    StreamAsked<trajectory_wire::StreamSamplesRequest, trajectory_wire::SampleBatch>::Start(
        request, std::move(answered),
        [self = shared_from_this()](const auto& batch) {
          self->points_ += static_cast<std::uint64_t>(batch.cutting_size());
        },
        [&stub](auto... arguments) { stub.StreamSamples(arguments...); });
  }

  void Plan(Async& stub, std::uint64_t n, Answered answered) {
    auto asked =
        std::make_shared<Asked<trajectory_wire::PlanProgramRequest, trajectory_wire::PlanProgramResponse>>();
    asked->request = PlanRequest(n);
    SetDeadline(asked->context, kQuestionDeadline_s);
    stub.PlanProgram(&asked->context, &asked->request, &asked->response,
                     [self = shared_from_this(), &stub, asked,
                      answered = std::move(answered)](const grpc::Status& status) {
                       status.ok() ? self->Watch(stub, asked->response.plan_id(), answered)
                                   : answered(FromWire(status));
                     });
  }

  void Watch(Async& stub, std::uint64_t plan_id, Answered answered) {
    trajectory_wire::WatchPlanRequest request;
    request.set_plan_id(plan_id);
    auto done = std::make_shared<bool>(false);
    StreamAsked<trajectory_wire::WatchPlanRequest, trajectory_wire::GetPlanResponse>::Start(
        request,
        [answered = std::move(answered), done](const absl::Status& status) {
          answered(status.ok() && !*done ? Wrong("the plan has failed") : status);
        },
        [self = shared_from_this(), done](const auto& plan) {
          if (plan.has_summary()) {
            *done = true;
            self->newest_ = plan.summary().plan_id();
            ++self->plans_;
          }
        },
        [&stub](auto... arguments) { stub.WatchPlan(arguments...); });
  }

  std::vector<std::unique_ptr<TrajectoryService::Stub>> stubs_;
  std::atomic<std::uint64_t> newest_ = 0;
  std::atomic<std::uint64_t> points_ = 0;
  std::atomic<std::uint64_t> plans_ = 0;
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

absl::StatusOr<Measured> RunPlanning(const Channels& channels, const Pace& pace) {
  const auto planning = std::make_shared<Planning>(channels);
  if (const absl::Status status = planning->Begin(); !status.ok()) {
    return status;
  }
  Measured measured =
      RunOpenLoop("CAM, programs admitted, planned, listed and sampled", pace,
                  [planning](std::uint64_t n, Answered answered) { planning->Ask(n, std::move(answered)); });
  measured.further["plans a second"] = planning->plans() / pace.duration_s;
  measured.further["points a second"] = planning->points() / pace.duration_s;
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
