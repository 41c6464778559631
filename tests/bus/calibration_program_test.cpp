// The calibration program between main motion (here: a simulator of looks on a real bus) and its clients (real gRPC): from
// the machine file to an identified, activated, published version that survives kill -9.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <csignal>

#include "foundation/contract/trouble.hpp"
#include "lambdajet/calibration/v1/calibration.grpc.pb.h"
#include "lambdajet/calibration/v1/machine_description.schema.hpp"
#include "lambdajet/calibration/v1/machine_descriptionPubSubTypes.h"
#include "lambdajet/main_motion/v1/state.schema.hpp"
#include "lambdajet/main_motion/v1/statePubSubTypes.h"
#include "platform/bus/reader.hpp"
#include "platform/bus/sample_slots.hpp"
#include "platform/bus/writer.hpp"
#include "platform/machine_file/machine_file.hpp"
#include "platform/rpc/channel.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/eventually.hpp"
#include "tests/support/private_domain.hpp"
#include "tests/support/simulated_looks.hpp"
#include "tests/support/temporary_folder.hpp"

namespace lambdajet {
namespace {

using calibration::v1::CalibrationService;
using idl::calibration::v1::MachineDescriptionPubSubType;
using idl::main_motion::v1::MeasurementPubSubType;
using test::Eventually;
using testing::HasSubstr;
namespace v1 = calibration::v1;

constexpr std::uint64_t kPlan = 0xfedcba9876543210;  // beyond what a signed integer holds

class CalibrationProgram : public testing::Test {
 protected:
  CalibrationProgram() {
    BusOptions options;
    options.house = "test";
    options.partition = "demo-1";
    options.domain = domain_.number();
    options.profile_file = test::SourceDir() + "/deploy/dds/profiles.xml";
    auto bus = Participant::Open(options, nullptr, nullptr);
    EXPECT_TRUE(bus.ok()) << bus.status();
    bus_ = std::move(*bus);
    machine_ = *ReadMachineFile(test::SourceDir() + "/deploy/config/machine.yaml");
    machine_.process.measuring_settle_time_s = 20.0;  // the simulated looks at rest hold no swing
    machine_file_ = folder_.path() + "/machine.yaml";
    EXPECT_TRUE(WriteMachineFile(machine_file_, machine_).ok());
    auto reader = Reader<MachineDescriptionPubSubType>::Open(
        *bus_,
        {idl::calibration::v1::MACHINE_DESCRIPTION_TOPIC,
         idl::schema::k_lambdajet_calibration_v1_machine_description, "description"},
        [this](const idl::calibration::v1::MachineDescription& sample, const Arrival& arrival) {
          descriptions_.Put(sample, arrival);
        });
    EXPECT_TRUE(reader.ok());
    reader_.emplace(std::move(*reader));
    auto writer = Writer<MeasurementPubSubType>::Open(
        *bus_,
        {idl::main_motion::v1::MEASUREMENT_TOPIC, idl::schema::k_lambdajet_main_motion_v1_state, "setpoint"});
    EXPECT_TRUE(writer.ok());
    writer_.emplace(std::move(*writer));
  }

  test::ChildOptions Program(bool with_machine = true) {
    test::ChildOptions options;
    options.program = "calibration";
    options.arguments = {"--config=" + test::SourceDir() + "/deploy/config/loopback.yaml",
                         "--bus.domain=" + std::to_string(domain_.number()),
                         "--store=" + folder_.path() + "/calibration.sqlite"};
    if (with_machine) {
      options.arguments.push_back("--machine=" + machine_file_);
    }
    options.announce_file = folder_.path() + "/announce.json";
    return options;
  }

  std::unique_ptr<CalibrationService::Stub> Client(test::ChildProcess& program) {
    const auto ready = program.WaitUntilReady();
    EXPECT_TRUE(ready.has_value()) << program.err();
    if (!ready) {
      return nullptr;
    }
    auto channel = OpenChannel({.address = "127.0.0.1:" + std::to_string(ready->rpc_port)});
    EXPECT_TRUE(channel.ok());
    return CalibrationService::NewStub(*channel);
  }

