// Runs a module's core on the bus: one cyclic loop, everything else hands over.
//
// Model: each cycle drains the inboxes, steps the core, publishes the module's state every `state_every` cycles, gives the
// desk what changed mode, and calls the hooks in the order they stand in. The loop asks the host for SCHED_FIFO and a CPU.
// Module names the two sides: Core, Config, Hardware, Inputs, State, StatePubSubType, PeerState, PeerPubSubType, kSender,
// StateTopic(), PeerTopic(). Threads: construction, Open(), UpdateMetrics() and destruction in main; the loop is a thread of
// its own. Errors: those of platform/bus.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include "lambdajet/cell/v1/command.schema.hpp"
#include "lambdajet/cell/v1/commandPubSubTypes.h"
#include "lambdajet/trajectory/v1/plan.schema.hpp"
#include "lambdajet/trajectory/v1/planPubSubTypes.h"
#include "link/bus/inbox.hpp"
#include "link/bus/module_desk.hpp"
#include "link/bus/node_config.hpp"
#include "platform/bus/writer.hpp"
#include "platform/process/common_clock.hpp"
#include "platform/process/periodic_loop.hpp"
#include "platform/telemetry/log.hpp"
#include "platform/telemetry/metrics.hpp"

namespace lambdajet::link {

// What a node does round each step of its core, all in the loop but `running`'s effect. Each may be empty.
template <typename State>
struct LoopHooks {
  std::function<void()> before_step;
  std::function<void()> after_step;               // what the module publishes besides its state
  std::function<void(const State&)> after_cycle;  // a simulated plant tells its truth then
  std::function<void()> running;                  // once, when the loop runs well
};

template <typename Module>
class ModuleFrame {
 public:
  using State = typename Module::State;

  ModuleFrame(const NodeParts& parts, const typename Module::Config& config, const LoopConfig& loop,
              typename Module::Hardware& hardware, LoopHooks<State> hooks)
      : parts_(parts),
        state_every_(static_cast<std::uint64_t>(loop.state_every)),
        session_(NewSession(parts.clock)),
        loop_({.period_ns = static_cast<std::int64_t>(1e9 * config.period_s),
               .fifo_priority = loop.fifo_priority,
               .cpu = loop.cpu,
               .lock_memory = loop.lock_memory}),
        core_(WithSession(config, session_), hardware),
        hooks_(std::move(hooks)),
        overruns_(Shown("lambdajet_loop_overruns", "Control cycles that began late since start.")),
        mode_(Shown("lambdajet_module_mode", "ModuleMode, as on the bus.")),
        offset_(Shown("lambdajet_link_clock_offset_seconds", "Peer's clock minus own.")),
        dropped_(Shown("lambdajet_link_dropped_samples", "Old, repeated or out-of-order samples.")),
        wake_(Shown("lambdajet_loop_worst_wake_seconds", "Worst wake-up latency of the loop.")) {}

  ~ModuleFrame() {
    stop_.store(true, std::memory_order_release);
    if (thread_.joinable()) {
      thread_.join();
    }
  }
  ModuleFrame(const ModuleFrame&) = delete;
  ModuleFrame& operator=(const ModuleFrame&) = delete;

  // Starts the loop.
  absl::Status Open() {
    constexpr std::size_t kCommands = 16;
    constexpr std::size_t kStates = 32;
    constexpr std::size_t kBatches = 64;
    auto desk = ModuleDesk::Open(parts_.bus, parts_.clock, parts_.log, Module::kSender, session_);
    auto state = Writer<typename Module::StatePubSubType>::Open(parts_.bus, Module::StateTopic());
    auto commands = Commands::Open(
        parts_.bus, {idl::cell::v1::COMMAND_TOPIC, idl::schema::k_lambdajet_cell_v1_command, "command"},
        kCommands);
    auto peer = Peers::Open(parts_.bus, Module::PeerTopic(), kStates);
    auto segments = Segments::Open(parts_.bus, PlanTopic(idl::trajectory::v1::SEGMENT_TOPIC), kBatches);
    auto process = Processes::Open(parts_.bus, PlanTopic(idl::trajectory::v1::PROCESS_TOPIC), kBatches);
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

  typename Module::Core& core() { return core_; }  // in the hooks

  // Brings what the loop has last shown to the metrics, and gives it to the node for its own; nothing if there is no news.
  std::optional<State> UpdateMetrics() {
    wake_.Set(1e-9 * static_cast<double>(loop_.worst_wake_latency_ns()));
    State state;
    if (!shown_.TryTakeNew(state)) {
      return std::nullopt;
    }
    overruns_.Set(state.loop_overruns);
    mode_.Set(static_cast<double>(state.mode));
    offset_.Set(state.link.clock_offset_s);
    dropped_.Set(state.dropped_samples);
    return state;
  }

 private:
  using Commands = Inbox<ModuleCommand, idl::cell::v1::CommandPubSubType>;
  using Peers = Inbox<typename Module::PeerState, typename Module::PeerPubSubType>;
  using Segments = Inbox<SegmentBatch, idl::trajectory::v1::SegmentBatchPubSubType>;
  using Processes = Inbox<ProcessBatch, idl::trajectory::v1::ProcessBatchPubSubType>;
  static constexpr std::uint64_t kShownEvery = 100;  // cycles between states handed to the metrics

  static typename Module::Config WithSession(typename Module::Config config, std::uint64_t session) {
    config.session = session;
    return config;
  }
  static TopicSpec PlanTopic(const std::string& name) {
    return {name, idl::schema::k_lambdajet_trajectory_v1_plan, "setpoint"};
  }
  Gauge Shown(const char* name, const char* help) { return parts_.metrics.AddGauge(name, help); }

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
    Call(hooks_.before_step);
    core_.Step(parts_.clock.FromMonotonic(time.woke_ns), {.commands = commands_->Drain(),
                                                          .peer = peer_->Drain(),
                                                          .segments = segments_->Drain(),
                                                          .process = process_->Drain(),
                                                          .link = desk_->figures()});
    if (++cycle_ % state_every_ == 0) {
      ToWire(core_.state(), wire_);
      state_->Write(wire_);
    }
    while (const std::optional<ModeChange> change = core_.TakeModeChange()) {
      desk_->Tell(*change);
    }
    Call(hooks_.after_step);
    Call(hooks_.after_cycle, core_.state());
    if (cycle_ % kShownEvery == 0) {
      shown_.Put(core_.state(), {});
    }
    if (cycle_ == kShownEvery) {
      Call(hooks_.running);
    }
  }

  template <typename Hook, typename... Arguments>
  static void Call(const Hook& hook, const Arguments&... arguments) {
    if (hook) {
      hook(arguments...);
    }
  }

  NodeParts parts_;
  std::uint64_t state_every_;
  std::uint64_t session_;
  PeriodicLoop loop_;
  typename Module::Core core_;
  LoopHooks<State> hooks_;
  Gauge overruns_, mode_, offset_, dropped_, wake_;
  std::uint64_t cycle_ = 0;
  typename Module::StatePubSubType::type wire_;
  LatestSample<State> shown_;
  std::atomic<bool> stop_ = false;
  std::unique_ptr<ModuleDesk> desk_;
  std::optional<Writer<typename Module::StatePubSubType>> state_;
  std::unique_ptr<Commands> commands_;
  std::unique_ptr<Peers> peer_;
  std::unique_ptr<Segments> segments_;
  std::unique_ptr<Processes> process_;
  std::thread thread_;
};

}  // namespace lambdajet::link
