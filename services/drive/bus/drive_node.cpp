#include "drive/bus/drive_node.hpp"

#include <atomic>
#include <optional>
#include <utility>

#include "lambdajet/drive/v1/state.schema.hpp"
#include "lambdajet/drive/v1/statePubSubTypes.h"
#include "lambdajet/main_motion/v1/state.schema.hpp"
#include "lambdajet/main_motion/v1/statePubSubTypes.h"
#include "link/bus/module_frame.hpp"

namespace lambdajet::drive {
namespace {

struct DriveModule {
  using Core = DriveCore;
  using Config = DriveConfig;
  using Hardware = DriveHardware;
  using State = DriveState;
  using StatePubSubType = idl::drive::v1::StatePubSubType;
  using PeerState = MainMotionState;
  using PeerPubSubType = idl::main_motion::v1::StatePubSubType;
  static constexpr std::uint32_t kSender = 1;
  static TopicSpec StateTopic() {
    return {idl::drive::v1::STATE_TOPIC, idl::schema::k_lambdajet_drive_v1_state, "state"};
  }
  static TopicSpec PeerTopic() {
    return {idl::main_motion::v1::STATE_TOPIC, idl::schema::k_lambdajet_main_motion_v1_state, "state"};
  }
};

}  // namespace

void NodeConfig::Declare(ConfigSchema& schema) {
  loop.Declare(schema, &core.period_s, &core.overruns_allowed);
  schema.Add("control.setpoint_lead_s", &core.setpoint_lead_s, {0.004, 0.2},
             "how far ahead set-points go to the servo");
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
}

class DriveNode::Inside {
 public:
  Inside(const link::NodeParts& parts, const NodeConfig& config, DriveHardware& hardware,
         std::function<void(const DriveState&)> after_cycle, std::function<void()> running)
      : late_setpoints_(parts.metrics.AddGauge("lambdajet_setpoints_late",
                                               "Set-points dropped because their time had passed.")),
        buffered_(parts.metrics.AddGauge("lambdajet_path_buffered_seconds",
                                         "Program time in the buffer ahead of the path clock.")),
        frame_(
            parts, config.core, config.loop, hardware,
            {.before_step = {},
             .after_step = [this] { late_.store(frame_.core().setpoints_late(), std::memory_order_relaxed); },
             .after_cycle = std::move(after_cycle),
             .running = std::move(running)}) {}

  absl::Status Open() { return frame_.Open(); }

  void UpdateMetrics() {
    if (const std::optional<DriveState> state = frame_.UpdateMetrics()) {
      buffered_.Set(state->buffered_s);
    }
    late_setpoints_.Set(static_cast<double>(late_.load(std::memory_order_relaxed)));
  }

 private:
  Gauge late_setpoints_, buffered_;
  std::atomic<std::uint32_t> late_ = 0;
  link::ModuleFrame<DriveModule> frame_;  // last: its loop uses the others
};

DriveNode::DriveNode() = default;
DriveNode::~DriveNode() = default;

absl::StatusOr<std::unique_ptr<DriveNode>> DriveNode::Open(const link::NodeParts& parts,
                                                           const NodeConfig& config, DriveHardware& hardware,
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
