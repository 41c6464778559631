#include "drive/bus/drive_node.hpp"

#include <atomic>
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

namespace lambdajet::drive {
namespace {

namespace cell_wire = idl::cell::v1;
namespace drive_wire = idl::drive::v1;
namespace motion_wire = idl::main_motion::v1;
namespace trajectory_wire = idl::trajectory::v1;

constexpr std::uint32_t kSender = 1;
constexpr std::size_t kCommands = 16;
constexpr std::size_t kStates = 32;
constexpr std::size_t kBatches = 64;
constexpr int kShownEvery = 100;  // cycles between states handed to the metrics

}  // namespace

void NodeConfig::Declare(ConfigSchema& schema) {
  schema.Add("control.period_s", &core.period_s, {0.0005, 0.02}, "control period");
  schema.Add("control.setpoint_lead_s", &core.setpoint_lead_s, {0.004, 0.2},
             "how far ahead set-points go to the servo");
  schema.Add("control.fifo_priority", &fifo_priority, {0, 90},
             "SCHED_FIFO priority of the loop; 0 leaves it alone");
  schema.Add("control.cpu", &cpu, {-1, 1023}, "CPU the loop is pinned to; -1 any");
  schema.Add("control.lock_memory", &lock_memory, "mlockall");
  schema.Add("control.state_every", &state_every, {1, 10}, "control periods between two states on the bus");
  schema.Add("link.peer_deadline_s", &core.peer_deadline_s, {0.005, 1.0},
             "main-motion state may be this old while cutting; then the drive holds on the path");
  schema.Add("link.peer_patience_s", &core.peer_patience_s, {0.1, 60.0}, "then the hold becomes a stop");
  schema.Add("link.clock_offset_limit_s", &core.clock_offset_limit_s, {1e-6, 0.1}, "no cut starts beyond it");
  schema.Add("link.hold_on_clock_offset", &core.hold_on_clock_offset,
             "a running cut is held beyond it; else finished");
  schema.Add("play.starvation_reserve_s", &core.starvation_reserve_s, {0.01, 1.0},
             "program time kept beyond the stopping distance");
  schema.Add("play.refill_s", &core.refill_s, {0.1, 3.0}, "program time that ends a starvation hold");
  schema.Add("play.resume_overlap_mm", &core.resume_overlap_mm, {0.0, 50.0},
             "a cut that was held is taken up this much earlier");
  schema.Add("watch.following_error_limit_mm", &core.following_error_limit_mm, {0.01, 10.0},
             "trip, each actuator");
  schema.Add("watch.overruns_allowed", &core.overruns_allowed, {0, 100},
             "late cycles in a hundred before a controlled stop");
}

class DriveNode::Inside {
 public:
  Inside(const NodeParts& parts, const NodeConfig& config, DriveHardware& hardware,
         std::function<void(const DriveState&)> after_cycle, std::function<void()> running)
      : parts_(parts),
        config_(WithSession(config, parts.clock)),
        core_(config_.core, hardware),
        loop_({.period_ns = static_cast<std::int64_t>(1e9 * config.core.period_s),
               .fifo_priority = config.fifo_priority,
               .cpu = config.cpu,
               .lock_memory = config.lock_memory}),
        after_cycle_(std::move(after_cycle)),
        running_(std::move(running)),
        overruns_(
            parts.metrics.AddGauge("lambdajet_loop_overruns", "Control cycles that began late since start.")),
        late_setpoints_(parts.metrics.AddGauge("lambdajet_setpoints_late",
                                               "Set-points dropped because their time had passed.")),
        buffered_(parts.metrics.AddGauge("lambdajet_path_buffered_seconds",
                                         "Program time in the buffer ahead of the path clock.")),
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
    auto state = Writer<drive_wire::StatePubSubType>::Open(
        parts_.bus, {drive_wire::STATE_TOPIC, idl::schema::k_lambdajet_drive_v1_state, "state"});
    auto commands = decltype(commands_)::element_type::Open(
        parts_.bus, {cell_wire::COMMAND_TOPIC, idl::schema::k_lambdajet_cell_v1_command, "command"},
        kCommands);
    auto peer = decltype(peer_)::element_type::Open(
        parts_.bus, {motion_wire::STATE_TOPIC, idl::schema::k_lambdajet_main_motion_v1_state, "state"},
        kStates);
    auto segments = decltype(segments_)::element_type::Open(
        parts_.bus, {trajectory_wire::SEGMENT_TOPIC, idl::schema::k_lambdajet_trajectory_v1_plan, "setpoint"},
        kBatches);
    auto process = decltype(process_)::element_type::Open(
        parts_.bus, {trajectory_wire::PROCESS_TOPIC, idl::schema::k_lambdajet_trajectory_v1_plan, "setpoint"},
        kBatches);
    for (const absl::Status& status : {desk.status(), state.status(), commands.status(), peer.status(),
                                       segments.status(), process.status()}) {
      if (!status.ok()) {
        return status;
      }
    }
    desk_ = std::move(*desk);
    state_.emplace(std::move(*state));
    commands_ = std::move(*commands);
    peer_ = std::move(*peer);
    segments_ = std::move(*segments);
    process_ = std::move(*process);
    thread_ = std::thread([this] { Run(); });
    return absl::OkStatus();
  }

