// The spine of it all: real processes, real DDS and gRPC between them, a tiny part cut by the simulated machine.
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <functional>

#include "foundation/contract/trouble.hpp"
#include "lambdajet/cell/v1/cell.grpc.pb.h"
#include "platform/rpc/channel.hpp"
#include "tests/support/cell_processes.hpp"
#include "tests/support/eventually.hpp"

namespace lambdajet {
namespace {

namespace v1 = cell::v1;
using test::Eventually;
using v1::CellService;

constexpr std::chrono::seconds kLong{90};

// Two pierces, 2 s of cutting.
constexpr char kTinyPart[] =
    "G21 G90 G17\n"
    "F3000\n"
    "G0 X300 Y250\n"
    "M3 P0.2\n"
    "G1 X340\n"
    "G3 X350 Y260 I0 J10\n"
    "M5\n"
    "G0 X360 Y270\n"
    "M3 P0.2\n"
    "G1 X330\n"
    "M5\n"
    "M30\n";

// Some 14 s at 50 mm/s: longer than any buffer.
std::string LongPart() {
  std::string program = "G21 G90 G17\nF3000\nG0 X300 Y200\nM3 P0.2\n";
  for (int i = 0; i < 2; ++i) {
    program += "G1 X380\nG1 Y300\nG1 X300\nG1 Y" + std::to_string(200 + 5 * (i + 1)) + "\n";
  }
  return program + "M5\nM30\n";
}

class CellCut : public testing::Test {
 protected:
  void SetUp() override {
    processes.StartAll({"calibration", "drive", "main_motion", "trajectory", "cell"});
    Connect();
    ASSERT_NO_FATAL_FAILURE(Reset());
  }
  void TearDown() override {
    if (HasFailure()) {
      std::printf("%s\n", processes.Words().c_str());
    }
  }

  void Connect() {
    ChannelOptions options;
    options.address = processes.address("cell");
    stub = CellService::NewStub(*OpenChannel(options));
  }

  template <typename Request, typename Response>
  absl::Status Ask(grpc::Status (CellService::Stub::*method)(grpc::ClientContext*, const Request&, Response*),
                   const Request& request, Response& response) {
    return Call(method, *stub, request, response, 60.0);
  }

  void Reset() {
    // The cell may not have heard everyone at once.
    absl::Status status;
    v1::ResetMachineResponse response;
    EXPECT_TRUE(Eventually([&] {
      status = Ask(&CellService::Stub::ResetMachine, v1::ResetMachineRequest(), response);
      return status.ok();
    })) << status;
    std::string vetoes;
    EXPECT_TRUE(Eventually([&] {
      v1::GetMachineStateResponse machine;
      (void)Ask(&CellService::Stub::GetMachineState, v1::GetMachineStateRequest(), machine);
      vetoes = machine.DebugString();
      return machine.state().nodes_size() > 0 && machine.state().vetoes_size() == 0;
    })) << vetoes;
  }

  v1::Job Get(const std::string& job_id) {
    v1::GetJobRequest request;
    request.set_job_id(job_id);
    v1::GetJobResponse response;
    (void)Ask(&CellService::Stub::GetJob, request, response);
    return response.job();
  }

  bool Reaches(const std::string& job_id, v1::JobState state) {
    return Eventually([&] { return Get(job_id).state() == state; }, kLong);
  }

  std::string MustStart(const std::string& program) {
    v1::SubmitJobRequest submit;
    submit.set_request_id("wish-" + std::to_string(++wishes));
    submit.set_name("part");
    submit.set_program(program);
    v1::SubmitJobResponse submitted;
    absl::Status status = Ask(&CellService::Stub::SubmitJob, submit, submitted);
    EXPECT_TRUE(status.ok()) << status;
    const std::string job_id = submitted.job().job_id();
    EXPECT_TRUE(Reaches(job_id, v1::JOB_STATE_READY)) << Get(job_id).DebugString();
    v1::StartJobRequest start;
    start.set_job_id(job_id);
    v1::StartJobResponse started;
    status = Ask(&CellService::Stub::StartJob, start, started);
    EXPECT_TRUE(status.ok()) << status;
    return job_id;
  }

  absl::Status Resume(const std::string& job_id) {
    v1::ResumeJobRequest request;
    request.set_job_id(job_id);
    v1::ResumeJobResponse response;
    return Ask(&CellService::Stub::ResumeJob, request, response);
  }

