#include "cell/rpc/planner.hpp"

#include <chrono>
#include <utility>

#include "foundation/contract/trouble.hpp"
#include "lambdajet/trajectory/v1/trajectory.grpc.pb.h"
#include "platform/rpc/channel.hpp"

namespace lambdajet::cell {
namespace {

using trajectory::v1::TrajectoryService;

constexpr double kAdmit_s = 60.0;
constexpr double kCall_s = 5.0;
constexpr double kPlanning_s = 600.0;
constexpr auto kPoll = std::chrono::milliseconds(20);
constexpr auto kWatchPeriod = std::chrono::milliseconds(500);
constexpr double kHealth_s = 1.0;

std::vector<ProgramFault> FromWire(
    const google::protobuf::RepeatedPtrField<trajectory::v1::ProgramFault>& wire) {
  std::vector<ProgramFault> faults;
  for (const auto& fault : wire) {
    faults.push_back({fault.line(), fault.column(), fault.reason(), fault.message()});
  }
  return faults;
}

PlanFacts FromWire(const trajectory::v1::PlanSummary& wire) {
  return {wire.plan_id(),
          wire.segment_count(),
          wire.gate_count(),
          wire.event_count(),
          wire.duration_s(),
          wire.gate_time_s(),
          wire.elastic_lag_s2(),
          wire.length_mm(),
          wire.predicted_95_mm(),
          {wire.model_version().machine_id(), wire.model_version().version(), wire.model_version().hash()}};
}

trajectory::v1::PlanOptions OptionsOf(const JobOrder& order, const std::optional<ResumeFrom>& from) {
  trajectory::v1::PlanOptions options;
  options.set_compensate(order.compensate);
  options.set_feed_scale(order.feed_scale);
  if (order.pins_version) {
    options.set_machine_version(order.machine_version);
  }
  if (from) {
    options.set_start_from_s_mm(from->s_mm);
    options.set_overlap_mm(from->overlap_mm);
  }
  return options;
}

// Program, format and a drawing's settings, into a request that carries them.
template <typename Request>
void FillProgram(const JobOrder& order, const std::string& program, Request& request) {
  request.set_program(program);
  request.set_format(static_cast<type::v1::ProgramFormat>(order.program_format));
  if (order.program_format == ProgramFormat::kDxf) {
    (void)request.mutable_toolpath()->ParseFromString(order.toolpath);
  }
}

bool IsPassing(const absl::Status& status) {
  return status.code() == absl::StatusCode::kUnavailable ||
         status.code() == absl::StatusCode::kDeadlineExceeded ||
         status.code() == absl::StatusCode::kResourceExhausted ||
         TroubleReason(status) == "NO_MACHINE_DESCRIPTION";
}

std::string ReasonOf(const absl::Status& status) {
  const std::string reason = TroubleReason(status);
  const bool silent =
      status.code() == absl::StatusCode::kUnavailable || status.code() == absl::StatusCode::kDeadlineExceeded;
  return silent || reason.empty() ? "TRAJECTORY_UNREACHABLE" : reason;
}

std::string MessageOf(const absl::Status& status) { return "trajectory: " + std::string(status.message()); }

}  // namespace

// What is made of one plan.
struct Planned {
  absl::Status trouble;
  std::vector<ProgramFault> faults;
  std::optional<PlanFacts> plan;
};

class Planner::Trajectory {
 public:
  explicit Trajectory(std::shared_ptr<grpc::Channel> channel)
      : channel_(std::move(channel)), stub_(channel_) {}

  absl::Status Admit(const AdmissionTask& task, trajectory::v1::AdmitProgramResponse& response) {
    trajectory::v1::AdmitProgramRequest request;
    FillProgram(task.order, task.program, request);
    *request.mutable_options() = OptionsOf(task.order, std::nullopt);
    return Call(&TrajectoryService::Stub::AdmitProgram, stub_, request, response, kAdmit_s);
  }

  Planned Plan(const JobOrder& order, const std::string& program, const std::optional<ResumeFrom>& from,
               const std::atomic<bool>& stop) {
    trajectory::v1::PlanProgramRequest request;
    FillProgram(order, program, request);
    *request.mutable_options() = OptionsOf(order, from);
    trajectory::v1::PlanProgramResponse asked;
    if (absl::Status status = Call(&TrajectoryService::Stub::PlanProgram, stub_, request, asked, kAdmit_s);
        !status.ok()) {
      return {status, {}, std::nullopt};
    }
    return Await(asked.plan_id(), stop);
  }

  absl::Status Stream(std::uint64_t plan_id, std::optional<PlanFacts>& plan) {
    trajectory::v1::StartStreamingRequest request;
    request.set_plan_id(plan_id);
    trajectory::v1::StartStreamingResponse response;
    absl::Status status = Call(&TrajectoryService::Stub::StartStreaming, stub_, request, response, kCall_s);
    if (status.ok()) {
      plan = FromWire(response.summary());
    }
    return status;
  }

  absl::StatusOr<bool> Serving() { return AskServing(channel_, "", kHealth_s); }