  void Send(const calibration::Measurement& look, std::uint32_t gate) {
    idl::main_motion::v1::Measurement wire;
    wire.header().session(9);
    wire.header().sequence_number(++sequence_);
    wire.plan(kPlan);
    wire.gate(gate);
    wire.mark(look.mark);
    wire.seen(look.seen);
    wire.exposure_ns(look.exposure_ns);
    wire.x_C_mm(look.p_C_mm.x());
    wire.y_C_mm(look.p_C_mm.y());
    for (int i = 0; i < 2; ++i) {
      wire.actuator_position_mm()[static_cast<std::size_t>(i)] = look.actuator_position_mm[i];
      wire.actuator_velocity_mm_per_s()[static_cast<std::size_t>(i)] = look.actuator_velocity_mm_per_s[i];
      wire.jet_pierce_actuator_position_mm()[static_cast<std::size_t>(i)] =
          look.pierce_actuator_position_mm[i];
    }
    ASSERT_TRUE(Eventually([&] { return writer_->Write(wire); }));
  }

  // Looks at all marks, three holes and a shaken mark.
  std::vector<calibration::Measurement> MeasuringRun(support::LookSimulator& simulator) {
    std::vector<calibration::Measurement> run;
    for (const SheetMark& mark : machine_.marks) {
      run.push_back(simulator.Still(mark.id));
    }
    run.push_back(simulator.Hole(1, {794.0, 594.0}));
    run.push_back(simulator.Hole(2, {794.0, 6.0}));
    run.push_back(simulator.Hole(3, {6.0, 594.0}));
    for (const auto& picture : simulator.Tracking(13, 4.0, 4.0, 0.6)) {
      run.push_back(picture);
    }
    return run;
  }

  void SendRun(const std::vector<calibration::Measurement>& run) {
    std::uint32_t gate = 0;
    for (const auto& look : run) {
      Send(look, look.kind == calibration::LookKind::kTracking ? 0 : ++gate);
    }
  }

  std::uint32_t DescribedVersion() {
    const auto latest = descriptions_.Latest();
    return latest ? latest->first.version() : 1000;
  }

