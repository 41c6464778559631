// The trajectory program on a real bus and over real gRPC: plans a part, and streams it to two modules that this test plays,
// which lose batches, fall silent and begin anew.
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <fstream>
#include <random>
#include <sstream>

#include "foundation/contract/trouble.hpp"
#include "lambdajet/calibration/v1/machine_description.schema.hpp"
#include "lambdajet/calibration/v1/machine_descriptionPubSubTypes.h"
#include "lambdajet/drive/v1/state.schema.hpp"
#include "lambdajet/drive/v1/statePubSubTypes.h"
#include "lambdajet/main_motion/v1/state.schema.hpp"
#include "lambdajet/main_motion/v1/statePubSubTypes.h"
#include "lambdajet/trajectory/v1/plan.schema.hpp"
#include "lambdajet/trajectory/v1/planPubSubTypes.h"
#include "lambdajet/trajectory/v1/trajectory.grpc.pb.h"
#include "platform/bus/reader.hpp"
#include "platform/bus/writer.hpp"
#include "platform/machine_file/machine_file.hpp"
#include "platform/process/common_clock.hpp"
#include "platform/rpc/channel.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/eventually.hpp"
#include "tests/support/private_domain.hpp"
#include "tests/support/temporary_folder.hpp"

namespace lambdajet {
namespace {

using idl::calibration::v1::MachineDescriptionPubSubType;
using idl::trajectory::v1::ProcessBatch;
using idl::trajectory::v1::ProcessBatchPubSubType;
using idl::trajectory::v1::SegmentBatch;
using idl::trajectory::v1::SegmentBatchPubSubType;
using test::Eventually;
using Stub = trajectory::v1::TrajectoryService::Stub;

idl::calibration::v1::MachineDescription Description(MachineDescription machine, std::uint32_t version) {
  idl::calibration::v1::MachineDescription wire;
  wire.as_designed_yaml(MachineText(machine));
  machine.version = version;
  wire.header().session(1);
  wire.header().sequence_number(version + 1);
  wire.version(version);
  wire.hash(MachineHash(machine));
  for (std::size_t i = 0; i < kParameterCount; ++i) {
    wire.parameters()[i] = machine.parameters[static_cast<Eigen::Index>(i)];
    for (std::size_t j = 0; j < kParameterCount; ++j) {
      wire.covariance()[i * kParameterCount + j] =
          machine.covariance(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
    }
  }
  return wire;
}

// Plays both modules: takes what comes in order, as drive and main motion do, and says so in their states.
class PlayedModules {
 public:
  explicit PlayedModules(Participant& bus)
      : drive_(*Writer<idl::drive::v1::StatePubSubType>::Open(
            bus, {idl::drive::v1::STATE_TOPIC, idl::schema::k_lambdajet_drive_v1_state, "state"})),
        motion_(*Writer<idl::main_motion::v1::StatePubSubType>::Open(
            bus,
            {idl::main_motion::v1::STATE_TOPIC, idl::schema::k_lambdajet_main_motion_v1_state, "state"})),
        segments_(*Reader<SegmentBatchPubSubType>::Open(
            bus,
            {idl::trajectory::v1::SEGMENT_TOPIC, idl::schema::k_lambdajet_trajectory_v1_plan, "setpoint"},
            [this](const SegmentBatch& batch, const Arrival&) { Take(batch); })),
        process_(*Reader<ProcessBatchPubSubType>::Open(
            bus,
            {idl::trajectory::v1::PROCESS_TOPIC, idl::schema::k_lambdajet_trajectory_v1_plan, "setpoint"},
            [this](const ProcessBatch& batch, const Arrival&) { Take(batch); })) {}

  void Load(std::uint64_t plan) {
    const std::lock_guard lock(mutex_);
    plan_ = plan;
    next_segment_ = next_event_ = 0;
    next_gate_ = 1;
    buffered_end_s_ = tau_s_ = 0.0;
    end_q_ = {};
  }

  void Say() {
    const std::lock_guard lock(mutex_);
    idl::drive::v1::State drive;
    drive.header().session(7);
    drive.header().sequence_number(++number_);
    drive.header().time_ns(MonotonicNow());
    drive.plan(plan_);
    drive.next_segment(next_segment_);
    drive.tau_s(tau_s_);
    drive_.Write(drive);
    idl::main_motion::v1::State motion;
    motion.header() = drive.header();
    motion.plan(plan_);
    motion.next_event(next_event_);
    motion.next_gate(next_gate_);
    motion_.Write(motion);
  }

  void PlayTo(double tau_s) {
    const std::lock_guard lock(mutex_);
    tau_s_ = std::min(tau_s, buffered_end_s_);
  }
  double tau_s() {
    const std::lock_guard lock(mutex_);
    return tau_s_;
  }
  double buffered_end_s() {
    const std::lock_guard lock(mutex_);
    return buffered_end_s_;
  }
  std::uint32_t next_segment() {
    const std::lock_guard lock(mutex_);
    return next_segment_;
  }
  std::uint32_t next_event() {
    const std::lock_guard lock(mutex_);
    return next_event_;
  }
  std::uint32_t next_gate() {
    const std::lock_guard lock(mutex_);
    return next_gate_;
  }
  int joints_broken() {
    const std::lock_guard lock(mutex_);
    return joints_broken_;
  }
  double furthest_ahead_s() {
    const std::lock_guard lock(mutex_);
    return furthest_ahead_s_;
  }
  int batches() {
    const std::lock_guard lock(mutex_);
    return batches_;
  }
  // One batch in n, by chance: lost by count, a round of n batches that is sent again would lose its first one for ever.
  void LoseOneIn(int n) {
    const std::lock_guard lock(mutex_);
    lost_share_ = 1.0 / n;
  }

 private:
  void Take(const SegmentBatch& batch) {
    const std::lock_guard lock(mutex_);
    ++batches_;
    if (batch.plan() != plan_ || std::bernoulli_distribution(lost_share_)(chance_)) {
      return;
    }
    for (std::uint32_t i = 0; i < batch.count(); ++i) {
      const auto& s = batch.segments()[i];
      if (s.index() != next_segment_) {
        continue;
      }
      if (next_segment_ > 0 && std::abs(s.q_mm()[0] - end_q_) > 1e-8) {
        ++joints_broken_;
      }
      double power = 1.0;
      end_q_ = 0.0;
      for (std::size_t c = 0; c < 6; ++c, power *= s.duration_s()) {
        end_q_ += s.q_mm()[c] * power;
      }
      furthest_ahead_s_ = std::max(furthest_ahead_s_, s.start_s() - tau_s_);
      buffered_end_s_ = s.start_s() + s.duration_s();
      ++next_segment_;
    }
  }

  void Take(const ProcessBatch& batch) {
    const std::lock_guard lock(mutex_);
    if (batch.plan() != plan_) {
      return;
    }
    for (std::uint32_t i = 0; i < batch.gate_count(); ++i) {
      next_gate_ += batch.gates()[i].id() == next_gate_;
    }
    for (std::uint32_t i = 0; i < batch.event_count(); ++i) {
      next_event_ += batch.events()[i].index() == next_event_;
    }
  }

  std::mutex mutex_;
  std::uint64_t plan_ = 0;
  std::uint64_t number_ = 0;
  std::uint32_t next_segment_ = 0, next_event_ = 0, next_gate_ = 1;
  double buffered_end_s_ = 0.0, tau_s_ = 0.0, end_q_ = 0.0, furthest_ahead_s_ = 0.0;
  int joints_broken_ = 0, batches_ = 0;
  double lost_share_ = 0.0;
  std::mt19937 chance_{7};
  Writer<idl::drive::v1::StatePubSubType> drive_;
  Writer<idl::main_motion::v1::StatePubSubType> motion_;
  Reader<SegmentBatchPubSubType> segments_;
  Reader<ProcessBatchPubSubType> process_;
};

class TrajectoryProgram : public testing::Test {
 protected:
  TrajectoryProgram() {
    BusOptions options;
    options.house = "test";
    options.partition = "demo-1";
    options.domain = domain_.number();
    options.profile_file = test::SourceDir() + "/deploy/dds/profiles.xml";
    auto bus = Participant::Open(options, nullptr, nullptr);
    EXPECT_TRUE(bus.ok()) << bus.status();
    bus_ = std::move(*bus);
    machine_ = *ReadMachineFile(test::SourceDir() + "/deploy/config/machine.yaml");
    std::ifstream file(test::SourceDir() + "/deploy/parts/bracket.ngc");
    std::stringstream text;
    text << file.rdbuf();
    bracket_ = text.str();
  }

  std::unique_ptr<test::ChildProcess> StartProgram() {
    test::ChildOptions options;
    options.program = "trajectory";
    options.arguments = {"--config=" + test::SourceDir() + "/deploy/config/loopback.yaml",
                         "--bus.domain=" + std::to_string(domain_.number())};
    options.announce_file = folder_.path() + "/announce.json";
    auto program = std::make_unique<test::ChildProcess>(options);
    const auto ready = program->WaitUntilReady();
    EXPECT_TRUE(ready.has_value()) << program->err();
    ChannelOptions channel;
    channel.address = "127.0.0.1:" + std::to_string(ready ? ready->rpc_port : 1);
    stub_ = trajectory::v1::TrajectoryService::NewStub(*OpenChannel(channel));
    return program;
  }

  // Plans and waits; the plan's summary.
  trajectory::v1::PlanSummary PlanIt(const std::string& program, bool compensate) {
    trajectory::v1::PlanProgramRequest request;
    request.set_program(program);
    request.mutable_options()->set_compensate(compensate);
    trajectory::v1::PlanProgramResponse response;
    const absl::Status status = Call(&Stub::PlanProgram, *stub_, request, response);
    EXPECT_TRUE(status.ok()) << status;
    trajectory::v1::GetPlanRequest ask;
    ask.set_plan_id(response.plan_id());
    trajectory::v1::GetPlanResponse plan;
    EXPECT_TRUE(Eventually([&] {
      plan.Clear();
      EXPECT_TRUE(Call(&Stub::GetPlan, *stub_, ask, plan).ok());
      return plan.operation().state() != type::v1::OPERATION_STATE_RUNNING;
    }));
    EXPECT_EQ(plan.operation().state(), type::v1::OPERATION_STATE_DONE) << plan.DebugString();
    return plan.summary();
  }

  absl::Status StartStreaming(std::uint64_t plan) {
    trajectory::v1::StartStreamingRequest request;
    request.set_plan_id(plan);
    trajectory::v1::StartStreamingResponse response;
    return Call(&Stub::StartStreaming, *stub_, request, response);
  }

  test::PrivateDomain domain_;
  test::TemporaryFolder folder_;
  std::unique_ptr<Participant> bus_;
  MachineDescription machine_;
  std::string bracket_;
  std::unique_ptr<Stub> stub_;
};

TEST_F(TrajectoryProgram, StreamsWhatModulesLackAndNoMoreThanTheyNeed) {
  auto descriptions = Writer<MachineDescriptionPubSubType>::Open(
      *bus_, {idl::calibration::v1::MACHINE_DESCRIPTION_TOPIC,
              idl::schema::k_lambdajet_calibration_v1_machine_description, "description"});
  descriptions->Write(Description(machine_, 3));
  PlayedModules modules(*bus_);
  auto program = StartProgram();
  const auto summary = PlanIt(bracket_, true);
  EXPECT_EQ(summary.model_version().version(), 3u);
  EXPECT_GT(summary.predicted_95_mm(), 0.0);
  EXPECT_LE(summary.contour_tolerance_used_mm(), 0.02);
  ASSERT_TRUE(StartStreaming(summary.plan_id()).ok());

  // Nothing goes to modules that hold another plan.
  modules.Load(99);
  ASSERT_TRUE(Eventually([&] { return modules.Say(), true; }));
  EXPECT_TRUE(test::Throughout(std::chrono::milliseconds(200),
                               [&] { return modules.Say(), modules.batches() == 0; }));

  // Standing at the start: about two seconds ahead, then silence.
  modules.Load(summary.plan_id());
  ASSERT_TRUE(Eventually([&] { return modules.Say(), modules.buffered_end_s() > 1.9; }));
  ASSERT_TRUE(Eventually([&] {
    return modules.Say(),
           modules.next_gate() == summary.gate_count() + 1 && modules.next_event() == summary.event_count();
  }));
  EXPECT_TRUE(test::Throughout(std::chrono::milliseconds(300),
                               [&] { return modules.Say(), modules.buffered_end_s() < 2.2; }));

  // Half way with losses; then the program is killed, started again, asked again, and the plan is the same.
  modules.LoseOneIn(5);
  ASSERT_TRUE(Eventually([&] {
    modules.PlayTo(modules.tau_s() + 0.05);
    return modules.Say(), modules.next_segment() > summary.segment_count() / 2;
  }));
  program->Signal(SIGKILL);
  program->WaitForExit();
  program = StartProgram();
  EXPECT_EQ(PlanIt(bracket_, true).plan_id(), summary.plan_id());
  ASSERT_TRUE(StartStreaming(summary.plan_id()).ok());
  ASSERT_TRUE(Eventually([&] {
    modules.PlayTo(modules.tau_s() + 0.05);
    return modules.Say(), modules.next_segment() == summary.segment_count();
  }));
  EXPECT_EQ(modules.joints_broken(), 0);
  EXPECT_LT(modules.furthest_ahead_s(), 2.2);

  program->Signal(SIGTERM);
  EXPECT_EQ(program->WaitForExit(), 0) << program->err();
}

TEST_F(TrajectoryProgram, AnswersBadInputWithReasonsAndLines) {
  auto descriptions = Writer<MachineDescriptionPubSubType>::Open(
      *bus_, {idl::calibration::v1::MACHINE_DESCRIPTION_TOPIC,
              idl::schema::k_lambdajet_calibration_v1_machine_description, "description"});
  descriptions->Write(Description(machine_, 0));
  auto program = StartProgram();

  trajectory::v1::AdmitProgramRequest admit;
  trajectory::v1::AdmitProgramResponse answer;
  EXPECT_EQ(Call(&Stub::AdmitProgram, *stub_, admit, answer).code(), absl::StatusCode::kInvalidArgument);
  admit.set_program("G21 G90\nG0 X10 Y10\nM3\nG1 X900 F600\nM5\nM2\n");
  ASSERT_TRUE(Call(&Stub::AdmitProgram, *stub_, admit, answer).ok());
  EXPECT_FALSE(answer.admitted());
  ASSERT_EQ(answer.faults_size(), 1);
  EXPECT_EQ(answer.faults(0).line(), 4u);
  EXPECT_EQ(answer.faults(0).reason(), "OUTSIDE_SHEET");
  admit.set_program(bracket_);
  ASSERT_TRUE(Call(&Stub::AdmitProgram, *stub_, admit, answer).ok());
  EXPECT_TRUE(answer.admitted());
  EXPECT_EQ(answer.pierces(), 7u);

  trajectory::v1::PlanProgramRequest plan;
  trajectory::v1::PlanProgramResponse planned;
  plan.set_program(bracket_);
  for (const double scale : {0.0, -1.0, 1.3, std::nan("")}) {
    plan.mutable_options()->set_feed_scale(scale);
    EXPECT_EQ(TroubleReason(Call(&Stub::PlanProgram, *stub_, plan, planned)),
              std::isnan(scale) ? "NOT_FINITE" : "OUT_OF_RANGE");
  }
  plan.mutable_options()->clear_feed_scale();
  plan.mutable_options()->set_machine_version(17);
  const absl::Status version = Call(&Stub::PlanProgram, *stub_, plan, planned);
  EXPECT_EQ(version.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(TroubleReason(version), "MACHINE_VERSION_NOT_HELD");

  EXPECT_EQ(TroubleReason(StartStreaming(12345)), "UNKNOWN_PLAN");
  trajectory::v1::StopStreamingRequest stop;
  trajectory::v1::StopStreamingResponse stopped;
  EXPECT_TRUE(Call(&Stub::StopStreaming, *stub_, stop, stopped).ok());
  EXPECT_EQ(stopped.plan_id(), 0u);

  // Points of the plan: as many as asked for, in order, with the same end.
  const auto summary = PlanIt(bracket_, false);
  grpc::ClientContext context;
  trajectory::v1::StreamSamplesRequest points;
  points.set_plan_id(summary.plan_id());
  points.set_step_s(0.01);
  auto stream = stub_->StreamSamples(&context, points);
  trajectory::v1::SampleBatch batch;
  std::size_t count = 0;
  double last_s_mm = 0.0;
  while (stream->Read(&batch)) {
    count += static_cast<std::size_t>(batch.cutting_size());
    ASSERT_EQ(batch.values_size(), 12 * batch.cutting_size());
    last_s_mm = batch.values(batch.values_size() - 11);
  }
  EXPECT_TRUE(stream->Finish().ok());
  EXPECT_NEAR(static_cast<double>(count), summary.duration_s() / 0.01 + 1, 1.5);
  EXPECT_NEAR(last_s_mm, summary.length_mm(), 0.01);
  program->Signal(SIGTERM);
  EXPECT_EQ(program->WaitForExit(), 0) << program->err();
}

}  // namespace
}  // namespace lambdajet
