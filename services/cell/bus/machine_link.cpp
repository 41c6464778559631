#include "cell/bus/machine_link.hpp"

#include <array>
#include <atomic>
#include <string>
#include <thread>
#include <utility>

#include "lambdajet/calibration/v1/machine_description.schema.hpp"
#include "lambdajet/calibration/v1/machine_descriptionPubSubTypes.h"
#include "lambdajet/cell/v1/command.schema.hpp"
#include "lambdajet/cell/v1/commandPubSubTypes.h"
#include "lambdajet/drive/v1/state.schema.hpp"
#include "lambdajet/drive/v1/statePubSubTypes.h"
#include "lambdajet/main_motion/v1/state.schema.hpp"
#include "lambdajet/main_motion/v1/statePubSubTypes.h"
#include "platform/bus/reader.hpp"
#include "platform/bus/sample_slots.hpp"
#include "platform/bus/writer.hpp"
#include "platform/process/common_clock.hpp"
#include "platform/process/periodic_loop.hpp"

namespace lambdajet::cell {
namespace {

namespace cell_idl = idl::cell::v1;
namespace drive_idl = idl::drive::v1;
namespace main_motion_idl = idl::main_motion::v1;
namespace calibration_idl = idl::calibration::v1;

constexpr std::int64_t kPeriod_ns = 20'000'000;
constexpr std::size_t kRecordsWaiting = 4096;
constexpr int kCyclesBetweenServiceLooks = 25;

// --- FromWire ----------------------------------------------------------------------------------------------------------

template <typename State>
void FillModule(const State& wire, std::int64_t heard_ns, ModuleView& view) {
  view.heard_ns = heard_ns;
  view.session = wire.header().session();
  view.mode = static_cast<ModuleMode>(wire.mode());
  view.reason = static_cast<ModuleReason>(wire.reason());
  view.plan = wire.plan();
  view.gate_passed = wire.gate_passed();
  view.echo = {wire.command_session(), wire.command_sequence_number(), wire.command_answer(),
               static_cast<ModuleReason>(wire.command_reason())};
  view.loop_overruns = wire.loop_overruns();
  view.clock_offset_s = wire.clock_offset_s();
}

DriveView FromWire(const drive_idl::State& wire, std::int64_t heard_ns) {
  DriveView view;
  FillModule(wire, heard_ns, view);
  view.referenced = wire.referenced();
  view.next_segment = wire.next_segment();
  view.buffered_s = wire.buffered_s();
  view.tau_s = wire.tau_s();
  view.s_mm = wire.s_mm();
  view.s_rate_mm_per_s = wire.s_rate_mm_per_s();
  view.gate_waiting = wire.gate_waiting();
  view.feed_override = wire.feed_override();
  for (std::size_t i = 0; i < kActuatorCount; ++i) {
    view.actuator_position_mm[i] = wire.actuator_position_mm()[i];
    view.actuator_velocity_mm_per_s[i] = wire.actuator_velocity_mm_per_s()[i];
  }
  return view;
}

MainMotionView FromWire(const main_motion_idl::State& wire, std::int64_t heard_ns) {
  MainMotionView view;
  FillModule(wire, heard_ns, view);
  view.next_event = wire.next_event();
  view.events_executed = wire.events_executed();
  view.next_gate = wire.next_gate();
  view.jet_on = wire.jet_on();
  view.s_mm = wire.s_extrapolated_mm();
  return view;
}

// --- ToWire ------------------------------------------------------------------------------------------------------------

cell_idl::Command ToWire(const CommandOut& command, std::uint64_t session, std::int64_t now_ns) {
  cell_idl::Command wire;
  wire.header().session(session);
  wire.header().sequence_number(command.sequence_number);
  wire.header().time_ns(now_ns);
  wire.target(command.targets);
  wire.verb(static_cast<std::uint32_t>(command.verb));
  wire.plan(command.plan.plan_id);
  wire.segment_count(command.plan.segment_count);
  wire.gate_total(command.plan.gate_count);
  wire.event_total(command.plan.event_count);
  wire.duration_s(command.plan.duration_s);
  wire.elastic_lag_s2(command.plan.elastic_lag_s2);
  wire.value(command.value);
  wire.start_at_ns(command.start_at_ns);
  return wire;
}

// Cuts at a whole UTF-8 character.
std::string Cut(std::string text, std::size_t most_bytes) {
  if (text.size() > most_bytes) {
    std::size_t end = most_bytes;
    while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0U) == 0x80U) {
      --end;
    }
    text.resize(end);
  }
  return text;
}

