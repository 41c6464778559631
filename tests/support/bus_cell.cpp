#include "tests/support/bus_cell.hpp"

#include <cstdlib>
#include <iostream>
#include <optional>
#include <utility>

#include "foundation/motion/plan_batches.hpp"
#include "lambdajet/calibration/v1/machine_description.schema.hpp"
#include "lambdajet/calibration/v1/machine_descriptionPubSubTypes.h"
#include "lambdajet/cell/v1/command.schema.hpp"
#include "lambdajet/cell/v1/commandPubSubTypes.h"
#include "lambdajet/drive/v1/state.schema.hpp"
#include "lambdajet/drive/v1/statePubSubTypes.h"
#include "lambdajet/main_motion/v1/state.schema.hpp"
#include "lambdajet/main_motion/v1/statePubSubTypes.h"
#include "lambdajet/plant/v1/truth.schema.hpp"
#include "lambdajet/plant/v1/truthPubSubTypes.h"
#include "lambdajet/trajectory/v1/plan.schema.hpp"
#include "lambdajet/trajectory/v1/planPubSubTypes.h"
#include "link/wire/link_wire.hpp"
#include "platform/bus/participant.hpp"
#include "platform/bus/reader.hpp"
#include "platform/bus/writer.hpp"
#include "platform/machine_file/machine_file.hpp"
#include "platform/process/common_clock.hpp"
#include "tests/support/eventually.hpp"

