#include "main_motion/bus/main_motion_node.hpp"

#include <atomic>
#include <cmath>
#include <string>
#include <thread>
#include <utility>

#include "lambdajet/cell/v1/command.schema.hpp"
#include "lambdajet/cell/v1/commandPubSubTypes.h"
#include "lambdajet/drive/v1/state.schema.hpp"
#include "lambdajet/drive/v1/statePubSubTypes.h"
#include "lambdajet/main_motion/v1/state.schema.hpp"
#include "lambdajet/main_motion/v1/statePubSubTypes.h"
#include "lambdajet/trajectory/v1/plan.schema.hpp"
#include "lambdajet/trajectory/v1/planPubSubTypes.h"
#include "link/bus/inbox.hpp"
#include "link/bus/module_desk.hpp"
#include "platform/bus/participant.hpp"
#include "platform/bus/writer.hpp"
#include "platform/process/common_clock.hpp"
#include "platform/process/periodic_loop.hpp"
#include "platform/telemetry/log.hpp"
#include "platform/telemetry/metrics.hpp"

namespace lambdajet::main_motion {
namespace {

namespace cell_wire = idl::cell::v1;
namespace drive_wire = idl::drive::v1;
namespace motion_wire = idl::main_motion::v1;
namespace trajectory_wire = idl::trajectory::v1;

constexpr std::uint32_t kSender = 2;
constexpr std::size_t kCommands = 16;
constexpr std::size_t kStates = 32;
constexpr std::size_t kBatches = 64;
constexpr int kShownEvery = 100;  // cycles between states handed to the metrics

}  // namespace

void NodeConfig::Declare(ConfigSchema& schema) {
  schema.Add("control.period_s", &core.period_s, {0.0005, 0.02}, "control period");
  schema.Add("control.output_horizon_s", &core.output_horizon_s, {0.002, 0.2},
             "outputs are handed to the time-stamped terminal this much ahead");
  schema.Add("control.fifo_priority", &fifo_priority, {0, 90},
             "SCHED_FIFO priority of the loop; 0 leaves it alone");
  schema.Add("control.cpu", &cpu, {-1, 1023}, "CPU the loop is pinned to; -1 any");
  schema.Add("control.lock_memory", &lock_memory, "mlockall");
  schema.Add("control.state_every", &state_every, {1, 20}, "control periods between two states on the bus");
  schema.Add("link.drive_deadline_s", &core.drive_deadline_s, {0.004, 1.0},
             "drive state may be this old while cutting; then jet and abrasive go off at once");
  schema.Add("process.pump_pressure_mpa", &core.pump_pressure_mpa, {10.0, 700.0}, "pressure to cut with");
  schema.Add("process.stand_off_mm", &core.stand_off_mm, {0.5, 20.0}, "tube to sheet");
  schema.Add("process.gate_timeout_s", &core.gate_timeout_s, {1.0, 600.0},
             "a gate that takes longer is a fault");
  schema.Add("process.camera_interval_s", &core.camera_interval_s, {0.004, 1.0},
             "between two tracking pictures");
  schema.Add("watch.overruns_allowed", &core.overruns_allowed, {0, 100},
             "late cycles in a hundred before a controlled stop");
}

class MainMotionNode::Inside {
 public:
  Inside(const NodeParts& parts, const NodeConfig& config, MainMotionHardware& hardware,
         std::function<void()> before_cycle, std::function<void(const MainMotionState&)> after_cycle,
         std::function<void()> running)
      : parts_(parts),
        config_(WithSession(config, parts.clock)),
        core_(config_.core, hardware),
        loop_({.period_ns = static_cast<std::int64_t>(1e9 * config.core.period_s),
               .fifo_priority = config.fifo_priority,
               .cpu = config.cpu,
               .lock_memory = config.lock_memory}),
        before_cycle_(std::move(before_cycle)),
        after_cycle_(std::move(after_cycle)),
        running_(std::move(running)),
        overruns_(
            parts.metrics.AddGauge("lambdajet_loop_overruns", "Control cycles that began late since start.")),
        peer_age_(
            parts.metrics.AddGauge("lambdajet_link_peer_age_seconds", "Age of the newest drive state.")),
        pressure_(parts.metrics.AddGauge("lambdajet_pump_pressure_pascals", "Pump pressure.")),
        deviation_(
            parts.metrics.AddHistogram("lambdajet_process_event_deviation_meters",
                                       "How far from its place on the path a process event took effect.",
                                       {1e-6, 2e-6, 5e-6, 1e-5, 2e-5, 5e-5, 1e-4, 2e-4, 5e-4, 1e-3})),
        mode_(parts.metrics.AddGauge("lambdajet_module_mode", "ModuleMode, as on the bus.")),
        offset_(parts.metrics.AddGauge("lambdajet_link_clock_offset_seconds", "Peer's clock minus own.")),
        dropped_(parts.metrics.AddGauge("lambdajet_link_dropped_samples",
                                        "Old, repeated or out-of-order samples.")),
        wake_(parts.metrics.AddGauge("lambdajet_loop_worst_wake_seconds",
                                     "Worst wake-up latency of the loop.")) {}

