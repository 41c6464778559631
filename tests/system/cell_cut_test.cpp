// The spine of it all: real processes, real DDS and gRPC between them, a tiny part cut by the simulated machine.
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <functional>
#include <mutex>
#include <sstream>
#include <utility>
#include <vector>

#include "foundation/contract/trouble.hpp"
#include "lambdajet/cell/v1/cell.grpc.pb.h"
#include "platform/rpc/channel.hpp"
#include "tests/support/bus_cell.hpp"
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
    const std::string job_id = MustSubmit(program);
    StartJob(job_id);
    return job_id;
  }
  std::string MustSubmit(const std::string& program) {
    v1::SubmitJobRequest submit;
    submit.set_request_id("wish-" + std::to_string(++wishes));
    submit.set_name("part");
    submit.set_program(program);
    v1::SubmitJobResponse submitted;
    const absl::Status status = Ask(&CellService::Stub::SubmitJob, submit, submitted);
    EXPECT_TRUE(status.ok()) << status;
    const std::string job_id = submitted.job().job_id();
    EXPECT_TRUE(Reaches(job_id, v1::JOB_STATE_READY)) << Get(job_id).DebugString();
    return job_id;
  }
  void StartJob(const std::string& job_id) {
    v1::StartJobRequest start;
    start.set_job_id(job_id);
    v1::StartJobResponse started;
    const absl::Status status = Ask(&CellService::Stub::StartJob, start, started);
    EXPECT_TRUE(status.ok()) << status;
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

// What a program asks of the abrasive and of the machine's inputs, from the file to what is recorded on the bus. The hopper
// is empty for its first seconds, and somebody fills it while the program waits.
constexpr double kHopperEmpty_s = 9.0;
constexpr char kAbrasivePart[] =
    "G21 G90 G17\n"
    "F3000\n"
    "G0 X300 Y250\n"
    "M67 E0 Q410\n"
    "M66 P0 L3 Q30\n"   // the pump is at pressure: goes on
    "M66 P1 L3 Q0.4\n"  // no abrasive: held
    "M3 P0.2\n"
    "G1 X320\n"
    "M67 E0 Q520\n"
    "G1 X340\n"
    "M63 P1\n"
    "G1 X350\n"
    "M62 P1\n"
    "G1 X352\n"
    "M67 E0 Q280\n"
    "G1 X460\n"
    "G3 X480 Y270 J20\n"
    "M67 E0 Q600\n"
    "G1 Y300\n"
    "M5\n"
    "M30\n";
constexpr double kArc_mm = 31.415926536;
constexpr double kRecordedPlace_mm = 0.05;  // a corner may be cut by so much of the path
constexpr double kLate_mm = 2.0;            // 40 ms at this feed: a shared host

struct Recorded {
  ProcessAction action;
  double s_mm;
  double argument;
};

class CellAbrasive : public CellCut {
 protected:
  using Flows = std::vector<std::pair<std::uint64_t, double>>;  // (plan, g/min), as they came to flow

  void SetUp() override {
    processes.StartAll({"calibration", "drive", "trajectory", "cell"});
    Connect();
    ear.on_main_motion = [this](const MainMotionState& state) { Hear(state); };
  }

  void Hear(const MainMotionState& state) {
    const std::pair flow(state.plan, state.abrasive_g_per_min);
    const std::lock_guard lock(mutex);
    if (state.abrasive_on && (flows.empty() || flows.back() != flow)) {
      flows.push_back(flow);
    }
  }
  std::vector<double> FlowsOf(std::uint64_t plan) {
    std::vector<double> found;
    const std::lock_guard lock(mutex);
    for (const auto& [of, flow] : flows) {
      if (of == plan) {
        found.push_back(flow);
      }
    }
    return found;
  }

  std::string PlantWithEmptyHopper() {
    std::ifstream file(processes.ShippedPlant());
    std::stringstream text;
    text << file.rdbuf();
    std::string plant = text.str();
    const std::size_t at = plant.find("faults: []");
    EXPECT_NE(at, std::string::npos);
    plant.replace(at, 10,
                  "faults:\n  - kind: hopper_empty\n    index: 0\n    from_s: 0\n    for_s: " +
                      std::to_string(kHopperEmpty_s) + "\n    value: 0\n");
    const std::string name = processes.File("empty_hopper.yaml");
    std::ofstream(name) << plant;
    return name;
  }

  std::vector<ProcessRecord> RecordsOf(std::uint64_t plan) {
    std::vector<ProcessRecord> found = ear.records();
    std::erase_if(found, [plan](const ProcessRecord& record) { return record.plan != plan; });
    return found;
  }
  void ExpectRecorded(std::uint64_t plan, const std::vector<Recorded>& wanted) {
    EXPECT_TRUE(Eventually([&] { return RecordsOf(plan).size() >= wanted.size(); }));
    const std::vector<ProcessRecord> records = RecordsOf(plan);
    ASSERT_EQ(records.size(), wanted.size());
    for (std::size_t i = 0; i < wanted.size(); ++i) {
      std::printf("event %zu: action %d, %.0f g/min, at %.4f mm of the path, off by %.4f mm at %.1f mm/s\n",
                  i, static_cast<int>(records[i].action), records[i].argument, records[i].s_wanted_mm,
                  records[i].deviation_mm, records[i].s_rate_mm_per_s);
      EXPECT_EQ(records[i].action, wanted[i].action) << i;
      EXPECT_EQ(records[i].argument, wanted[i].argument) << i;
      EXPECT_NEAR(records[i].s_wanted_mm, wanted[i].s_mm, kRecordedPlace_mm) << i;
      EXPECT_LE(std::abs(records[i].deviation_mm), kLate_mm) << i;
    }
  }

  std::mutex mutex;
  Flows flows;
  tests::BusEar ear{processes.domain(), "demo-1"};
};

TEST_F(CellAbrasive, FlowsAndInputsOfAProgramComeToTheSheetAtTheirPlaces) {
  using enum ProcessAction;
  const std::string job_id = MustSubmit(kAbrasivePart);
  processes.Start("main_motion", PlantWithEmptyHopper());
  ASSERT_TRUE(processes.at("main_motion").WaitUntilReady());
  ASSERT_NO_FATAL_FAILURE(Reset());
  StartJob(job_id);

  // The first input is there, the second is not: both modules hold where they wait, and the job says why.
  ASSERT_TRUE(Until(job_id, [](const v1::Job& job) { return job.state() == v1::JOB_STATE_HELD; }))
      << Get(job_id).DebugString();
  EXPECT_EQ(Get(job_id).reason(), "INPUT_TIMEOUT");
  EXPECT_FALSE(ear.main_motion().abrasive_present) << "the hopper was filled before the program got there";
  EXPECT_TRUE(Eventually([&] { return ear.main_motion().reason == ModuleReason::kInputTimeout; }));
  EXPECT_EQ(ear.drive().gate_passed, 1u);
  EXPECT_EQ(ear.drive().s_mm, 0.0);
  ASSERT_TRUE(Eventually([&] { return ear.main_motion().abrasive_present; }));
  ASSERT_TRUE(Resume(job_id).ok());

  // A crash behind the changes of flow.
  ASSERT_TRUE(CutsBeyond(job_id, 80.0)) << Get(job_id).DebugString();
  processes.Kill("main_motion");
  ASSERT_TRUE(Reaches(job_id, v1::JOB_STATE_INTERRUPTED)) << Get(job_id).DebugString();
  const std::uint64_t first = Get(job_id).plan_ids(0);
  EXPECT_EQ(FlowsOf(first), (std::vector<double>{410.0, 520.0, 280.0}));
  ExpectRecorded(first, {{kAbrasiveFlow, 0.0, 410.0},
                         {kAbrasiveFlow, 20.0, 520.0},
                         {kAbrasiveOff, 40.0, 0.0},
                         {kAbrasiveOn, 50.0, 0.0},
                         {kAbrasiveFlow, 52.0, 280.0}});

  const double cut_mm = Get(job_id).s_mm();
  processes.Start("main_motion");
  ASSERT_TRUE(processes.at("main_motion").WaitUntilReady());
  ASSERT_TRUE(Eventually([&] { return Resume(job_id).ok(); }, kLong)) << Get(job_id).DebugString();
  ASSERT_TRUE(Completes(job_id)) << Get(job_id).DebugString();
  ASSERT_EQ(Get(job_id).plan_ids_size(), 2) << "the host stood still for longer than this test bears";
  const std::uint64_t second = Get(job_id).plan_ids(1);
  EXPECT_EQ(FlowsOf(second), (std::vector<double>{280.0, 600.0}));
  ASSERT_FALSE(RecordsOf(second).empty());
  const double begin_mm = RecordsOf(second).front().s_wanted_mm;
  EXPECT_GT(begin_mm, cut_mm - 10.0);
  EXPECT_LT(begin_mm, cut_mm);
  const double end_mm = 160.0 + kArc_mm + 30.0;
  ExpectRecorded(second, {{kAbrasiveFlow, begin_mm, 280.0},
                          {kAbrasiveFlow, 160.0 + kArc_mm, 600.0},
                          {kAbrasiveOff, end_mm, 0.0},
                          {kJetOff, end_mm, 0.0}});
}

}  // namespace
}  // namespace lambdajet