  void UpdateMetrics() {
    DriveState state;
    if (shown_.TryTakeNew(state)) {
      overruns_.Set(state.loop_overruns);
      buffered_.Set(state.buffered_s);
      mode_.Set(static_cast<double>(state.mode));
      offset_.Set(state.link.clock_offset_s);
      dropped_.Set(state.dropped_samples);
    }
    late_setpoints_.Set(static_cast<double>(late_.load(std::memory_order_relaxed)));
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
    core_.Step(parts_.clock.FromMonotonic(time.woke_ns), {.commands = commands_->Drain(),
                                                          .peer = peer_->Drain(),
                                                          .segments = segments_->Drain(),
                                                          .process = process_->Drain(),
                                                          .link = desk_->figures()});
    if (++cycle_ % static_cast<std::uint64_t>(config_.state_every) == 0) {
      link::ToWire(core_.state(), wire_);
      state_->Write(wire_);
    }
    while (const std::optional<ModeChange> change = core_.TakeModeChange()) {
      desk_->Tell(*change);
    }
    after_cycle_(core_.state());
    if (cycle_ % kShownEvery == 0) {
      shown_.Put(core_.state(), {});
      late_.store(core_.setpoints_late(), std::memory_order_relaxed);
    }
    if (cycle_ == kShownEvery) {
      running_();
    }
  }

  NodeParts parts_;
  NodeConfig config_;
  DriveCore core_;
  PeriodicLoop loop_;
  std::function<void(const DriveState&)> after_cycle_;
  std::function<void()> running_;
  Gauge overruns_, late_setpoints_, buffered_, mode_, offset_, dropped_, wake_;
  std::uint64_t cycle_ = 0;
  drive_wire::State wire_;
  LatestSample<DriveState> shown_;
  std::atomic<std::uint32_t> late_ = 0;
  std::atomic<bool> stop_ = false;
  std::unique_ptr<link::ModuleDesk> desk_;
  std::optional<Writer<drive_wire::StatePubSubType>> state_;
  std::unique_ptr<link::Inbox<ModuleCommand, cell_wire::CommandPubSubType>> commands_;
  std::unique_ptr<link::Inbox<MainMotionState, motion_wire::StatePubSubType>> peer_;
  std::unique_ptr<link::Inbox<SegmentBatch, trajectory_wire::SegmentBatchPubSubType>> segments_;
  std::unique_ptr<link::Inbox<ProcessBatch, trajectory_wire::ProcessBatchPubSubType>> process_;
  std::thread thread_;
};

DriveNode::DriveNode() = default;
DriveNode::~DriveNode() = default;

absl::StatusOr<std::unique_ptr<DriveNode>> DriveNode::Open(const NodeParts& parts, const NodeConfig& config,
                                                           DriveHardware& hardware,
                                                           std::function<void(const DriveState&)> after_cycle,
                                                           std::function<void()> running) {
  std::unique_ptr<DriveNode> node(new DriveNode());
  node->inside_ =
      std::make_unique<Inside>(parts, config, hardware, std::move(after_cycle), std::move(running));
  if (absl::Status status = node->inside_->Open(); !status.ok()) {
    return status;
  }
  return node;
}

void DriveNode::UpdateMetrics() { inside_->UpdateMetrics(); }

}  // namespace lambdajet::drive
