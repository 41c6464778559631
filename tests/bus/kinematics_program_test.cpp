// The kinematics program on a real bus: not ready before a machine description has arrived, then a pose for every state of
// the drive, with the parameters of the description that is in force.
#include <gtest/gtest.h>

#include <cmath>

#include "kinematics/core/hexapod_jacobian.hpp"
#include "lambdajet/calibration/v1/machine_description.schema.hpp"
#include "lambdajet/calibration/v1/machine_descriptionPubSubTypes.h"
#include "lambdajet/drive/v1/state.schema.hpp"
#include "lambdajet/drive/v1/statePubSubTypes.h"
#include "lambdajet/kinematics/v1/pose.schema.hpp"
#include "lambdajet/kinematics/v1/posePubSubTypes.h"
#include "lambdajet/kinematics/v1/spatial_pose.schema.hpp"
#include "lambdajet/kinematics/v1/spatial_posePubSubTypes.h"
#include "platform/bus/reader.hpp"
#include "platform/bus/sample_slots.hpp"
#include "platform/bus/writer.hpp"
#include "platform/machine_file/hexapod_file.hpp"
#include "platform/machine_file/machine_file.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/eventually.hpp"
#include "tests/support/private_domain.hpp"
#include "tests/support/temporary_folder.hpp"