namespace lambdajet::tests {
namespace {

namespace schema = idl::schema;
constexpr double kKeptAhead_s = 2.0;
constexpr std::int64_t kStartAhead_ns = 300'000'000;

template <typename T>
T Must(absl::StatusOr<T> value) {
  if (!value.ok()) {
    std::cerr << value.status().ToString() << "\n";
    std::abort();
  }
  return std::move(*value);
}

TopicSpec MotionTopic(const std::string& name, const char* profile) {
  return {name, schema::k_lambdajet_main_motion_v1_state, profile};
}

}  // namespace

struct BusEar::Readers {
  CommonClock clock;
  mutable std::mutex mutex;
  std::unique_ptr<Participant> bus;
  DriveState drive;
  MainMotionState main_motion;
  std::int64_t drive_heard_ns = 0;
  std::vector<ProcessRecord> records;
  std::optional<Reader<idl::drive::v1::StatePubSubType>> drive_reader;
  std::optional<Reader<idl::main_motion::v1::StatePubSubType>> main_reader;
  std::optional<Reader<idl::main_motion::v1::ProcessRecordPubSubType>> record_reader;
};

BusEar::BusEar(int domain, const std::string& machine_id) : readers_(std::make_unique<Readers>()) {
  Readers& r = *readers_;
  BusOptions options;
  options.house = "test";
  options.partition = machine_id;
  options.domain = domain;
  options.profile_file = std::string(std::getenv("LAMBDAJET_SOURCE_DIR")) + "/deploy/dds/profiles.xml";
  r.bus = Must(Participant::Open(options, nullptr, nullptr));
  r.drive_reader.emplace(Must(Reader<idl::drive::v1::StatePubSubType>::Open(
      *r.bus, {idl::drive::v1::STATE_TOPIC, schema::k_lambdajet_drive_v1_state, "state"},
      [&r](const idl::drive::v1::State& s, const Arrival&) {
        const std::lock_guard lock(r.mutex);
        link::FromWire(s, r.drive);
        r.drive_heard_ns = r.clock.now_ns();
      })));
  r.main_reader.emplace(Must(Reader<idl::main_motion::v1::StatePubSubType>::Open(
      *r.bus, MotionTopic(idl::main_motion::v1::STATE_TOPIC, "state"),
      [this, &r](const idl::main_motion::v1::State& s, const Arrival&) {
        const std::lock_guard lock(r.mutex);
        if (link::FromWire(s, r.main_motion) && on_main_motion) {
          on_main_motion(r.main_motion);
        }
      })));
  r.record_reader.emplace(Must(Reader<idl::main_motion::v1::ProcessRecordPubSubType>::Open(
      *r.bus, MotionTopic(idl::main_motion::v1::PROCESS_RECORD_TOPIC, "setpoint"),
      [&r](const idl::main_motion::v1::ProcessRecord& heard, const Arrival&) {
        ProcessRecord record;
        const std::lock_guard lock(r.mutex);
        if (link::FromWire(heard, record)) {
          r.records.push_back(record);
        }
      })));
}

BusEar::~BusEar() = default;

Participant& BusEar::bus() { return *readers_->bus; }
DriveState BusEar::drive() const {
  const std::lock_guard lock(readers_->mutex);
  return readers_->drive;
}
MainMotionState BusEar::main_motion() const {
  const std::lock_guard lock(readers_->mutex);
  return readers_->main_motion;
}
std::int64_t BusEar::now_ns() const { return readers_->clock.now_ns(); }
std::int64_t BusEar::drive_heard_ns() const {
  const std::lock_guard lock(readers_->mutex);
  return readers_->drive_heard_ns;
}
std::vector<ProcessRecord> BusEar::records() const {
  const std::lock_guard lock(readers_->mutex);
  return readers_->records;
}

struct BusCell::Wires {
  std::uint64_t session = 0;
  std::uint64_t segments_sent = 0;
  std::uint64_t process_sent = 0;
  std::optional<Writer<idl::calibration::v1::MachineDescriptionPubSubType>> description;
  std::optional<Writer<idl::cell::v1::CommandPubSubType>> command;
  std::optional<Writer<idl::trajectory::v1::SegmentBatchPubSubType>> segment;
  std::optional<Writer<idl::trajectory::v1::ProcessBatchPubSubType>> process;
  std::vector<Measurement> measurements;
  std::vector<Switch> switches;
  std::size_t sheet_samples = 0;
  std::optional<Reader<idl::main_motion::v1::MeasurementPubSubType>> measurement_reader;
  std::optional<Reader<idl::plant::v1::JetTruthPubSubType>> jet_reader;
  std::optional<Reader<idl::plant::v1::DriveTruthPubSubType>> sheet_reader;
};

BusCell::BusCell(int domain, const MachineDescription& machine)
    : ear_(domain, machine.machine_id), machine_(machine), wires_(std::make_unique<Wires>()) {
  Wires& w = *wires_;
  Participant& bus = ear_.bus();
  w.session = static_cast<std::uint64_t>(now_ns());
  w.description.emplace(Must(Writer<idl::calibration::v1::MachineDescriptionPubSubType>::Open(
      bus, {idl::calibration::v1::MACHINE_DESCRIPTION_TOPIC,
            schema::k_lambdajet_calibration_v1_machine_description, "description"})));
  w.command.emplace(Must(Writer<idl::cell::v1::CommandPubSubType>::Open(
      bus, {idl::cell::v1::COMMAND_TOPIC, schema::k_lambdajet_cell_v1_command, "command"})));
  w.segment.emplace(Must(Writer<idl::trajectory::v1::SegmentBatchPubSubType>::Open(
      bus, {idl::trajectory::v1::SEGMENT_TOPIC, schema::k_lambdajet_trajectory_v1_plan, "setpoint"})));
  w.process.emplace(Must(Writer<idl::trajectory::v1::ProcessBatchPubSubType>::Open(
      bus, {idl::trajectory::v1::PROCESS_TOPIC, schema::k_lambdajet_trajectory_v1_plan, "setpoint"})));
  w.measurement_reader.emplace(Must(Reader<idl::main_motion::v1::MeasurementPubSubType>::Open(
      bus, MotionTopic(idl::main_motion::v1::MEASUREMENT_TOPIC, "setpoint"),
      [this](const idl::main_motion::v1::Measurement& m, const Arrival&) {
        Measurement measurement;
        const std::lock_guard lock(mutex_);
        if (link::FromWire(m, measurement)) {
          wires_->measurements.push_back(measurement);
        }
      })));
  w.jet_reader.emplace(Must(Reader<idl::plant::v1::JetTruthPubSubType>::Open(
      bus, {idl::plant::v1::JET_TRUTH_TOPIC, schema::k_lambdajet_plant_v1_truth, "setpoint"},
      [this](const idl::plant::v1::JetTruth& truth, const Arrival&) {
        const std::lock_guard lock(mutex_);
        for (std::size_t i = 0; i < truth.switch_count(); ++i) {
          wires_->switches.push_back({truth.switches()[i].time_ns(), truth.switches()[i].on()});
        }
      })));
  w.sheet_reader.emplace(Must(Reader<idl::plant::v1::DriveTruthPubSubType>::Open(
      bus, {idl::plant::v1::DRIVE_TRUTH_TOPIC, schema::k_lambdajet_plant_v1_truth, "setpoint"},
      [this](const idl::plant::v1::DriveTruth& truth, const Arrival&) {
        const std::lock_guard lock(mutex_);
        wires_->sheet_samples += truth.count();
      })));
}

BusCell::~BusCell() {
  stop_.store(true);
  if (streamer_.joinable()) {
    streamer_.join();
  }
}

void BusCell::PublishDescription() {
  idl::calibration::v1::MachineDescription wire;
  wire.header().session(wires_->session);
  wire.header().sequence_number(1);
  wire.header().time_ns(now_ns());
  wire.version(machine_.version);
  wire.hash(MachineHash(machine_).c_str());
  wire.as_designed_yaml(MachineText(machine_).c_str());
  for (Eigen::Index i = 0; i < machine_.parameters.size(); ++i) {
    wire.parameters()[static_cast<std::size_t>(i)] = machine_.parameters[i];
    for (Eigen::Index j = 0; j < machine_.parameters.size(); ++j) {
      wire.covariance()[static_cast<std::size_t>(i * machine_.parameters.size() + j)] =
          machine_.covariance(i, j);
    }
  }
  wires_->description->Write(wire);
}

void BusCell::Send(Verb verb, std::uint32_t target, double value, std::int64_t start_at_ns) {
  ModuleCommand command;
  command.header = {wires_->session, ++commands_, now_ns()};
  command.target = target;
  command.verb = verb;
  command.plan = plan_.id;
  command.segment_count = static_cast<std::uint32_t>(plan_.segments.size());
  command.gate_total = static_cast<std::uint32_t>(plan_.gates.size());
  command.event_total = static_cast<std::uint32_t>(plan_.events.size());
  command.duration_s = plan_.duration_s;
  command.elastic_lag_s2 = plan_.elastic_lag_s2;
  command.value = value;
  command.start_at_ns = start_at_ns;
  idl::cell::v1::Command wire;
  link::ToWire(command, wire);
  wires_->command->Write(wire);
}

bool BusCell::Obeyed(Verb verb, std::uint32_t target, double value, std::int64_t start_at_ns) {
  Send(verb, target, value, start_at_ns);
  const auto answered = [&](const CommandReceipt& receipt) {
    return receipt.session == wires_->session && receipt.sequence_number >= commands_;
  };
  const bool all = test::Eventually([&] {
    return ((target & kTargetDrive) == 0 || answered(drive().command)) &&
           ((target & kTargetMainMotion) == 0 || answered(main_motion().command));
  });
  const auto done = [&](std::uint32_t bit, const CommandReceipt& receipt) {
    if ((target & bit) != 0 && receipt.answer != CommandAnswer::kDone) {
      std::cerr << Name(verb) << " refused: " << Name(receipt.reason) << "\n";
      return false;
    }
    return true;
  };
  return all && done(kTargetDrive, drive().command) && done(kTargetMainMotion, main_motion().command);
}

bool BusCell::Begin(const Plan& plan) {
  constexpr std::uint32_t kBoth = kTargetDrive | kTargetMainMotion;
  const auto both = [this](ModuleMode mode) {
    return test::Eventually([&] { return drive().mode == mode && main_motion().mode == mode; });
  };
  plan_ = plan;
  if (drive().mode == ModuleMode::kSafe && !(Obeyed(Verb::kHome, kBoth) && both(ModuleMode::kReady))) {
    return false;
  }
  if (!Obeyed(Verb::kLoad, kBoth)) {
    return false;
  }
  if (!streamer_.joinable()) {
    streamer_ = std::thread([this] { Stream(); });
  }
  if (!test::Eventually([&] { return drive().plan == plan.id && drive().link.round_trip_s > 0.0; }) ||
      !Obeyed(Verb::kArm, kBoth) || !both(ModuleMode::kArmed)) {
    return false;
  }
  return Obeyed(Verb::kStart, kBoth, 0.0, now_ns() + kStartAhead_ns) && both(ModuleMode::kRunning);
}

void BusCell::Stream() {
  idl::trajectory::v1::SegmentBatch segment_wire;
  idl::trajectory::v1::ProcessBatch process_wire;
  while (!stop_.load()) {
    std::this_thread::sleep_for(std::chrono::milliseconds(4));
    const DriveState wish = drive();
    if (streaming_.load() && wish.plan == plan_.id && wish.buffered_s < kKeptAhead_s &&
        wish.next_segment < plan_.segments.size()) {
      SegmentBatch batch;
      batch.header = {wires_->session, ++wires_->segments_sent, now_ns()};
      FillBatch(plan_, {wish.next_segment, kSegmentsPerBatch}, batch);
      link::ToWire(batch, segment_wire);
      wires_->segment->Write(segment_wire);
    }
    const MainMotionState motion = main_motion();
    const bool all = motion.next_event >= plan_.events.size() && motion.next_gate > plan_.gates.size();
    if (streaming_.load() && motion.plan == plan_.id && !all) {
      ProcessBatch batch;
      batch.header = {wires_->session, ++wires_->process_sent, now_ns()};
      FillBatch(plan_,
                ProcessRange{{motion.next_gate, kEventsPerBatch}, {motion.next_event, kEventsPerBatch}},
                batch);
      link::ToWire(batch, process_wire);
      wires_->process->Write(process_wire);
    }
  }
}

std::vector<Measurement> BusCell::measurements() const {
  const std::lock_guard lock(mutex_);
  return wires_->measurements;
}
std::vector<BusCell::Switch> BusCell::switches() const {
  const std::lock_guard lock(mutex_);
  return wires_->switches;
}
std::size_t BusCell::sheet_samples() const {
  const std::lock_guard lock(mutex_);
  return wires_->sheet_samples;
}

}  // namespace lambdajet::tests
