// The DDS doors of accuracy and inspection: the truth arrives whole, and accuracy/live says what the core calculates.
#include <gtest/gtest.h>

#include "accuracy/bus/live_room.hpp"
#include "accuracy/core/error_chain.hpp"
#include "inspection/bus/truth_reader.hpp"
#include "lambdajet/accuracy/v1/live.schema.hpp"
#include "lambdajet/accuracy/v1/livePubSubTypes.h"
#include "lambdajet/calibration/v1/machine_description.schema.hpp"
#include "lambdajet/calibration/v1/machine_descriptionPubSubTypes.h"
#include "lambdajet/drive/v1/state.schema.hpp"
#include "lambdajet/drive/v1/statePubSubTypes.h"
#include "lambdajet/plant/v1/truth.schema.hpp"
#include "lambdajet/plant/v1/truthPubSubTypes.h"
#include "platform/bus/participant.hpp"
#include "platform/bus/reader.hpp"
#include "platform/bus/sample_slots.hpp"
#include "platform/bus/writer.hpp"
#include "platform/machine_file/machine_file.hpp"
#include "platform/process/common_clock.hpp"
#include "platform/telemetry/log.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/eventually.hpp"
#include "tests/support/private_domain.hpp"

namespace lambdajet::test {
namespace {

namespace plant = idl::plant::v1;
namespace calibration_wire = idl::calibration::v1;
namespace drive_wire = idl::drive::v1;
namespace live_wire = idl::accuracy::v1;

class Doors : public ::testing::Test {
 protected:
  std::unique_ptr<Participant> Join(const std::string& house) {
    BusOptions options;
    options.house = house;
    options.partition = "demo-1";
    options.domain = domain_.number();
    options.peers_per_host = 64;
    options.profile_file = SourceDir() + "/deploy/dds/profiles.xml";
    auto participant = Participant::Open(options, nullptr, nullptr);
    EXPECT_TRUE(participant.ok()) << participant.status().ToString();
    return std::move(*participant);
  }
  PrivateDomain domain_;
};

TEST_F(Doors, RecordEveryBatchOfTheTruth) {
  const auto ours = Join("inspection");
  const auto theirs = Join("plants");
  inspection::Recorder recorder;
  auto truth = inspection::TruthReader::Open(*ours, recorder);
  ASSERT_TRUE(truth.ok()) << truth.status();
  auto sheet = Writer<plant::DriveTruthPubSubType>::Open(
      *theirs, {plant::DRIVE_TRUTH_TOPIC, idl::schema::k_lambdajet_plant_v1_truth, "setpoint"});
  auto jet = Writer<plant::JetTruthPubSubType>::Open(
      *theirs, {plant::JET_TRUTH_TOPIC, idl::schema::k_lambdajet_plant_v1_truth, "setpoint"});
  ASSERT_TRUE(sheet.ok() && jet.ok());
  ASSERT_TRUE(
      Eventually([&] { return (*truth)->writers() == 2 && sheet->matched() == 1 && jet->matched() == 1; }));
  recorder.Begin(9, {});
  constexpr int kBatches = 300;
  for (int b = 0; b < kBatches; ++b) {
    plant::DriveTruth s;
    plant::JetTruth j;
    s.plan(9);
    j.plan(9);
    s.count(10);
    j.count(10);
    s.header().session(1);
    j.header().session(2);
    s.header().sequence_number(static_cast<std::uint64_t>(b + 1));
    j.header().sequence_number(static_cast<std::uint64_t>(b + 1));
    for (int i = 0; i < 10; ++i) {
      s.samples()[static_cast<std::size_t>(i)].time_ns(1'000'000 * (10 * b + i));
      j.samples()[static_cast<std::size_t>(i)].time_ns(1'000'000 * (10 * b + i));
    }
    j.lag_time_s(0.004);
    j.jet_on(true);
    ASSERT_TRUE(Eventually([&] { return sheet->Write(s); }));
    ASSERT_TRUE(Eventually([&] { return jet->Write(j); }));
  }
  EXPECT_TRUE(sheet->WaitForAcknowledgments(10.0) && jet->WaitForAcknowledgments(10.0));
  EXPECT_TRUE(Eventually([&] {
    const auto kept = recorder.TruthOf(9);
    return kept.ok() && kept->sheet.size() == 10 * kBatches && kept->jet.size() == 10 * kBatches;
  }));
  const auto size = recorder.End(9);
  ASSERT_TRUE(size.ok());
  EXPECT_EQ(size->missing, 0u);
  EXPECT_DOUBLE_EQ(recorder.TruthOf(9)->lag_time_s, 0.004);
  EXPECT_TRUE(recorder.TruthOf(9)->jet_on_at_start);

  plant::JetTruth wrong;
  wrong.plan(9);
  wrong.count(11);
  ASSERT_TRUE(jet->Write(wrong));
  EXPECT_TRUE(Eventually([&] { return (*truth)->refused() == 1; }));
}

calibration_wire::MachineDescription WireOf(const MachineDescription& machine) {
  calibration_wire::MachineDescription sample;
  sample.version(machine.version);
  sample.hash(MachineHash(machine));
  sample.as_designed_yaml(MachineText(machine));
  for (std::size_t i = 0; i < kParameterCount; ++i) {
    sample.parameters()[i] = machine.parameters[static_cast<Eigen::Index>(i)];
    for (std::size_t j = 0; j < kParameterCount; ++j) {
      sample.covariance()[kParameterCount * i + j] =
          machine.covariance(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
    }
  }
  return sample;
}

TEST_F(Doors, SayLiveWhatTheCoreCalculates) {
  const auto ours = Join("accuracy");
  const auto theirs = Join("others");
  Log log({.house = "accuracy", .level = LogLevel::kError});
  const CommonClock clock;
  std::atomic<int> first = 0;
  auto machines = accuracy::MachineReader::Open(*ours, log, [&] { ++first; });
  ASSERT_TRUE(machines.ok());
  auto live = accuracy::LiveRoom::Open(*ours, **machines, clock);
  ASSERT_TRUE(live.ok()) << live.status();

  auto description = Writer<calibration_wire::MachineDescriptionPubSubType>::Open(
      *theirs, {calibration_wire::MACHINE_DESCRIPTION_TOPIC,
                idl::schema::k_lambdajet_calibration_v1_machine_description, "description"});
  auto drive = Writer<drive_wire::StatePubSubType>::Open(
      *theirs, {drive_wire::STATE_TOPIC, idl::schema::k_lambdajet_drive_v1_state, "state"});
  LatestSample<live_wire::Live> heard;
  auto reader = Reader<live_wire::LivePubSubType>::Open(
      *theirs, {live_wire::LIVE_TOPIC, idl::schema::k_lambdajet_accuracy_v1_live, "state"},
      [&](const live_wire::Live& s, const Arrival& a) { heard.Put(s, a); });
  ASSERT_TRUE(description.ok() && drive.ok() && reader.ok());

  auto machine = ReadMachineFile(SourceDir() + "/deploy/config/machine.yaml");
  ASSERT_TRUE(machine.ok());
  machine->version = 4;
  calibration_wire::MachineDescription wrong = WireOf(*machine);
  wrong.hash("000000000000");
  ASSERT_TRUE(description->Write(wrong));
  ASSERT_TRUE(description->Write(WireOf(*machine)));
  ASSERT_TRUE(Eventually([&] { return (*machines)->active() != nullptr; }));
  EXPECT_EQ((*machines)->active()->version, 4u);
  EXPECT_EQ(first, 1);

  const accuracy::ErrorChain chain(*machine);
  const Eigen::Vector2d p_W(400.0, 300.0);
  const auto q = kinematics::SolveInverse(chain.mechanism, chain.EffectorAt(p_W)).actuator_position_mm;
  drive_wire::State state;
  state.actuator_position_mm() = {q.x(), q.y()};
  std::int64_t stamp = 1'000'000;
  ASSERT_TRUE(Eventually([&] {
    state.header().time_ns(stamp += 1'000'000);
    drive->Write(state);
    return heard.received() >= 3;
  }));
  const live_wire::Live sample = heard.Latest()->first;
  EXPECT_EQ(sample.model_version(), 4u);
  EXPECT_NEAR(sample.p_WJ_x_mm(), 400.0, 1e-9);
  EXPECT_NEAR(sample.p_WJ_y_mm(), 300.0, 1e-9);
  const auto expected = accuracy::ContourErrorAt(chain, {p_W, {0, 0}, {0, 0}}, false);
  EXPECT_NEAR(sample.bound_95_mm(), expected.bound_95_mm, 1e-9);
  EXPECT_GT(sample.base_mm(), 0.1);
}

}  // namespace
}  // namespace lambdajet::test
