// The cell's door from outside: real gRPC on both sides, a stand-in for trajectory, a model of the modules.
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <limits>
#include <thread>

#include "cell/rpc/cell_service.hpp"
#include "cell/rpc/planner.hpp"
#include "foundation/contract/trouble.hpp"
#include "lambdajet/trajectory/v1/trajectory.grpc.pb.h"
#include "platform/rpc/channel.hpp"
#include "platform/rpc/rpc_server.hpp"
#include "tests/support/cell_machine_model.hpp"
#include "tests/support/eventually.hpp"
#include "tests/support/temporary_folder.hpp"

namespace lambdajet::cell {
namespace {

using test::Eventually;
using v1::CellService;

constexpr double kPathLength_mm = 50.0;
constexpr std::uint64_t kAnyPlan = 77;

// Trajectory as the cell needs it: programs that say BAD are refused, one that says SLOW takes until `finish_slow`.
class TrajectoryStandIn final : public trajectory::v1::TrajectoryService::Service {
 public:
  std::atomic<int> streaming_asked = 0;
  std::atomic<bool> finish_slow = false;
  std::atomic<bool> forgets_plans = false;

  grpc::Status AdmitProgram(grpc::ServerContext*, const trajectory::v1::AdmitProgramRequest* request,
                            trajectory::v1::AdmitProgramResponse* response) override {
    const bool bad = request->program().find("BAD") != std::string::npos;
    response->set_admitted(!bad);
    if (bad) {
      auto* fault = response->add_faults();
      fault->set_line(2);
      fault->set_column(5);
      fault->set_reason("UNKNOWN_WORD");
      fault->set_message("'BAD' is no word");
    }
    return grpc::Status::OK;
  }
  grpc::Status PlanProgram(grpc::ServerContext*, const trajectory::v1::PlanProgramRequest* request,
                           trajectory::v1::PlanProgramResponse* response) override {
    const bool resumes = request->options().has_start_from_s_mm();
    slow_ = request->program().find("SLOW") != std::string::npos;
    response->set_plan_id(resumes ? kAnyPlan + 1 : kAnyPlan);
    return grpc::Status::OK;
  }
  grpc::Status GetPlan(grpc::ServerContext*, const trajectory::v1::GetPlanRequest* request,
                       trajectory::v1::GetPlanResponse* response) override {
    if (slow_ && !finish_slow) {
      response->mutable_operation()->set_state(type::v1::OPERATION_STATE_RUNNING);
      return grpc::Status::OK;
    }
    response->mutable_operation()->set_state(type::v1::OPERATION_STATE_DONE);
    Fill(*response->mutable_summary(), request->plan_id());
    return grpc::Status::OK;
  }
  grpc::Status StartStreaming(grpc::ServerContext*, const trajectory::v1::StartStreamingRequest* request,
                              trajectory::v1::StartStreamingResponse* response) override {
    ++streaming_asked;
    Fill(*response->mutable_summary(), request->plan_id());
    return grpc::Status::OK;
  }

 private:
  static void Fill(trajectory::v1::PlanSummary& summary, std::uint64_t plan_id) {
    summary.set_plan_id(plan_id);
    summary.set_segment_count(100);
    summary.set_gate_count(2);
    summary.set_event_count(10);
    summary.set_duration_s(1.0);
    summary.set_length_mm(kPathLength_mm);
    summary.mutable_model_version()->set_machine_id("demo-1");
    summary.mutable_model_version()->set_version(3);
  }
  std::atomic<bool> slow_ = false;
};

// One cell with its loop; may be ended and begun again over the same journal.
class RunningCell {
 public:
  RunningCell(const std::string& path, const std::string& trajectory_address, MachineModel& machine,
              std::mutex& lock)
      : machine_(machine), machine_lock_(lock) {
    auto journal = Journal::Open(path);
    EXPECT_TRUE(journal.ok()) << journal.status();
    desk_ = std::make_unique<JobDesk>(std::move(*journal), clock_, kModelSession);
    EXPECT_TRUE(desk_->TakeUp().ok());
    ChannelOptions trajectory;
    trajectory.address = trajectory_address;
    planner_ = std::make_unique<Planner>(*desk_, *OpenChannel(trajectory));
    door_ = std::make_unique<CellDoor>(*desk_, clock_);
    server_ = std::make_unique<RpcServer>(RpcOptions{}, nullptr, nullptr);
    server_->Add(*door_, CellService::service_full_name());
    EXPECT_TRUE(server_->Start().ok());
    loop_ = std::thread([this] { Loop(); });
    ChannelOptions own;
    own.address = "127.0.0.1:" + std::to_string(server_->port());
    own.most_message_mib = 256;
    stub_ = CellService::NewStub(*OpenChannel(own));
  }
  ~RunningCell() {
    door_->Close();
    desk_->Close();
    server_->Shutdown();
    stop_ = true;
    loop_.join();
  }