  // Waits for something while the job runs. Where this host itself stood still for longer than even these tests' patient
  // deadlines, resumes as an operator would.
  bool Until(const std::string& job_id, const std::function<bool(const v1::Job&)>& reached) {
    return Eventually(
        [&] {
          const v1::Job job = Get(job_id);
          if (job.state() == v1::JOB_STATE_INTERRUPTED && HostStalled(job.reason()) && Resume(job_id).ok()) {
            ++host_stalls;
          }
          return reached(job);
        },
        kLong);
  }
  bool Completes(const std::string& job_id) {
    return Until(job_id, [](const v1::Job& job) { return job.state() == v1::JOB_STATE_COMPLETED; });
  }
  bool CutsBeyond(const std::string& job_id, double s_mm) {
    return Until(job_id, [s_mm](const v1::Job& job) { return job.s_mm() > s_mm; });
  }
  static bool HostStalled(const std::string& reason) {
    return reason == "OVERRUNS" || reason == "PEER_LOST" || reason == "PEER_STOPPED";
  }

  test::CellProcesses processes;
  std::unique_ptr<CellService::Stub> stub;
  int wishes = 0;
  int host_stalls = 0;
};

TEST_F(CellCut, CutsATinyPartAndReportsIt) {
  const std::string job_id = MustStart(kTinyPart);
  ASSERT_TRUE(Completes(job_id)) << Get(job_id).DebugString();
  const v1::Job job = Get(job_id);
  EXPECT_NEAR(job.s_mm(), job.length_mm(), 1e-6);
  EXPECT_GT(job.length_mm(), 80.0);
  EXPECT_EQ(job.plan_ids_size(), 1 + host_stalls);
  v1::GetReportRequest request;
  request.set_job_id(job_id);
  v1::GetReportResponse report;
  ASSERT_TRUE(Ask(&CellService::Stub::GetReport, request, report).ok());
  EXPECT_EQ(report.interruptions(), static_cast<std::uint32_t>(host_stalls));
  EXPECT_GT(report.cutting_time_s(), 1.0);
  EXPECT_GT(report.slider_trace_size(), 6 * 10);
  EXPECT_GE(report.event_deviations_size(), 3);
  std::printf("event deviation: 50 %% %.4f mm, 99 %% %.4f mm over %d events; overruns %u, %u\n",
              report.event_deviation_p50_mm(), report.event_deviation_p99_mm(),
              report.event_deviations_size() / 3, report.drive_overruns(), report.main_motion_overruns());
  // The machine is ready for the next one.
  const std::string next = MustStart(kTinyPart);
  EXPECT_TRUE(Completes(next)) << Get(next).DebugString();
}

TEST_F(CellCut, HoldsAndGoesOn) {
  const std::string job_id = MustStart(LongPart());
  ASSERT_TRUE(CutsBeyond(job_id, 40.0)) << Get(job_id).DebugString();
  v1::HoldJobRequest hold;
  hold.set_job_id(job_id);
  v1::HoldJobResponse held;
  const absl::Status status = Ask(&CellService::Stub::HoldJob, hold, held);
  ASSERT_TRUE(status.ok()) << status;
  EXPECT_EQ(held.job().state(), v1::JOB_STATE_HELD);
  EXPECT_EQ(held.job().reason(), "COMMANDED");
  ASSERT_TRUE(Resume(job_id).ok());
  EXPECT_TRUE(Completes(job_id)) << Get(job_id).DebugString();
}

TEST_F(CellCut, AStoppedJobIsResumedFromWhatWasCut) {
  const std::string job_id = MustStart(LongPart());
  ASSERT_TRUE(CutsBeyond(job_id, 40.0)) << Get(job_id).DebugString();
  v1::StopJobResponse stopped;
  ASSERT_TRUE(Ask(&CellService::Stub::StopJob, v1::StopJobRequest(), stopped).ok());
  ASSERT_TRUE(Reaches(job_id, v1::JOB_STATE_INTERRUPTED)) << Get(job_id).DebugString();
  const double cut_mm = Get(job_id).s_mm();
  EXPECT_GE(cut_mm, 40.0);
  const absl::Status status = Resume(job_id);
  ASSERT_TRUE(status.ok()) << status;
  EXPECT_EQ(Get(job_id).plan_ids_size(), 2 + host_stalls);
  ASSERT_TRUE(Completes(job_id)) << Get(job_id).DebugString();
  EXPECT_NEAR(Get(job_id).s_mm(), Get(job_id).length_mm(), 1e-6);
}

}  // namespace
}  // namespace lambdajet