  ~Inside() {
    stop_.store(true, std::memory_order_release);
    if (thread_.joinable()) {
      thread_.join();
    }
  }

  absl::Status Open() {
    auto desk = link::ModuleDesk::Open(parts_.bus, parts_.clock, parts_.log, kSender, config_.core.session);
    const std::string schema = idl::schema::k_lambdajet_main_motion_v1_state;
    auto state =
        Writer<motion_wire::StatePubSubType>::Open(parts_.bus, {motion_wire::STATE_TOPIC, schema, "state"});
    auto measurements = Writer<motion_wire::MeasurementPubSubType>::Open(
        parts_.bus, {motion_wire::MEASUREMENT_TOPIC, schema, "setpoint"});
    auto records = Writer<motion_wire::ProcessRecordPubSubType>::Open(
        parts_.bus, {motion_wire::PROCESS_RECORD_TOPIC, schema, "setpoint"});
    auto commands = decltype(commands_)::element_type::Open(
        parts_.bus, {cell_wire::COMMAND_TOPIC, idl::schema::k_lambdajet_cell_v1_command, "command"},
        kCommands);
    auto peer = decltype(peer_)::element_type::Open(
        parts_.bus, {drive_wire::STATE_TOPIC, idl::schema::k_lambdajet_drive_v1_state, "state"}, kStates);
    auto segments = decltype(segments_)::element_type::Open(
        parts_.bus, {trajectory_wire::SEGMENT_TOPIC, idl::schema::k_lambdajet_trajectory_v1_plan, "setpoint"},
        kBatches);
    auto process = decltype(process_)::element_type::Open(
        parts_.bus, {trajectory_wire::PROCESS_TOPIC, idl::schema::k_lambdajet_trajectory_v1_plan, "setpoint"},
        kBatches);
    for (const absl::Status& status :
         {desk.status(), state.status(), measurements.status(), records.status(), commands.status(),
          peer.status(), segments.status(), process.status()}) {
      if (!status.ok()) {
        return status;
      }
    }
    desk_ = std::move(*desk);
    state_.emplace(std::move(*state));
    measurements_.emplace(std::move(*measurements));
    records_.emplace(std::move(*records));
    commands_ = std::move(*commands);
    peer_ = std::move(*peer);
    segments_ = std::move(*segments);
    process_ = std::move(*process);
    thread_ = std::thread([this] { Run(); });
    return absl::OkStatus();
  }

  void UpdateMetrics() {
    MainMotionState state;
    if (shown_.TryTakeNew(state)) {
      overruns_.Set(state.loop_overruns);
      peer_age_.Set(state.peer_age_s);
      pressure_.Set(1e6 * state.pump_pressure_mpa);
      mode_.Set(static_cast<double>(state.mode));
      offset_.Set(state.link.clock_offset_s);
      dropped_.Set(state.dropped_samples);
    }
    wake_.Set(1e-9 * static_cast<double>(loop_.worst_wake_latency_ns()));
  }

 private:
  static NodeConfig WithSession(NodeConfig config, const CommonClock& clock) {
    config.core.session = link::NewSession(clock);
    return config;
  }