  template <typename Request, typename Response>
  absl::Status Ask(grpc::Status (CellService::Stub::*method)(grpc::ClientContext*, const Request&, Response*),
                   const Request& request, Response& response, double deadline_s = 20.0) {
    return Call(method, *stub_, request, response, deadline_s);
  }
  CellService::Stub& stub() { return *stub_; }
  JobDesk& desk() { return *desk_; }
  void HearModel() { desk_->HearModel({"demo-1", 3, "abc"}); }

 private:
  void Loop() {
    while (!stop_) {
      {
        const std::lock_guard lock(machine_lock_);
        machine_.Advance(clock_.now_ns());
        const bool heard = ++turns_ > machine_.turns_unheard;
        if (heard) desk_->Hear(*machine_.view.drive);
        if (heard) desk_->Hear(*machine_.view.main_motion);
        for (const CommandOut& command : desk_->Cycle().commands) {
          machine_.Obey(command, clock_.now_ns());
        }
        if (machine_.view.drive->plan != 0 && machine_.fills) {
          machine_.Fill();
        }
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
  }

  CommonClock clock_;
  MachineModel& machine_;
  std::mutex& machine_lock_;
  std::unique_ptr<JobDesk> desk_;
  std::unique_ptr<Planner> planner_;
  std::unique_ptr<CellDoor> door_;
  std::unique_ptr<RpcServer> server_;
  std::unique_ptr<CellService::Stub> stub_;
  int turns_ = 0;
  std::atomic<bool> stop_ = false;
  std::thread loop_;
};

class CellRpc : public testing::Test {
 protected:
  CellRpc() {
    grpc::ServerBuilder builder;
    int port = 0;
    builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
    builder.RegisterService(&trajectory);
    trajectory_server = builder.BuildAndStart();
    trajectory_address = "127.0.0.1:" + std::to_string(port);
    Begin();
  }

  void Begin() {
    cell.reset();
    cell =
        std::make_unique<RunningCell>(folder.File("cell.sqlite"), trajectory_address, machine, machine_lock);
    cell->HearModel();
  }

  static v1::SubmitJobRequest Wish(const std::string& request_id, const std::string& program = "G1 X10\n") {
    v1::SubmitJobRequest request;
    request.set_request_id(request_id);
    request.set_name("plate");
    request.set_program(program);
    return request;
  }
  v1::Job MustSubmit(const v1::SubmitJobRequest& request) {
    v1::SubmitJobResponse response;
    const absl::Status status = cell->Ask(&CellService::Stub::SubmitJob, request, response);
    EXPECT_TRUE(status.ok()) << status;
    return response.job();
  }
  absl::Status Submit(const v1::SubmitJobRequest& request) {
    v1::SubmitJobResponse response;
    return cell->Ask(&CellService::Stub::SubmitJob, request, response);
  }
  v1::Job Get(const std::string& job_id) {
    v1::GetJobRequest request;
    request.set_job_id(job_id);
    v1::GetJobResponse response;
    const absl::Status status = cell->Ask(&CellService::Stub::GetJob, request, response);
    EXPECT_TRUE(status.ok()) << status;
    return response.job();
  }
  absl::Status Start(const std::string& job_id) {
    v1::StartJobRequest request;
    request.set_job_id(job_id);
    v1::StartJobResponse response;
    return cell->Ask(&CellService::Stub::StartJob, request, response);
  }
  void Reset() {
    v1::ResetMachineResponse response;
    const absl::Status status =
        cell->Ask(&CellService::Stub::ResetMachine, v1::ResetMachineRequest(), response);
    ASSERT_TRUE(status.ok()) << status;
  }
  bool Reaches(const std::string& job_id, v1::JobState state) {
    return Eventually([&] { return Get(job_id).state() == state; });
  }
  int JobCount() {
    v1::ListJobsResponse response;
    EXPECT_TRUE(cell->Ask(&CellService::Stub::ListJobs, v1::ListJobsRequest(), response).ok());
    return response.jobs_size();
  }

  static void ExpectTrouble(const absl::Status& status, absl::StatusCode code, const std::string& reason) {
    EXPECT_EQ(status.code(), code) << status;
    EXPECT_EQ(TroubleReason(status), reason) << status;
    EXPECT_FALSE(status.message().empty());
  }

  test::TemporaryFolder folder;
  TrajectoryStandIn trajectory;
  std::unique_ptr<grpc::Server> trajectory_server;
  std::string trajectory_address;
  MachineModel machine;
  std::mutex machine_lock;
  std::unique_ptr<RunningCell> cell;
};

// --- What is asked wrongly ---------------------------------------------------------------------------------------------

TEST_F(CellRpc, RefusesWishesThatAreNotAsTheyMustBeAndStoresNothing) {
  constexpr auto kInvalid = absl::StatusCode::kInvalidArgument;
  ExpectTrouble(Submit(Wish("")), kInvalid, "BAD_ID");
  ExpectTrouble(Submit(Wish("with space")), kInvalid, "BAD_ID");
  ExpectTrouble(Submit(Wish(std::string(129, 'a'))), kInvalid, "BAD_ID");
  ExpectTrouble(Submit(Wish("empty", "")), kInvalid, "EMPTY");
  ExpectTrouble(Submit(Wish("utf8", "G1 X1 (\xff\xfe)\n")), kInvalid, "NOT_UTF8");
  ExpectTrouble(Submit(Wish("large", std::string((8U << 20U) + 1, ' '))), kInvalid, "PROGRAM_TOO_LARGE");
  auto wish = Wish("name");
  wish.set_name(std::string(200, 'n'));
  ExpectTrouble(Submit(wish), kInvalid, "TOO_LARGE");
  for (const double scale : {0.0, -1.0, 1.3, std::nan(""), std::numeric_limits<double>::infinity(), 1e300}) {
    auto scaled = Wish("scale");
    scaled.set_feed_scale(scale);
    EXPECT_EQ(Submit(scaled).code(), kInvalid) << scale;
    EXPECT_FALSE(TroubleViolations(Submit(scaled)).empty()) << scale;
  }
  EXPECT_EQ(JobCount(), 0);
}

TEST_F(CellRpc, RefusesAHundredMebibytesWithItsOwnReason) {
  const absl::Status status = Submit(Wish("huge", std::string(100U << 20U, 'G')));
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << status;
  EXPECT_EQ(TroubleReason(status), "PROGRAM_TOO_LARGE");
  EXPECT_EQ(JobCount(), 0);
}

TEST_F(CellRpc, RefusesACallWhoseDeadlineHasPassed) {
  v1::SubmitJobResponse response;
  const absl::Status status = cell->Ask(&CellService::Stub::SubmitJob, Wish("late"), response, -1.0);
  EXPECT_EQ(status.code(), absl::StatusCode::kDeadlineExceeded);
  EXPECT_EQ(JobCount(), 0);
}

TEST_F(CellRpc, NamesTheJobThatDoesNotExistInEveryCall) {
  const auto check = [&]<typename Request, typename Response>(grpc::Status (CellService::Stub::*method)(
                         grpc::ClientContext*, const Request&, Response*)) {
    Request request;
    Response response;
    request.set_job_id("job-999999");
    ExpectTrouble(cell->Ask(method, request, response), absl::StatusCode::kNotFound, "JOB_UNKNOWN");
    request.set_job_id("../etc");
    ExpectTrouble(cell->Ask(method, request, response), absl::StatusCode::kInvalidArgument, "BAD_ID");
  };
  check(&CellService::Stub::StartJob);
  check(&CellService::Stub::HoldJob);
  check(&CellService::Stub::ResumeJob);
  check(&CellService::Stub::StopJob);
  check(&CellService::Stub::CancelJob);
  check(&CellService::Stub::GetJob);
  check(&CellService::Stub::GetReport);
}

TEST_F(CellRpc, RefusesOverridesAndOverlapsThatAreNoNumbers) {
  const std::string job_id = MustSubmit(Wish("a")).job_id();
  for (const double value : {std::nan(""), std::numeric_limits<double>::infinity(), -0.1, 1.21, 1e300}) {
    v1::SetFeedOverrideRequest request;
    request.set_feed_override(value);
    v1::SetFeedOverrideResponse response;
    EXPECT_EQ(cell->Ask(&CellService::Stub::SetFeedOverride, request, response).code(),
              absl::StatusCode::kInvalidArgument)
        << value;
  }
  for (const double value : {std::nan(""), -1.0, 1e9}) {
    v1::ResumeJobRequest request;
    request.set_job_id(job_id);
    request.set_overlap_mm(value);
    v1::ResumeJobResponse response;
    EXPECT_EQ(cell->Ask(&CellService::Stub::ResumeJob, request, response).code(),
              absl::StatusCode::kInvalidArgument)
        << value;
  }
}

TEST_F(CellRpc, RefusesPagesAndWatchesThatCannotBe) {
  const auto list = [&](int size, const std::string& token) {
    v1::ListJobsRequest request;
    request.set_page_size(size);
    request.set_page_token(token);
    v1::ListJobsResponse response;
    return cell->Ask(&CellService::Stub::ListJobs, request, response);
  };
  EXPECT_EQ(list(-1, "").code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(list(101, "").code(), absl::StatusCode::kInvalidArgument);
  ExpectTrouble(list(1, "nonsense"), absl::StatusCode::kInvalidArgument, "BAD_PAGE_TOKEN");
  const auto watch = [&](std::uint64_t token, double period_s, const std::string& job_id) {
    grpc::ClientContext context;
    SetDeadline(context, 5.0);
    v1::WatchJobsRequest request;
    request.set_resume_token(token);
    request.set_period_s(period_s);
    request.set_job_id(job_id);
    const auto stream = cell->stub().WatchJobs(&context, request);
    v1::JobEvent event;
    EXPECT_FALSE(stream->Read(&event));
    return FromWire(stream->Finish());
  };
  EXPECT_EQ(watch(0, std::nan(""), "").code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(watch(0, 0.0, "").code(), absl::StatusCode::kInvalidArgument);
  ExpectTrouble(watch(1000, 0.5, ""), absl::StatusCode::kInvalidArgument, "UNKNOWN_RESUME_TOKEN");
  ExpectTrouble(watch(0, 0.5, "job-9"), absl::StatusCode::kNotFound, "JOB_UNKNOWN");
}

TEST_F(CellRpc, RefusesAJobForAnotherVersionOfTheMachine) {
  auto wish = Wish("version");
  wish.set_machine_version(2);
  ExpectTrouble(Submit(wish), absl::StatusCode::kFailedPrecondition, "WRONG_MACHINE_VERSION");
  wish.set_machine_version(3);
  EXPECT_EQ(MustSubmit(wish).state(), v1::JOB_STATE_READY);
}

TEST_F(CellRpc, NamesEveryVetoInsteadOfStarting) {
  const std::string job_id = MustSubmit(Wish("a")).job_id();
  const absl::Status status = Start(job_id);
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_NE(std::string(status.message()).find("main_motion"), std::string::npos) << status;
  EXPECT_EQ(Get(job_id).state(), v1::JOB_STATE_READY);
  v1::GetMachineStateResponse machine_state;
  ASSERT_TRUE(
      cell->Ask(&CellService::Stub::GetMachineState, v1::GetMachineStateRequest(), machine_state).ok());
  EXPECT_GE(machine_state.state().vetoes_size(), 3);
}

// --- Exactly once ------------------------------------------------------------------------------------------------------

TEST_F(CellRpc, TheSameWishIsTheSameJobAndAnotherWishNeedsAnotherId) {
  const v1::Job first = MustSubmit(Wish("once"));
  EXPECT_EQ(MustSubmit(Wish("once")).job_id(), first.job_id());
  auto other = Wish("once", "G1 X11\n");
  ExpectTrouble(Submit(other), absl::StatusCode::kAlreadyExists, "REQUEST_ID_REUSED");
  auto compensated = Wish("once");
  compensated.set_compensate(true);
  ExpectTrouble(Submit(compensated), absl::StatusCode::kAlreadyExists, "REQUEST_ID_REUSED");
  Begin();  // also after a restart
  EXPECT_EQ(MustSubmit(Wish("once")).job_id(), first.job_id());
  ExpectTrouble(Submit(other), absl::StatusCode::kAlreadyExists, "REQUEST_ID_REUSED");
  EXPECT_EQ(JobCount(), 1);
}

TEST_F(CellRpc, SixteenClientsWithOneWishGetOneJob) {
  std::vector<std::thread> clients;
  std::array<std::string, 16> ids;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    clients.emplace_back([&, i] { ids[i] = MustSubmit(Wish("race")).job_id(); });
  }
  for (std::thread& client : clients) {
    client.join();
  }
  EXPECT_EQ(std::count(ids.begin(), ids.end(), ids[0]), 16);
  EXPECT_EQ(JobCount(), 1);
}

TEST_F(CellRpc, ARefusedProgramIsAnAnswerWithLines) {
  const v1::Job job = MustSubmit(Wish("bad", "G1 X1\nBAD\n"));
  EXPECT_EQ(job.state(), v1::JOB_STATE_REFUSED);
  ASSERT_EQ(job.faults_size(), 1);
  EXPECT_EQ(job.faults(0).line(), 2U);
  EXPECT_EQ(job.faults(0).reason(), "UNKNOWN_WORD");
  ExpectTrouble(Start(job.job_id()), absl::StatusCode::kFailedPrecondition, "WRONG_JOB_STATE");
}

TEST_F(CellRpc, AJobWaitsForATrajectoryThatIsAwayAndIsNotLost) {
  trajectory_server->Shutdown();
  const v1::Job job = MustSubmit(Wish("patient"));
  EXPECT_EQ(job.state(), v1::JOB_STATE_ADMITTING);
  EXPECT_EQ(job.reason(), "TRAJECTORY_UNREACHABLE");
  grpc::ServerBuilder builder;
  builder.AddListeningPort(trajectory_address, grpc::InsecureServerCredentials());
  builder.RegisterService(&trajectory);
  trajectory_server = builder.BuildAndStart();
  ASSERT_NE(trajectory_server, nullptr);
  EXPECT_TRUE(Reaches(job.job_id(), v1::JOB_STATE_READY));
}

TEST_F(CellRpc, AnAdmissionThatARestartInterruptedIsTakenUpAgain) {
  v1::SubmitJobResponse response;
  ASSERT_TRUE(cell->Ask(&CellService::Stub::SubmitJob, Wish("slow", "SLOW\n"), response, 0.5).ok());
  EXPECT_EQ(response.job().state(), v1::JOB_STATE_ADMITTING);
  Begin();
  EXPECT_EQ(Get(response.job().job_id()).state(), v1::JOB_STATE_ADMITTING);
  trajectory.finish_slow = true;
  EXPECT_TRUE(Reaches(response.job().job_id(), v1::JOB_STATE_READY));
}

// --- The life of a job -------------------------------------------------------------------------------------------------

TEST_F(CellRpc, RunsAJobToItsEndAndReportsIt) {
  Reset();
  const std::string job_id = MustSubmit(Wish("run")).job_id();
  ASSERT_TRUE(Start(job_id).ok());
  EXPECT_TRUE(Start(job_id).ok());  // asked twice, started once
  ASSERT_TRUE(Reaches(job_id, v1::JOB_STATE_COMPLETED));
  const v1::Job job = Get(job_id);
  EXPECT_EQ(job.progress(), 1.0);
  EXPECT_EQ(job.plan_ids_size(), 1);
  EXPECT_FALSE(job.ended().empty());
  v1::GetReportRequest request;
  request.set_job_id(job_id);
  v1::GetReportResponse report;
  ASSERT_TRUE(cell->Ask(&CellService::Stub::GetReport, request, report).ok());
  EXPECT_GT(report.duration_s(), 0.0);
  ExpectTrouble(Start(MustSubmit(Wish("bad", "BAD")).job_id()), absl::StatusCode::kFailedPrecondition,
                "WRONG_JOB_STATE");
}

TEST_F(CellRpc, HoldsResumesOverridesAndStops) {
  machine.length_mm = 1e9;
  Reset();
  const std::string job_id = MustSubmit(Wish("hold")).job_id();
  ASSERT_TRUE(Start(job_id).ok());
  v1::HoldJobRequest hold;
  hold.set_job_id(job_id);
  v1::HoldJobResponse held;
  ASSERT_TRUE(cell->Ask(&CellService::Stub::HoldJob, hold, held).ok());
  EXPECT_EQ(held.job().state(), v1::JOB_STATE_HELD);
  v1::ResumeJobRequest resume;
  resume.set_job_id(job_id);
  v1::ResumeJobResponse resumed;
  ASSERT_TRUE(cell->Ask(&CellService::Stub::ResumeJob, resume, resumed).ok());
  EXPECT_EQ(resumed.job().state(), v1::JOB_STATE_RUNNING);
  v1::SetFeedOverrideRequest factor;
  factor.set_feed_override(0.5);
  v1::SetFeedOverrideResponse confirmed;
  ASSERT_TRUE(cell->Ask(&CellService::Stub::SetFeedOverride, factor, confirmed).ok());
  EXPECT_EQ(confirmed.feed_override(), 0.5);

  const std::string other = MustSubmit(Wish("other")).job_id();
  ExpectTrouble(Start(other), absl::StatusCode::kFailedPrecondition, "ANOTHER_JOB_RUNS");
  v1::CancelJobRequest cancel;
  cancel.set_job_id(job_id);
  v1::CancelJobResponse cancelled;
  ExpectTrouble(cell->Ask(&CellService::Stub::CancelJob, cancel, cancelled),
                absl::StatusCode::kFailedPrecondition, "WRONG_JOB_STATE");
  v1::ResetMachineResponse reset;
  ExpectTrouble(cell->Ask(&CellService::Stub::ResetMachine, v1::ResetMachineRequest(), reset),
                absl::StatusCode::kFailedPrecondition, "MACHINE_BUSY");

  v1::StopJobResponse stopped;
  ASSERT_TRUE(cell->Ask(&CellService::Stub::StopJob, v1::StopJobRequest(), stopped).ok());
  EXPECT_TRUE(Reaches(job_id, v1::JOB_STATE_INTERRUPTED));
  ASSERT_TRUE(cell->Ask(&CellService::Stub::StopJob, v1::StopJobRequest(), stopped).ok());  // idempotent
  ASSERT_TRUE(cell->Ask(&CellService::Stub::ResumeJob, resume, resumed).ok());
  EXPECT_EQ(resumed.job().plan_id(), kAnyPlan + 1);
  EXPECT_EQ(resumed.job().plan_ids_size(), 2);
  ASSERT_TRUE(cell->Ask(&CellService::Stub::StopJob, v1::StopJobRequest(), stopped).ok());
  ASSERT_TRUE(Reaches(job_id, v1::JOB_STATE_INTERRUPTED));
  ASSERT_TRUE(cell->Ask(&CellService::Stub::CancelJob, cancel, cancelled).ok());
  EXPECT_EQ(cancelled.job().state(), v1::JOB_STATE_CANCELLED);
}

TEST_F(CellRpc, ARestartedCellGoesOnWithARunningJob) {
  machine.length_mm = 600.0;
  Reset();
  const std::string job_id = MustSubmit(Wish("restart")).job_id();
  ASSERT_TRUE(Start(job_id).ok());
  Begin();
  EXPECT_TRUE(Reaches(job_id, v1::JOB_STATE_COMPLETED));
  EXPECT_EQ(Get(job_id).plan_ids_size(), 1);
}

// Whoever serves may not have heard anyone yet: that is not the same as lost.
TEST_F(CellRpc, AWishInACellsFirstMomentWaitsUntilItHasHeardTheModules) {
  machine.turns_unheard = 30;
  Begin();
  Reset();
  const std::string job_id = MustSubmit(Wish("early")).job_id();
  Begin();
  EXPECT_TRUE(Start(job_id).ok());
  ASSERT_TRUE(Reaches(job_id, v1::JOB_STATE_COMPLETED));
  machine.turns_unheard = std::numeric_limits<int>::max();
  Begin();
  v1::ResetMachineResponse response;
  ExpectTrouble(cell->Ask(&CellService::Stub::ResetMachine, v1::ResetMachineRequest(), response),
                absl::StatusCode::kFailedPrecondition, "DRIVE_LOST");
}

TEST_F(CellRpc, AWatcherHearsEveryChangeFromItsTokenOnAndProgressInBetween) {
  machine.length_mm = 400.0;
  Reset();
  const std::string job_id = MustSubmit(Wish("watch")).job_id();
  std::vector<v1::JobState> states;
  std::uint64_t token = 0;
  int progress = 0;
  std::thread watcher([&] {
    grpc::ClientContext context;
    SetDeadline(context, 30.0);
    v1::WatchJobsRequest request;
    request.set_job_id(job_id);
    request.set_period_s(0.05);
    const auto stream = cell->stub().WatchJobs(&context, request);
    v1::JobEvent event;
    while (stream->Read(&event)) {
      if (event.token() == 0) {
        ++progress;
        continue;
      }
      token = event.token();
      states.push_back(event.job().state());
      if (event.job().state() == v1::JOB_STATE_COMPLETED) {
        context.TryCancel();
      }
    }
    (void)stream->Finish();
  });
  // The watcher hears what comes after it has opened its stream: start when the server has it.
  std::this_thread::yield();
  ASSERT_TRUE(Start(job_id).ok());
  watcher.join();
  ASSERT_FALSE(states.empty());
  EXPECT_EQ(states.back(), v1::JOB_STATE_COMPLETED);
  EXPECT_GT(progress, 2);

  // All of it again, from the journal's first record.
  grpc::ClientContext context;
  SetDeadline(context, 10.0);
  v1::WatchJobsRequest request;
  request.set_job_id(job_id);
  request.set_resume_token(1);
  const auto stream = cell->stub().WatchJobs(&context, request);
  std::vector<v1::JobState> all;
  v1::JobEvent event;
  while (stream->Read(&event)) {
    EXPECT_NE(event.token(), 0U);
    all.push_back(event.job().state());
    if (event.token() == token) {
      break;
    }
  }
  context.TryCancel();
  const std::vector<v1::JobState> wanted = {v1::JOB_STATE_READY, v1::JOB_STATE_STARTING,
                                            v1::JOB_STATE_STARTING, v1::JOB_STATE_RUNNING,
                                            v1::JOB_STATE_COMPLETED};
  EXPECT_EQ(all, wanted);
}

TEST_F(CellRpc, PagesThroughJobsWithoutMissingOne) {
  for (int i = 0; i < 23; ++i) {
    MustSubmit(Wish("page-" + std::to_string(i)));
  }
  v1::ListJobsRequest request;
  request.set_page_size(5);
  std::set<std::string> seen;
  do {
    v1::ListJobsResponse page;
    ASSERT_TRUE(cell->Ask(&CellService::Stub::ListJobs, request, page).ok());
    for (const v1::Job& job : page.jobs()) {
      EXPECT_TRUE(seen.insert(job.job_id()).second);
    }
    request.set_page_token(page.next_page_token());
  } while (!request.page_token().empty());
  EXPECT_EQ(seen.size(), 23U);
}

}  // namespace
}  // namespace lambdajet::cell