 private:
  Planned Await(std::uint64_t plan_id, const std::atomic<bool>& stop) {
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::duration<double>(kPlanning_s);
    trajectory::v1::GetPlanRequest request;
    request.set_plan_id(plan_id);
    while (!stop && std::chrono::steady_clock::now() < deadline) {
      trajectory::v1::GetPlanResponse response;
      if (absl::Status status = Call(&TrajectoryService::Stub::GetPlan, stub_, request, response, kCall_s);
          !status.ok()) {
        return {status, {}, std::nullopt};
      }
      switch (response.operation().state()) {
        case type::v1::OPERATION_STATE_DONE:
          return {absl::OkStatus(), {}, FromWire(response.summary())};
        case type::v1::OPERATION_STATE_FAILED:
        case type::v1::OPERATION_STATE_CANCELLED:
          return Failed(response);
        default:
          std::this_thread::sleep_for(kPoll);
      }
    }
    return {Trouble(absl::StatusCode::kDeadlineExceeded, "PLANNING_TIMEOUT", "planning took too long"),
            {},
            std::nullopt};
  }

  static Planned Failed(const trajectory::v1::GetPlanResponse& response) {
    if (response.faults_size() > 0) {
      return {absl::OkStatus(), FromWire(response.faults()), std::nullopt};
    }
    const std::string& reason = response.operation().reason();
    return {Trouble(absl::StatusCode::kFailedPrecondition, reason.empty() ? "PLANNING_FAILED" : reason,
                    response.operation().message()),
            {},
            std::nullopt};
  }

  std::shared_ptr<grpc::Channel> channel_;
  TrajectoryService::Stub stub_;
};

absl::StatusOr<std::unique_ptr<Planner>> Planner::Open(JobDesk& desk, const CellConfig& config) {
  ChannelOptions options;
  options.address = config.trajectory_address;
  options.ca_file = config.trajectory_ca_file;
  options.certificate_file = config.trajectory_certificate_file;
  options.key_file = config.trajectory_key_file;
  auto channel = OpenChannel(options);
  if (!channel.ok()) {
    return channel.status();
  }
  return std::make_unique<Planner>(desk, *channel);
}

Planner::Planner(JobDesk& desk, std::shared_ptr<grpc::Channel> trajectory)
    : desk_(desk),
      trajectory_(std::make_unique<Trajectory>(std::move(trajectory))),
      admit_([this] { Admit(); }),
      serve_([this] { Serve(); }),
      watch_([this] { Watch(); }) {}

Planner::~Planner() {
  stop_ = true;
  desk_.Close();
  admit_.join();
  serve_.join();
  watch_.join();
}

void Planner::Admit() {
  while (const auto task = desk_.NextAdmission()) {
    desk_.Admitted(task->order.job_id, AdmitOne(*task));
  }
}

Admission Planner::AdmitOne(const AdmissionTask& task) {
  using enum Admission::Verdict;
  const auto trouble = [](const absl::Status& status) {
    return Admission{
        IsPassing(status) ? kTryAgain : kFailed, std::nullopt, {}, ReasonOf(status), MessageOf(status)};
  };
  trajectory::v1::AdmitProgramResponse admitted;
  if (const absl::Status status = trajectory_->Admit(task, admitted); !status.ok()) {
    return trouble(status);
  }
  if (!admitted.admitted()) {
    return {kRefused, std::nullopt, FromWire(admitted.faults()), "PROGRAM_REFUSED",
            "the program cannot be cut; see the faults"};
  }
  const Planned planned = trajectory_->Plan(task.order, task.program, std::nullopt, stop_);
  if (!planned.trouble.ok()) {
    return trouble(planned.trouble);
  }
  if (!planned.plan) {
    return {kRefused, std::nullopt, planned.faults, "PROGRAM_REFUSED",
            "the program cannot be planned; see the faults"};
  }
  return {kAdmitted, planned.plan, {}, "", ""};
}

void Planner::Serve() {
  while (const auto task = desk_.NextMachineTask()) {
    ServeOne(*task);
  }
}

void Planner::ServeOne(const MachineTask& task) {
  const std::string& job_id = task.order.job_id;
  if (task.plan_id == 0) {
    const Planned planned = trajectory_->Plan(task.order, task.program, task.from, stop_);
    const bool broke = !planned.trouble.ok();
    return desk_.Answer(PlanOutcome{job_id, planned.plan, planned.faults,
                                    broke ? ReasonOf(planned.trouble) : "",
                                    broke ? MessageOf(planned.trouble) : ""});
  }
  StreamingOutcome outcome{job_id, task.plan_id, "", ""};
  absl::Status status = trajectory_->Stream(task.plan_id, outcome.plan);
  if (status.code() == absl::StatusCode::kNotFound) {
    const Planned planned = trajectory_->Plan(task.order, task.program, task.from, stop_);
    status = planned.trouble;
    if (status.ok() && (!planned.plan || planned.plan->plan_id != task.plan_id)) {
      status = Trouble(absl::StatusCode::kFailedPrecondition, "PLAN_CHANGED",
                       "trajectory plans this program differently now; the machine version has changed");
    }
    if (status.ok()) {
      status = trajectory_->Stream(task.plan_id, outcome.plan);
    }
  }
  if (!status.ok()) {
    outcome.reason = ReasonOf(status);
    outcome.message = MessageOf(status);
  }
  desk_.Answer(outcome);
}

// Whether trajectory serves, for the machine state.
void Planner::Watch() {
  auto next = std::chrono::steady_clock::now();
  while (!stop_) {
    const auto serving = trajectory_->Serving();
    desk_.HearService("trajectory", serving.ok() && *serving, serving.ok() ? "" : "NOT_REACHED");
    next += kWatchPeriod;
    while (!stop_ && std::chrono::steady_clock::now() < next) {
      std::this_thread::sleep_for(kPoll);
    }
  }
}

}  // namespace lambdajet::cell