  void Run() {
    const RealTimeGrant grant = loop_.EnterRealTime();
    if (!grant.refused.empty()) {
      parts_.log.Warning("real_time_refused", grant.refused);
    }
    loop_.Run(stop_, [this](const CycleTime& time) { Cycle(time); });
  }

  void Cycle(const CycleTime& time) {
    if (const MachineDescription* machine = desk_->TakeDescription()) {
      core_.AdoptMachine(*machine);
    }
    before_cycle_();
    core_.Step(parts_.clock.FromMonotonic(time.woke_ns), {.commands = commands_->Drain(),
                                                          .peer = peer_->Drain(),
                                                          .process = process_->Drain(),
                                                          .segments = segments_->Drain(),
                                                          .link = desk_->figures()});
    if (++cycle_ % static_cast<std::uint64_t>(config_.state_every) == 0) {
      link::ToWire(core_.state(), wire_);
      state_->Write(wire_);
    }
    while (const std::optional<ModeChange> change = core_.TakeModeChange()) {
      desk_->Tell(*change);
    }
    PublishResults();
    after_cycle_(core_.state());
    if (cycle_ % kShownEvery == 0) {
      shown_.Put(core_.state(), {});
    }
    if (cycle_ == kShownEvery) {
      running_();
    }
  }

  // A full history (nobody acknowledges) loses results; the job's report shows how many there were.
  void PublishResults() {
    while (const std::optional<Measurement> measurement = core_.TakeMeasurement()) {
      link::ToWire(*measurement, measurement_wire_);
      measurements_->Write(measurement_wire_);
    }
    while (const std::optional<ProcessRecord> record = core_.TakeProcessRecord()) {
      link::ToWire(*record, record_wire_);
      records_->Write(record_wire_);
      deviation_.Observe(1e-3 * std::abs(record->deviation_mm));
    }
  }

  NodeParts parts_;
  NodeConfig config_;
  MainMotionCore core_;
  PeriodicLoop loop_;
  std::function<void()> before_cycle_;
  std::function<void(const MainMotionState&)> after_cycle_;
  std::function<void()> running_;
  Gauge overruns_, peer_age_, pressure_;
  Histogram deviation_;
  Gauge mode_, offset_, dropped_, wake_;
  std::uint64_t cycle_ = 0;
  motion_wire::State wire_;
  motion_wire::Measurement measurement_wire_;
  motion_wire::ProcessRecord record_wire_;
  LatestSample<MainMotionState> shown_;
  std::atomic<bool> stop_ = false;
  std::unique_ptr<link::ModuleDesk> desk_;
  std::optional<Writer<motion_wire::StatePubSubType>> state_;
  std::optional<Writer<motion_wire::MeasurementPubSubType>> measurements_;
  std::optional<Writer<motion_wire::ProcessRecordPubSubType>> records_;
  std::unique_ptr<link::Inbox<ModuleCommand, cell_wire::CommandPubSubType>> commands_;
  std::unique_ptr<link::Inbox<DriveState, drive_wire::StatePubSubType>> peer_;
  std::unique_ptr<link::Inbox<SegmentBatch, trajectory_wire::SegmentBatchPubSubType>> segments_;
  std::unique_ptr<link::Inbox<ProcessBatch, trajectory_wire::ProcessBatchPubSubType>> process_;
  std::thread thread_;
};

MainMotionNode::MainMotionNode() = default;
MainMotionNode::~MainMotionNode() = default;

absl::StatusOr<std::unique_ptr<MainMotionNode>> MainMotionNode::Open(
    const NodeParts& parts, const NodeConfig& config, MainMotionHardware& hardware,
    std::function<void()> before_cycle, std::function<void(const MainMotionState&)> after_cycle,
    std::function<void()> running) {
  std::unique_ptr<MainMotionNode> node(new MainMotionNode());
  node->inside_ = std::make_unique<Inside>(parts, config, hardware, std::move(before_cycle),
                                           std::move(after_cycle), std::move(running));
  if (absl::Status status = node->inside_->Open(); !status.ok()) {
    return status;
  }
  return node;
}

void MainMotionNode::UpdateMetrics() { inside_->UpdateMetrics(); }

}  // namespace lambdajet::main_motion
