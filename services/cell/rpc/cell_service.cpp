#include "cell/rpc/cell_service.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <utility>

#include "cell/rpc/watch_hub.hpp"
#include "cell/rpc/wire.hpp"
#include "platform/rpc/argument_checks.hpp"

namespace lambdajet::cell {
namespace {

constexpr std::size_t kWaitingThreads = 8;
constexpr std::size_t kMostWaitingCalls = 256;
constexpr double kLongestAdmissionWait_s = 10.0;
constexpr double kLongestMachineWait_s = 120.0;
constexpr double kAnswerMargin_s = 0.2;  // left of the deadline for the answer's way back
constexpr double kLargestOverride = 1.2;
constexpr double kLargestOverlap_mm = 1000.0;
constexpr int kDefaultPage = 20;
constexpr int kLargestPage = 100;
constexpr double kDefaultWatchPeriod_s = 0.5;

double PatienceOf(const grpc::CallbackServerContext& context, double most_s) {
  const auto left = context.deadline() - std::chrono::system_clock::now();
  const double left_s = std::chrono::duration<double>(left).count();
  return std::clamp(left_s - kAnswerMargin_s, 0.0, most_s);
}

}  // namespace

CellDoor::CellDoor(JobDesk& desk, const Clock& clock)
    : desk_(desk),
      clock_(clock),
      pool_(kWaitingThreads, kMostWaitingCalls),
      watches_(std::make_unique<WatchHub>(desk)) {}
CellDoor::~CellDoor() = default;
void CellDoor::Close() { watches_->Close(); }

template <typename Response>
grpc::ServerUnaryReactor* CellDoor::AnswerJob(grpc::CallbackServerContext* context, const std::string& job_id,
                                              Response* response,
                                              std::function<absl::StatusOr<LiveJob>(double patience_s)> ask) {
  const double patience_s = PatienceOf(*context, kLongestMachineWait_s);
  return AnswerOn(pool_, context,
                  [job_id, response, ask = std::move(ask), patience_s](const Cancelled&) -> absl::Status {
                    if (absl::Status status = CheckJobId(job_id); !status.ok()) {
                      return status;
                    }
                    const absl::StatusOr<LiveJob> job = ask(patience_s);
                    if (job.ok()) {
                      *response->mutable_job() = ToWire(*job);
                    }
                    return job.status();
                  });
}

grpc::ServerUnaryReactor* CellDoor::SubmitJob(grpc::CallbackServerContext* context,
                                              const v1::SubmitJobRequest* request,
                                              v1::SubmitJobResponse* response) {
  const double patience_s = PatienceOf(*context, kLongestAdmissionWait_s);
  return AnswerOn(pool_, context, [this, request, response, patience_s](const Cancelled&) -> absl::Status {
    const auto submission = FromWire(*request);
    if (!submission.ok()) {
      return submission.status();
    }
    const auto job = desk_.Submit(*submission, patience_s);
    if (job.ok()) {
      *response->mutable_job() = ToWire(*job);
    }
    return job.status();
  });
}

grpc::ServerUnaryReactor* CellDoor::StartJob(grpc::CallbackServerContext* context,
                                             const v1::StartJobRequest* request,
                                             v1::StartJobResponse* response) {
  return AnswerJob(context, request->job_id(), response,
                   [this, request](double patience_s) { return desk_.Start(request->job_id(), patience_s); });
}

grpc::ServerUnaryReactor* CellDoor::HoldJob(grpc::CallbackServerContext* context,
                                            const v1::HoldJobRequest* request,
                                            v1::HoldJobResponse* response) {
  return AnswerJob(context, request->job_id(), response,
                   [this, request](double patience_s) { return desk_.Hold(request->job_id(), patience_s); });
}

grpc::ServerUnaryReactor* CellDoor::ResumeJob(grpc::CallbackServerContext* context,
                                              const v1::ResumeJobRequest* request,
                                              v1::ResumeJobResponse* response) {
  return AnswerJob(
      context, request->job_id(), response, [this, request](double patience_s) -> absl::StatusOr<LiveJob> {
        const double overlap_mm = request->has_overlap_mm() ? request->overlap_mm() : kDefaultOverlap_mm;
        ArgumentChecks checks;
        checks.InRange("overlap_mm", overlap_mm, 0.0, kLargestOverlap_mm, "mm");
        return checks.ok() ? desk_.Resume(request->job_id(), overlap_mm, patience_s) : checks.status();
      });
}

grpc::ServerUnaryReactor* CellDoor::StopJob(grpc::CallbackServerContext* context,
                                            const v1::StopJobRequest* request,
                                            v1::StopJobResponse* response) {
  return Answer(context, [&]() -> absl::Status {
    if (absl::Status status = CheckJobId(request->job_id()); !request->job_id().empty() && !status.ok()) {
      return status;
    }
    const auto job = desk_.Stop(request->job_id());
    if (job.ok() && *job) {
      *response->mutable_job() = ToWire(**job);
    }
    return job.status();
  });
}

grpc::ServerUnaryReactor* CellDoor::CancelJob(grpc::CallbackServerContext* context,
                                              const v1::CancelJobRequest* request,
                                              v1::CancelJobResponse* response) {
  return AnswerJob(context, request->job_id(), response,
                   [this, request](double) { return desk_.Cancel(request->job_id()); });
}

grpc::ServerUnaryReactor* CellDoor::SetFeedOverride(grpc::CallbackServerContext* context,
                                                    const v1::SetFeedOverrideRequest* request,
                                                    v1::SetFeedOverrideResponse* response) {
  const double patience_s = PatienceOf(*context, kLongestAdmissionWait_s);
  return AnswerOn(pool_, context, [this, request, response, patience_s](const Cancelled&) -> absl::Status {
    ArgumentChecks checks;
    checks.InRange("feed_override", request->feed_override(), 0.0, kLargestOverride);
    if (!checks.ok()) {
      return checks.status();
    }
    const auto confirmed = desk_.Override(request->feed_override(), patience_s);
    response->set_feed_override(confirmed.value_or(0.0));
    return confirmed.status();
  });
}

grpc::ServerUnaryReactor* CellDoor::ResetMachine(grpc::CallbackServerContext* context,
                                                 const v1::ResetMachineRequest*,
                                                 v1::ResetMachineResponse* response) {
  const double patience_s = PatienceOf(*context, kLongestMachineWait_s);
  return AnswerOn(pool_, context, [this, response, patience_s](const Cancelled&) -> absl::Status {
    const auto machine = desk_.Reset(patience_s);
    if (machine.ok()) {
      *response->mutable_state() = ToWire(*machine);
    }
    return machine.status();
  });
}

grpc::ServerUnaryReactor* CellDoor::GetJob(grpc::CallbackServerContext* context,
                                           const v1::GetJobRequest* request, v1::GetJobResponse* response) {
  return Answer(context, [&]() -> absl::Status {
    if (absl::Status status = CheckJobId(request->job_id()); !status.ok()) {
      return status;
    }
    const auto job = desk_.Find(request->job_id());
    if (job.ok()) {
      *response->mutable_job() = ToWire(*job);
    }
    return job.status();
  });
}

grpc::ServerUnaryReactor* CellDoor::ListJobs(grpc::CallbackServerContext* context,
                                             const v1::ListJobsRequest* request,
                                             v1::ListJobsResponse* response) {
  return Answer(context, [&]() -> absl::Status {
    ArgumentChecks checks;
    checks.Require(
        request->page_size() >= 0 && request->page_size() <= kLargestPage, "page_size", "OUT_OF_RANGE",
        fmt::format("{}; 1 to {} is right, 0 means {}", request->page_size(), kLargestPage, kDefaultPage));
    std::int64_t before = 0;
    const std::string& token = request->page_token();
    const auto read = std::from_chars(token.data(), token.data() + token.size(), before);
    checks.Require(
        token.empty() || (read.ec == std::errc{} && read.ptr == token.data() + token.size() && before > 0),
        "page_token", "BAD_PAGE_TOKEN", "it is not one that ListJobs gave");
    checks.Require(v1::JobState_IsValid(request->state()), "state", "OUT_OF_RANGE",
                   fmt::format("{} is no JobState", static_cast<int>(request->state())));
    if (!checks.ok()) {
      return checks.status();
    }
    const int page = request->page_size() == 0 ? kDefaultPage : request->page_size();
    std::int64_t last = 0;
    const auto jobs = desk_.List(before, FromWire(request->state()), page, last);
    if (!jobs.ok()) {
      return jobs.status();
    }
    for (const LiveJob& job : *jobs) {
      *response->add_jobs() = ToWire(job);
    }
    if (static_cast<int>(jobs->size()) == page) {
      response->set_next_page_token(std::to_string(last));
    }
    return absl::OkStatus();
  });
}

grpc::ServerWriteReactor<v1::JobEvent>* CellDoor::WatchJobs(grpc::CallbackServerContext*,
                                                            const v1::WatchJobsRequest* request) {
  const double period_s = request->has_period_s() ? request->period_s() : kDefaultWatchPeriod_s;
  ArgumentChecks checks;
  checks.InRange("period_s", period_s, 0.05, 10.0, "s");
  checks.Require(request->resume_token() <= desk_.last_token(), "resume_token", "UNKNOWN_RESUME_TOKEN",
                 fmt::format("{}; the journal ends at {}", request->resume_token(), desk_.last_token()));
  absl::Status status = checks.status();
  if (status.ok() && !request->job_id().empty()) {
    status = CheckJobId(request->job_id());
    status.Update(status.ok() ? desk_.Find(request->job_id()).status() : absl::OkStatus());
  }
  return watches_->Open(request->resume_token(), request->job_id(), period_s, status);
}

grpc::ServerUnaryReactor* CellDoor::GetReport(grpc::CallbackServerContext* context,
                                              const v1::GetReportRequest* request,
                                              v1::GetReportResponse* response) {
  return AnswerOn(pool_, context, [this, request, response](const Cancelled&) -> absl::Status {
    if (absl::Status status = CheckJobId(request->job_id()); !status.ok()) {
      return status;
    }
    const auto job = desk_.Find(request->job_id());
    const auto record = job.ok() ? desk_.Record(request->job_id()) : job.status();
    if (record.ok()) {
      *response = ToWire(*job, *record, clock_.now_ns());
    }
    return record.status();
  });
}

grpc::ServerUnaryReactor* CellDoor::GetMachineState(grpc::CallbackServerContext* context,
                                                    const v1::GetMachineStateRequest*,
                                                    v1::GetMachineStateResponse* response) {
  return Answer(context, [&] {
    *response->mutable_state() = ToWire(desk_.Machine());
    return absl::OkStatus();
  });
}

}  // namespace lambdajet::cell