cell_idl::JobEvent ToWire(const JournalRecord& record, std::uint64_t session) {
  cell_idl::JobEvent wire;
  wire.header().session(session);
  wire.header().sequence_number(record.token);
  wire.header().time_ns(record.time_ns);
  wire.job(Cut(record.job.order.job_id, 64));
  wire.state(std::string(Name(record.job.progress.state)));
  wire.reason(Cut(record.job.progress.reason, 48));
  wire.text(Cut(record.job.progress.message, 240));
  return wire;
}

}  // namespace

class MachineLink::Inside {
 public:
  Inside(JobDesk& desk, const CommonClock& clock, std::uint64_t session, std::string machine_id)
      : desk_(desk), clock_(clock), session_(session), machine_id_(std::move(machine_id)) {}

  ~Inside() {
    stop_ = true;
    if (loop_.joinable()) {
      loop_.join();
    }
  }

  absl::Status Open(Participant& bus) {
    auto commands = Writer<cell_idl::CommandPubSubType>::Open(
        bus, {cell_idl::COMMAND_TOPIC, idl::schema::k_lambdajet_cell_v1_command, "command"});
    auto events = Writer<cell_idl::JobEventPubSubType>::Open(
        bus, {cell_idl::JOB_EVENT_TOPIC, idl::schema::k_lambdajet_cell_v1_command, "event"});
    if (!commands.ok() || !events.ok()) {
      return commands.ok() ? events.status() : commands.status();
    }
    commands_.emplace(std::move(*commands));
    events_.emplace(std::move(*events));
    return OpenReaders(bus);
  }

  void Begin() {
    loop_ = std::thread([this] {
      PeriodicLoop loop({.period_ns = kPeriod_ns});
      loop.Run(stop_, [this](const CycleTime& time) { Cycle(time.number); });
    });
  }

 private:
  absl::Status OpenReaders(Participant& bus) {
    auto drive = Reader<drive_idl::StatePubSubType>::Open(
        bus, {drive_idl::STATE_TOPIC, idl::schema::k_lambdajet_drive_v1_state, "state"},
        [this](const drive_idl::State& sample, const Arrival& arrival) {
          drive_state_.Put(sample, arrival);
        });
    auto main_motion = Reader<main_motion_idl::StatePubSubType>::Open(
        bus, {main_motion_idl::STATE_TOPIC, idl::schema::k_lambdajet_main_motion_v1_state, "state"},
        [this](const main_motion_idl::State& sample, const Arrival& arrival) {
          main_motion_state_.Put(sample, arrival);
        });
    auto records = Reader<main_motion_idl::ProcessRecordPubSubType>::Open(
        bus,
        {main_motion_idl::PROCESS_RECORD_TOPIC, idl::schema::k_lambdajet_main_motion_v1_state, "setpoint"},
        [this](const main_motion_idl::ProcessRecord& sample, const Arrival& arrival) {
          process_records_.Put(sample, arrival);
        });
    auto description = Reader<calibration_idl::MachineDescriptionPubSubType>::Open(
        bus,
        {calibration_idl::MACHINE_DESCRIPTION_TOPIC,
         idl::schema::k_lambdajet_calibration_v1_machine_description, "description"},
        [this](const calibration_idl::MachineDescription& sample, const Arrival& arrival) {
          description_.Put(sample, arrival);
        });
    for (const absl::Status& status :
         {drive.status(), main_motion.status(), records.status(), description.status()}) {
      if (!status.ok()) {
        return status;
      }
    }
    drive_.emplace(std::move(*drive));
    main_motion_.emplace(std::move(*main_motion));
    records_.emplace(std::move(*records));
    model_.emplace(std::move(*description));
    return absl::OkStatus();
  }