  test::PrivateDomain domain_;
  test::TemporaryFolder folder_;
  std::string machine_file_;
  MachineDescription machine_;
  LatestSample<idl::calibration::v1::MachineDescription> descriptions_;
  std::unique_ptr<Participant> bus_;
  std::optional<Reader<MachineDescriptionPubSubType>> reader_;
  std::optional<Writer<MeasurementPubSubType>> writer_;
  std::uint64_t sequence_ = 0;
};

TEST_F(CalibrationProgram, IdentifiesActivatesAndKeepsItsVersionsThroughKills) {
  support::LookSimulator simulator(machine_, 4);
  simulator.DrawTruth();
  const auto run = MeasuringRun(simulator);
  std::string active_hash;
  {
    test::ChildProcess program(Program());
    auto client = Client(program);
    ASSERT_NE(client, nullptr);
    ASSERT_TRUE(Eventually([&] { return DescribedVersion() == 0; }));

    v1::PlanMeasuringRunResponse planned;
    ASSERT_TRUE(Call(&CalibrationService::Stub::PlanMeasuringRun, *client, {}, planned).ok());
    EXPECT_THAT(planned.program(), HasSubstr("M101 P"));
    EXPECT_THAT(planned.expectation(), HasSubstr("trial pierces"));
    EXPECT_EQ(planned.model_version().machine_id(), "demo-1");

    ASSERT_TRUE(Eventually([&] { return writer_->matched() == 1; }));
    SendRun(run);
    v1::GetRunRequest of_run;
    of_run.set_plan_id(kPlan);
    v1::GetRunResponse kept;
    ASSERT_TRUE(Eventually([&] {
      return Call(&CalibrationService::Stub::GetRun, *client, of_run, kept).ok() &&
             kept.looks_size() == static_cast<int>(run.size());
    })) << kept.looks_size();
    EXPECT_EQ(kept.looks(3).x_c_mm(), run[3].p_C_mm.x());
    program.Signal(SIGKILL);
    ASSERT_TRUE(program.WaitForExit().has_value());
  }
  {
    test::ChildProcess program(Program(false));  // the store knows the machine
    auto client = Client(program);
    ASSERT_NE(client, nullptr);
    v1::ListRunsResponse runs;
    ASSERT_TRUE(Call(&CalibrationService::Stub::ListRuns, *client, {}, runs).ok());
    ASSERT_EQ(runs.runs_size(), 1);
    EXPECT_EQ(runs.runs(0).plan_id(), kPlan);
    EXPECT_EQ(runs.runs(0).looks(), run.size());

    v1::StartIdentificationRequest start;
    start.set_plan_id(kPlan);
    start.set_author("test");
    v1::StartIdentificationResponse started;
    ASSERT_TRUE(Call(&CalibrationService::Stub::StartIdentification, *client, start, started).ok());
    v1::GetIdentificationRequest ask;
    ask.set_operation_id(started.operation().id());
    v1::GetIdentificationResponse answer;
    ASSERT_TRUE(Eventually([&] {
      return Call(&CalibrationService::Stub::GetIdentification, *client, ask, answer).ok() &&
             answer.operation().state() != type::v1::OPERATION_STATE_RUNNING;
    }));
    ASSERT_EQ(answer.operation().state(), type::v1::OPERATION_STATE_DONE) << answer.operation().message();
    EXPECT_EQ(answer.result().version(), 1u);
    EXPECT_LT(answer.result().rms_after_mm(), 0.1 * answer.result().rms_before_mm());
    EXPECT_LT(answer.result().place_bound_95_mm(), 0.15);
    EXPECT_EQ(answer.result().parameters_size(), static_cast<int>(kParameterCount));
    EXPECT_NEAR(answer.result().stiffness_n_per_mm(),
                1e-3 * machine_.moving_mass_kg / simulator.truth()[calibration::At(Parameter::kElasticLagS2)],
                0.5);

    v1::ActivateVersionRequest activate;
    activate.set_version(1);
    activate.set_author("test");
    v1::ActivateVersionResponse active;
    ASSERT_TRUE(Call(&CalibrationService::Stub::ActivateVersion, *client, activate, active).ok());
    EXPECT_EQ(active.model_version().version(), 1u);
    active_hash = active.model_version().hash();
    ASSERT_TRUE(Eventually([&] { return DescribedVersion() == 1; }));
    const auto described = descriptions_.Latest()->first;
    EXPECT_EQ(described.hash().to_string(), active_hash);
    EXPECT_EQ(described.parameters()[9], [&] {
      for (const auto& p : answer.result().parameters()) {
        if (p.name() == "base_x_mm") return p.after();
      }
      return 0.0;
    }());
    program.Signal(SIGKILL);
    ASSERT_TRUE(program.WaitForExit().has_value());
  }
  {
    test::ChildProcess program(Program(false));
    auto client = Client(program);
    ASSERT_NE(client, nullptr);
    v1::GetVersionResponse version;
    ASSERT_TRUE(Call(&CalibrationService::Stub::GetVersion, *client, {}, version).ok());
    EXPECT_EQ(version.version().model_version().version(), 1u);
    EXPECT_EQ(version.version().model_version().hash(), active_hash);
    EXPECT_EQ(version.version().author(), "test");
    EXPECT_EQ(version.version().run_plan_id(), kPlan);
    const auto machine = ParseMachine(version.machine_yaml(), "version 1");
    ASSERT_TRUE(machine.ok()) << machine.status();
    EXPECT_EQ(MachineHash(*machine), active_hash);

    // The base stands; then it moves by 0.2 mm. Each time three looks, the gates from 1 again, are a new pass of the plan. Sent
    // until they are heard: the reader is a new one.
    v1::VerifyBaseRequest verify;
    verify.set_plan_id(kPlan);
    v1::VerifyBaseResponse verdict;
    const auto Verified = [&](const char* wanted) {
      return Eventually([&] {
        std::uint32_t gate = 0;
        for (const int mark : {1, 3, 5}) Send(simulator.Still(mark), ++gate);
        return Call(&CalibrationService::Stub::VerifyBase, *client, verify, verdict).ok() &&
               verdict.degrees_of_freedom() == 6 && verdict.verdict() == wanted;
      });
    };
    EXPECT_TRUE(Verified("PASS")) << verdict.verdict() << ": " << verdict.message();
    ParameterVector moved = simulator.truth();
    moved[calibration::At(Parameter::kBaseXMm)] += 0.2;
    simulator.SetTruth(moved);
    EXPECT_TRUE(Verified("MOVED")) << verdict.verdict() << ": " << verdict.message();
    EXPECT_THAT(verdict.message(), HasSubstr("module moved"));

    v1::ActivateVersionRequest back;  // rolling back is activating the parent
    back.set_author("test");
    v1::ActivateVersionResponse active;
    ASSERT_TRUE(Call(&CalibrationService::Stub::ActivateVersion, *client, back, active).ok());
    ASSERT_TRUE(Eventually([&] { return DescribedVersion() == 0; }));
    v1::ListVersionsResponse versions;
    ASSERT_TRUE(Call(&CalibrationService::Stub::ListVersions, *client, {}, versions).ok());
    ASSERT_EQ(versions.versions_size(), 2);
    EXPECT_FALSE(versions.versions(0).active());
    EXPECT_TRUE(versions.versions(1).active());
    program.Signal(SIGTERM);
    EXPECT_EQ(program.WaitForExit(), 0) << program.err();
  }
}

TEST_F(CalibrationProgram, AnswersBadRequestsWithReasons) {
  test::ChildProcess program(Program());
  auto client = Client(program);
  ASSERT_NE(client, nullptr);
  const auto Reason = [](const absl::Status& status) { return TroubleReason(status); };

  v1::GetRunRequest run;
  v1::GetRunResponse run_answer;
  EXPECT_EQ(Reason(Call(&CalibrationService::Stub::GetRun, *client, run, run_answer)), "EMPTY");
  run.set_plan_id(77);
  EXPECT_EQ(Reason(Call(&CalibrationService::Stub::GetRun, *client, run, run_answer)), "UNKNOWN_RUN");
  v1::GetVersionRequest version;
  version.set_version(4000000000u);
  v1::GetVersionResponse version_answer;
  EXPECT_EQ(Reason(Call(&CalibrationService::Stub::GetVersion, *client, version, version_answer)),
            "UNKNOWN_VERSION");
  v1::ActivateVersionRequest activate;
  activate.set_version(3);
  v1::ActivateVersionResponse activate_answer;
  EXPECT_EQ(Reason(Call(&CalibrationService::Stub::ActivateVersion, *client, activate, activate_answer)),
            "UNKNOWN_VERSION");
  v1::GetIdentificationRequest operation;
  operation.set_operation_id("../etc");
  v1::GetIdentificationResponse operation_answer;
  EXPECT_EQ(Reason(Call(&CalibrationService::Stub::GetIdentification, *client, operation, operation_answer)),
            "BAD_ID");
  operation.set_operation_id("identification-0");
  EXPECT_EQ(Reason(Call(&CalibrationService::Stub::GetIdentification, *client, operation, operation_answer)),
            "UNKNOWN_OPERATION");
  v1::PlanMeasuringRunRequest plan;
  plan.set_looks(4000);
  v1::PlanMeasuringRunResponse plan_answer;
  EXPECT_EQ(Reason(Call(&CalibrationService::Stub::PlanMeasuringRun, *client, plan, plan_answer)),
            "OUT_OF_RANGE");
  v1::ListVersionsRequest list;
  list.set_page_token("x");
  v1::ListVersionsResponse list_answer;
  EXPECT_EQ(Reason(Call(&CalibrationService::Stub::ListVersions, *client, list, list_answer)),
            "BAD_PAGE_TOKEN");

  // A look that is not finite is not kept; the next one is.
  ASSERT_TRUE(Eventually([&] { return writer_->matched() == 1; }));
  support::LookSimulator simulator(machine_, 5);
  auto look = simulator.Still(1);
  look.p_C_mm.x() = std::nan("");
  Send(look, 1);
  Send(simulator.Still(2), 2);
  run.set_plan_id(kPlan);
  ASSERT_TRUE(
      Eventually([&] { return Call(&CalibrationService::Stub::GetRun, *client, run, run_answer).ok(); }));
  EXPECT_EQ(run_answer.looks_size(), 1);

  // Too few looks: a failed operation that says so, no version.
  v1::StartIdentificationRequest start;
  start.set_plan_id(kPlan);
  v1::StartIdentificationResponse started;
  ASSERT_TRUE(Call(&CalibrationService::Stub::StartIdentification, *client, start, started).ok());
  operation.set_operation_id(started.operation().id());
  ASSERT_TRUE(Eventually([&] {
    return Call(&CalibrationService::Stub::GetIdentification, *client, operation, operation_answer).ok() &&
           operation_answer.operation().state() == type::v1::OPERATION_STATE_FAILED;
  }));
  EXPECT_EQ(operation_answer.operation().reason(), "TOO_FEW");
}

TEST_F(CalibrationProgram, RefusesToStartWithoutAMachine) {
  test::ChildProcess program(Program(false));
  EXPECT_NE(program.WaitForExit().value_or(0), 0);
  EXPECT_THAT(program.err(), HasSubstr("NO_MACHINE_FILE"));
}

}  // namespace
}  // namespace lambdajet