namespace lambdajet {
namespace {

using idl::calibration::v1::MachineDescriptionPubSubType;
using idl::drive::v1::StatePubSubType;
using idl::kinematics::v1::Pose;
using idl::kinematics::v1::PosePubSubType;
using idl::kinematics::v1::SpatialPose;
using idl::kinematics::v1::SpatialPosePubSubType;
using idl::kinematics::v1::StrutReadingsPubSubType;
using test::Eventually;

idl::calibration::v1::MachineDescription Description(MachineDescription machine, std::uint32_t version,
                                                     double slider_zero_mm) {
  idl::calibration::v1::MachineDescription wire;
  wire.as_designed_yaml(MachineText(machine));
  machine.version = version;
  machine.value(Parameter::kSlider1ZeroMm) = slider_zero_mm;
  machine.value(Parameter::kSlider2ZeroMm) = slider_zero_mm;
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

class KinematicsProgram : public testing::Test {
 protected:
  KinematicsProgram() {
    BusOptions options;
    options.house = "test";
    options.partition = "demo-1";
    options.domain = domain_.number();
    options.profile_file = test::SourceDir() + "/deploy/dds/profiles.xml";
    auto bus = Participant::Open(options, nullptr, nullptr);
    EXPECT_TRUE(bus.ok()) << bus.status();
    bus_ = std::move(*bus);
    machine_ = *ReadMachineFile(test::SourceDir() + "/deploy/config/machine.yaml");
  }

  test::ChildOptions Program(const std::string& hexapod_file = "") {
    test::ChildOptions options;
    options.program = "kinematics";
    options.arguments = {"--config=" + test::SourceDir() + "/deploy/config/loopback.yaml",
                         "--bus.domain=" + std::to_string(domain_.number())};
    if (!hexapod_file.empty()) {
      options.arguments.push_back("--hexapod_file=" + hexapod_file);
    }
    options.announce_file = folder_.path() + "/announce.json";
    return options;
  }

  test::PrivateDomain domain_;
  test::TemporaryFolder folder_;
  std::unique_ptr<Participant> bus_;
  MachineDescription machine_;
};

TEST_F(KinematicsProgram, ServesAndPublishesPosesOnceItKnowsTheMachine) {
  auto descriptions = Writer<MachineDescriptionPubSubType>::Open(
      *bus_, {idl::calibration::v1::MACHINE_DESCRIPTION_TOPIC,
              idl::schema::k_lambdajet_calibration_v1_machine_description, "description"});
  auto drive = Writer<StatePubSubType>::Open(
      *bus_, {idl::drive::v1::STATE_TOPIC, idl::schema::k_lambdajet_drive_v1_state, "state"});
  LatestSample<Pose> poses;
  auto reader = Reader<PosePubSubType>::Open(
      *bus_, {idl::kinematics::v1::POSE_TOPIC, idl::schema::k_lambdajet_kinematics_v1_pose, "state"},
      [&](const Pose& sample, const Arrival& arrival) { poses.Put(sample, arrival); });
  ASSERT_TRUE(descriptions.ok() && drive.ok() && reader.ok());

  test::ChildProcess program(Program());
  idl::drive::v1::State state;
  state.header().session(77);
  state.actuator_position_mm({-474.6794344809, 618.8780654087});
  state.actuator_velocity_mm_per_s({25.0, 25.0});
  const auto Send = [&] {
    state.header().sequence_number(state.header().sequence_number() + 1);
    state.header().time_ns(state.header().time_ns() + 1'000'000);
    drive->Write(state);
  };
  // It reads the drive, but knows no machine: no pose, and not ready.
  ASSERT_TRUE(Eventually([&] { return drive->matched() == 1 && descriptions->matched() == 1; }))
      << program.err();
  Send();
  EXPECT_FALSE(program.WaitUntilReady(std::chrono::milliseconds(300)).has_value());
  EXPECT_EQ(poses.received(), 0u);

  descriptions->Write(Description(machine_, 0, 0.0));
  const auto ready = program.WaitUntilReady();
  ASSERT_TRUE(ready.has_value()) << program.err();
  ASSERT_TRUE(Eventually([&] { return Send(), poses.received() > 0; }));
  const Pose pose = poses.Latest()->first;
  EXPECT_EQ(pose.reason(), 1u);
  EXPECT_EQ(pose.model_version(), 0u);
  EXPECT_NEAR(pose.p_DE_mm()[0], 500.0, 1e-8);
  EXPECT_NEAR(pose.p_DE_mm()[1], 700.0, 1e-8);
  EXPECT_NEAR(pose.v_DE_mm_per_s()[0], 25.0, 1e-9);
  EXPECT_NEAR(pose.v_DE_mm_per_s()[1], 0.0, 1e-9);
  // Jet at 500, 1000; sheet at -300, 100 in E: the jet stands over (500 - 500 + 300, 1000 - 700 - 100).
  EXPECT_NEAR(pose.p_WJ_mm()[0], 300.0, 1e-8);
  EXPECT_NEAR(pose.p_WJ_mm()[1], 200.0, 1e-8);
  EXPECT_NEAR(pose.parallel_distance_mm(), 700.0, 1e-8);
  EXPECT_EQ(pose.working_mode()[0], 1);

  // A new version moves every pose by its zeros.
  descriptions->Write(Description(machine_, 1, 2.5));
  ASSERT_TRUE(Eventually([&] { return Send(), poses.Latest()->first.model_version() == 1; }));
  EXPECT_NEAR(poses.Latest()->first.p_DE_mm()[0], 502.5, 1e-8);

  // A description that is not what its hash says is not taken over; what was, stays.
  auto broken = Description(machine_, 2, 5.0);
  broken.parameters()[7] = 6.0;
  descriptions->Write(broken);
  ASSERT_TRUE(Eventually([&] {
    return program.err().find("DESCRIPTION_HASH") != std::string::npos ||
           program.err().find("description_refused") != std::string::npos;
  }));
  const auto before = poses.received();
  ASSERT_TRUE(Eventually([&] { return Send(), poses.received() > before + 3; }));
  EXPECT_EQ(poses.Latest()->first.model_version(), 1u);

  // Sliders too far apart: an answer with a reason, and no NaN.
  state.actuator_position_mm({-1000.0, 1000.0});
  ASSERT_TRUE(Eventually([&] { return Send(), poses.Latest()->first.reason() == 2; }));
  EXPECT_EQ(poses.Latest()->first.p_DE_mm()[0], 0.0);
  state.actuator_position_mm({std::nan(""), 1000.0});
  ASSERT_TRUE(Eventually([&] { return Send(), poses.Latest()->first.reason() == 5; }));
  EXPECT_TRUE(std::isfinite(poses.Latest()->first.actuator_position_mm()[0]));

  program.Signal(SIGTERM);
  EXPECT_EQ(program.WaitForExit(), 0) << program.err();
}

TEST_F(KinematicsProgram, DropsSamplesThatAreOldOrOfAnEndedSession) {
  auto descriptions = Writer<MachineDescriptionPubSubType>::Open(
      *bus_, {idl::calibration::v1::MACHINE_DESCRIPTION_TOPIC,
              idl::schema::k_lambdajet_calibration_v1_machine_description, "description"});
  descriptions->Write(Description(machine_, 0, 0.0));
  auto drive = Writer<StatePubSubType>::Open(
      *bus_, {idl::drive::v1::STATE_TOPIC, idl::schema::k_lambdajet_drive_v1_state, "state"});
  std::atomic<std::int64_t> newest = 0;
  std::atomic<int> count = 0;
  auto reader = Reader<PosePubSubType>::Open(
      *bus_, {idl::kinematics::v1::POSE_TOPIC, idl::schema::k_lambdajet_kinematics_v1_pose, "state"},
      [&](const Pose& sample, const Arrival&) {
        newest = sample.header().time_ns();
        ++count;
      });
  test::ChildProcess program(Program());
  ASSERT_TRUE(program.WaitUntilReady().has_value()) << program.err();  // a late joiner gets the description
  idl::drive::v1::State state;
  state.actuator_position_mm({-474.6794344809, 618.8780654087});
  const auto Send = [&](std::uint64_t session, std::uint64_t sequence, std::int64_t time) {
    state.header().session(session);
    state.header().sequence_number(sequence);
    state.header().time_ns(time);
    drive->Write(state);
  };
  std::uint64_t sequence = 0;
  ASSERT_TRUE(Eventually([&] { return Send(5, ++sequence, 1), newest == 1; }));
  ASSERT_TRUE(Eventually([&] { return Send(3, 1, 2), newest == 2; }));  // the drive has restarted
  Send(5, sequence + 10, 3);                                            // a straggler of the session before
  Send(3, 1, 4);                                                        // a repetition
  Send(3, 2, 5);
  ASSERT_TRUE(Eventually([&] { return newest == 5; }));
  EXPECT_EQ(newest.load(), 5);
  const int seen = count;
  Send(3, 2, 6);
  Send(5, sequence + 11, 7);
  Send(3, 3, 8);
  ASSERT_TRUE(Eventually([&] { return newest == 8; }));
  EXPECT_EQ(count.load(), seen + 1);
}

TEST_F(KinematicsProgram, AnswersForItsHexapodWithoutAMachineDescription) {
  const std::string file = test::SourceDir() + "/deploy/config/hexapod.yaml";
  const auto machine = ReadHexapodFile(file);
  ASSERT_TRUE(machine.ok()) << machine.status();
  const kinematics::Hexapod hexapod(machine->geometry);
  auto struts = Writer<StrutReadingsPubSubType>::Open(
      *bus_, {idl::kinematics::v1::STRUT_READINGS_TOPIC, idl::schema::k_lambdajet_kinematics_v1_spatial_pose,
              "state"});
  LatestSample<SpatialPose> poses;
  auto reader = Reader<SpatialPosePubSubType>::Open(
      *bus_,
      {idl::kinematics::v1::SPATIAL_POSE_TOPIC, idl::schema::k_lambdajet_kinematics_v1_spatial_pose, "state"},
      [&](const SpatialPose& sample, const Arrival& arrival) { poses.Put(sample, arrival); });
  ASSERT_TRUE(struts.ok() && reader.ok());
  test::ChildProcess program(Program(file));
  ASSERT_TRUE(program.WaitUntilReady().has_value()) << program.err();

  const lambdajet::Pose X_MT = kinematics::PlatformPose{40, -30, 960, 0.1, 0.15, -0.1}.X_MP();
  const lambdajet::Pose X_MP = kinematics::PlatformFromTool(hexapod, X_MT);
  const Twist twist{{30, -20, 10}, {0.1, 0.2, -0.3}};
  const auto actuators = kinematics::SolveInverse(hexapod, X_MP);
  const auto motion = kinematics::ActuatorMotionOfTool(hexapod, X_MP, twist, {});
  ASSERT_EQ(actuators.reason, kinematics::Reason::kSolved);
  idl::kinematics::v1::StrutReadings readings;
  readings.header().session(9);
  for (std::size_t j = 0; j < 6; ++j) {
    readings.actuator_position_mm()[j] = actuators.actuators_mm[static_cast<Eigen::Index>(j)];
    readings.actuator_velocity_mm_per_s()[j] = motion.motion.velocity_mm_per_s[static_cast<Eigen::Index>(j)];
  }
  const auto Send = [&] {
    readings.header().sequence_number(readings.header().sequence_number() + 1);
    struts->Write(readings);
  };
  ASSERT_TRUE(Eventually([&] { return Send(), poses.received() > 0; })) << program.err();
  const SpatialPose pose = poses.Latest()->first;
  EXPECT_EQ(pose.reason(), 1u);
  EXPECT_EQ(std::string(pose.model_hash().c_str()), HexapodHash(*machine));
  for (std::size_t i = 0; i < 3; ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    EXPECT_NEAR(pose.p_MT_mm()[i], X_MT.p_mm[at], 1e-8);
    EXPECT_NEAR(pose.v_MT_mm_per_s()[i], twist.v_mm_per_s[at], 1e-8);
    EXPECT_NEAR(pose.w_MT_rad_per_s()[i], twist.w_rad_per_s[at], 1e-10);
  }
  EXPECT_NEAR(pose.krylov_rad()[1], 0.15, 1e-11);
  EXPECT_GT(pose.singular_margin_ratio(), machine->geometry.limits.singular_margin);

  // Lengths that no pose has, and numbers that are none: an answer with a reason, and the next pose is found again.
  readings.actuator_position_mm()[3] = 5000.0;
  ASSERT_TRUE(Eventually([&] { return Send(), poses.Latest()->first.reason() == 8; }));
  EXPECT_EQ(poses.Latest()->first.p_MT_mm()[2], 0.0);
  readings.actuator_position_mm()[3] = std::nan("");
  ASSERT_TRUE(Eventually([&] { return Send(), poses.Latest()->first.reason() == 5; }));
  EXPECT_EQ(poses.Latest()->first.actuator_position_mm()[3], 0.0);
  readings.actuator_position_mm()[3] = actuators.actuators_mm[3];
  ASSERT_TRUE(Eventually([&] { return Send(), poses.Latest()->first.reason() == 1; }));
}

TEST_F(KinematicsProgram, RefusesAHexapodFileThatIsNone) {
  test::ChildProcess program(Program(test::SourceDir() + "/deploy/config/machine.yaml"));
  EXPECT_EQ(program.WaitForExit(), 78);
  EXPECT_NE(program.err().find("BAD_HEXAPOD_FILE"), std::string::npos) << program.err();
}

}  // namespace
}  // namespace lambdajet