  void Cycle(std::uint64_t number) {
    Arrival arrival;
    if (drive_state_.TryTakeNew(drive_sample_, &arrival)) {
      desk_.Hear(FromWire(drive_sample_, clock_.FromMonotonic(arrival.monotonic_ns)));
    }
    if (main_motion_state_.TryTakeNew(main_motion_sample_, &arrival)) {
      desk_.Hear(FromWire(main_motion_sample_, clock_.FromMonotonic(arrival.monotonic_ns)));
    }
    for (main_motion_idl::ProcessRecord record; process_records_.TryTake(record);) {
      desk_.Hear(record.plan(), {record.s_wanted_mm(), record.s_rate_mm_per_s(), record.deviation_mm(),
                                 record.peer_age_s()});
    }
    if (calibration_idl::MachineDescription sample; description_.TryTakeNew(sample)) {
      desk_.HearModel({machine_id_, sample.version(), std::string(sample.hash().c_str())});
    }
    if (number % kCyclesBetweenServiceLooks == 0) {
      // Descriptions are told once and have no liveliness of their own: whoever is gone is no longer matched.
      const bool alive = model_->matched() > 0;
      desk_.HearService("calibration", alive, alive ? "" : "NOT_REACHED");
    }
    const JobDesk::Outgoing outgoing = desk_.Cycle();
    for (const CommandOut& command : outgoing.commands) {
      commands_->Write(ToWire(command, session_, clock_.now_ns()));
    }
    for (const JournalRecord& record : outgoing.records) {
      events_->Write(ToWire(record, session_));
    }
  }

  JobDesk& desk_;
  const CommonClock& clock_;
  const std::uint64_t session_;
  const std::string machine_id_;

  LatestSample<drive_idl::State> drive_state_;
  LatestSample<main_motion_idl::State> main_motion_state_;
  LatestSample<calibration_idl::MachineDescription> description_;
  SampleQueue<main_motion_idl::ProcessRecord> process_records_{kRecordsWaiting};
  drive_idl::State drive_sample_;
  main_motion_idl::State main_motion_sample_;

  std::optional<Writer<cell_idl::CommandPubSubType>> commands_;
  std::optional<Writer<cell_idl::JobEventPubSubType>> events_;
  std::optional<Reader<drive_idl::StatePubSubType>> drive_;
  std::optional<Reader<main_motion_idl::StatePubSubType>> main_motion_;
  std::optional<Reader<main_motion_idl::ProcessRecordPubSubType>> records_;
  std::optional<Reader<calibration_idl::MachineDescriptionPubSubType>> model_;

  std::atomic<bool> stop_ = false;
  std::thread loop_;
};

MachineLink::MachineLink(std::unique_ptr<Inside> inside) : inside_(std::move(inside)) {}
MachineLink::~MachineLink() = default;

absl::StatusOr<std::unique_ptr<MachineLink>> MachineLink::Open(Participant& bus, JobDesk& desk,
                                                               const CommonClock& clock,
                                                               std::uint64_t session,
                                                               const std::string& machine_id) {
  auto inside = std::make_unique<Inside>(desk, clock, session, machine_id);
  if (absl::Status status = inside->Open(bus); !status.ok()) {
    return status;
  }
  inside->Begin();
  return std::unique_ptr<MachineLink>(new MachineLink(std::move(inside)));
}

}  // namespace lambdajet::cell
