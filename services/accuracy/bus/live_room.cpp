#include "accuracy/bus/live_room.hpp"

#include <optional>
#include <thread>

#include "accuracy/core/live_error.hpp"
#include "foundation/motion/module_words.hpp"
#include "lambdajet/accuracy/v1/live.h"
#include "lambdajet/accuracy/v1/live.schema.hpp"
#include "lambdajet/accuracy/v1/livePubSubTypes.h"
#include "lambdajet/cell/v1/command.h"
#include "lambdajet/cell/v1/command.schema.hpp"
#include "lambdajet/cell/v1/commandPubSubTypes.h"
#include "lambdajet/drive/v1/state.h"
#include "lambdajet/drive/v1/state.schema.hpp"
#include "lambdajet/drive/v1/statePubSubTypes.h"
#include "lambdajet/main_motion/v1/state.h"
#include "lambdajet/main_motion/v1/state.schema.hpp"
#include "lambdajet/main_motion/v1/statePubSubTypes.h"
#include "platform/bus/participant.hpp"
#include "platform/bus/reader.hpp"
#include "platform/bus/sample_slots.hpp"
#include "platform/bus/writer.hpp"
#include "platform/process/common_clock.hpp"
#include "platform/process/periodic_loop.hpp"

namespace lambdajet::accuracy {
namespace {

namespace live_wire = lambdajet::idl::accuracy::v1;
namespace cell_wire = lambdajet::idl::cell::v1;
namespace drive_wire = lambdajet::idl::drive::v1;
namespace motion_wire = lambdajet::idl::main_motion::v1;

constexpr std::int64_t kPeriod_ns = 20'000'000;
constexpr std::int64_t kFresh_ns = 100'000'000;

DriveMotion FromWire(const drive_wire::State& state) {
  return {state.header().time_ns(),
          {state.actuator_position_mm()[0], state.actuator_position_mm()[1]},
          {state.actuator_velocity_mm_per_s()[0], state.actuator_velocity_mm_per_s()[1]},
          {state.following_error_mm()[0], state.following_error_mm()[1]}};
}

// The last plan that the cell has loaded: which, and whether it carries elastic feed-forward.
struct LoadedPlan {
  std::atomic<std::uint64_t> plan = 0;
  std::atomic<bool> compensated = false;

  void Take(const cell_wire::Command& command) {
    if (command.verb() == static_cast<std::uint32_t>(Verb::kLoad)) {
      plan.store(command.plan(), std::memory_order_relaxed);
      compensated.store(command.elastic_lag_s2() > 0.0, std::memory_order_relaxed);
    }
  }
};

}  // namespace

struct LiveRoom::Link {
  Link(const MachineReader& machine_reader, const Clock& common_clock)
      : machines(machine_reader), clock(common_clock) {}

  const MachineReader& machines;
  const Clock& clock;
  LatestSample<drive_wire::State> drive;
  std::atomic<double> event_deviation_mm = 0.0;
  LoadedPlan loaded;
  std::optional<Writer<live_wire::LivePubSubType>> writer;
  std::optional<Reader<drive_wire::StatePubSubType>> drive_reader;
  std::optional<Reader<motion_wire::ProcessRecordPubSubType>> record_reader;
  std::optional<Reader<cell_wire::CommandPubSubType>> command_reader;
  std::shared_ptr<const MachineDescription> machine;  // the loop's, with what it made of it
  std::optional<ErrorChain> chain;
  LiveEstimator estimator;
  live_wire::Live sample;
  std::thread loop;
};

LiveRoom::LiveRoom() = default;

LiveRoom::~LiveRoom() {
  stop_.store(true, std::memory_order_release);
  if (link_ != nullptr && link_->loop.joinable()) {
    link_->loop.join();
  }
}

absl::StatusOr<std::unique_ptr<LiveRoom>> LiveRoom::Open(Participant& bus, const MachineReader& machines,
                                                         const Clock& clock) {
  std::unique_ptr<LiveRoom> room(new LiveRoom());
  room->link_ = std::make_unique<Link>(machines, clock);
  Link* link = room->link_.get();
  auto writer = Writer<live_wire::LivePubSubType>::Open(
      bus, {live_wire::LIVE_TOPIC, idl::schema::k_lambdajet_accuracy_v1_live, "state"});
  auto drive = Reader<drive_wire::StatePubSubType>::Open(
      bus, {drive_wire::STATE_TOPIC, idl::schema::k_lambdajet_drive_v1_state, "state"},
      [link](const drive_wire::State& s, const Arrival& a) { link->drive.Put(s, a); });
  auto record = Reader<motion_wire::ProcessRecordPubSubType>::Open(
      bus, {motion_wire::PROCESS_RECORD_TOPIC, idl::schema::k_lambdajet_main_motion_v1_state, "command"},
      [link](const motion_wire::ProcessRecord& r, const Arrival&) {
        link->event_deviation_mm = r.deviation_mm();
      });
  auto command = Reader<cell_wire::CommandPubSubType>::Open(
      bus, {cell_wire::COMMAND_TOPIC, idl::schema::k_lambdajet_cell_v1_command, "command"},
      [link](const cell_wire::Command& c, const Arrival&) { link->loaded.Take(c); });
  for (const absl::Status& status : {writer.status(), drive.status(), record.status(), command.status()}) {
    if (!status.ok()) {
      return status;
    }
  }
  link->writer.emplace(std::move(*writer));
  link->drive_reader.emplace(std::move(*drive));
  link->record_reader.emplace(std::move(*record));
  link->command_reader.emplace(std::move(*command));
  const auto session = static_cast<std::uint64_t>(clock.now_ns());
  link->sample.header().session(session);
  link->loop = std::thread([self = room.get()] { self->Run(); });
  return room;
}

void LiveRoom::Run() {
  PeriodicLoop loop({.period_ns = kPeriod_ns});
  loop.Run(stop_, [this](const CycleTime&) { WriteOne(); });
}

void LiveRoom::WriteOne() {
  Link& link = *link_;
  const auto machine = link.machines.active();
  const auto drive = link.drive.Latest();
  if (machine == nullptr || !drive || MonotonicNow() - drive->second.monotonic_ns > kFresh_ns) {
    return;
  }
  if (machine != link.machine) {
    link.machine = machine;
    link.chain.emplace(*machine);
  }
  const drive_wire::State& state = drive->first;
  const bool compensated = link.loaded.plan == state.plan() && link.loaded.compensated;
  const LiveError live = link.estimator.Update(*link.chain, FromWire(state), compensated);
  if (!live.valid) {
    return;
  }
  live_wire::Live& sample = link.sample;
  sample.header().sequence_number(sample.header().sequence_number() + 1);
  sample.header().time_ns(link.clock.now_ns());
  sample.model_version(machine->version);
  sample.p_WJ_x_mm(live.p_WJ_mm.x());
  sample.p_WJ_y_mm(live.p_WJ_mm.y());
  sample.bound_95_mm(live.bound_95_mm);
  sample.base_mm(live.base_mm);
  sample.elastic_mm(live.elastic_mm);
  sample.process_mm(live.process_mm);
  sample.following_error_mm(live.following_error_mm);
  sample.event_deviation_mm(link.event_deviation_mm);
  if (link.writer->Write(sample)) {
    written_.fetch_add(1, std::memory_order_relaxed);
  }
}

}  // namespace lambdajet::accuracy
