#include "main_motion/bus/main_motion_node.hpp"

#include <atomic>
#include <chrono>
#include <cmath>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <variant>

#include "lambdajet/drive/v1/state.schema.hpp"
#include "lambdajet/drive/v1/statePubSubTypes.h"
#include "lambdajet/main_motion/v1/state.schema.hpp"
#include "lambdajet/main_motion/v1/statePubSubTypes.h"
#include "link/bus/module_frame.hpp"
#include "platform/bus/sample_slots.hpp"

namespace lambdajet::main_motion {
namespace {

namespace motion_wire = idl::main_motion::v1;

TopicSpec OwnTopic(const std::string& name, const char* profile) {
  return {name, idl::schema::k_lambdajet_main_motion_v1_state, profile};
}

struct MainMotionModule {
  using Core = MainMotionCore;
  using Config = MainMotionConfig;
  using Hardware = MainMotionHardware;
  using State = MainMotionState;
  using StatePubSubType = motion_wire::StatePubSubType;
  using PeerState = DriveState;
  using PeerPubSubType = idl::drive::v1::StatePubSubType;
  static constexpr std::uint32_t kSender = 2;
  static TopicSpec StateTopic() { return OwnTopic(motion_wire::STATE_TOPIC, "state"); }
  static TopicSpec PeerTopic() {
    return {idl::drive::v1::STATE_TOPIC, idl::schema::k_lambdajet_drive_v1_state, "state"};
  }
};

using Result = std::variant<Measurement, ProcessRecord>;
constexpr std::size_t kResults = 512;

// Publishes what the loop has found out, in a thread of its own: a reliable write copies its functors on the heap inside Fast
// DDS, whatever the profile says. A full history (nobody acknowledges) or queue loses results; the job's report shows how
// many there were.
class ResultsOut {
 public:
  explicit ResultsOut(Histogram deviation) : deviation_(std::move(deviation)) {}
  ~ResultsOut() {
    stop_.store(true, std::memory_order_release);
    if (thread_.joinable()) {
      thread_.join();
    }
  }
  ResultsOut(const ResultsOut&) = delete;
  ResultsOut& operator=(const ResultsOut&) = delete;

  absl::Status Open(Participant& bus) {
    auto measurements = Writer<motion_wire::MeasurementPubSubType>::Open(
        bus, OwnTopic(motion_wire::MEASUREMENT_TOPIC, "setpoint"));
    auto records = Writer<motion_wire::ProcessRecordPubSubType>::Open(
        bus, OwnTopic(motion_wire::PROCESS_RECORD_TOPIC, "setpoint"));
    for (const absl::Status& status : {measurements.status(), records.status()}) {
      if (!status.ok()) {
        return status;
      }
    }
    measurements_.emplace(std::move(*measurements));
    records_.emplace(std::move(*records));
    thread_ = std::thread([this] { Run(); });
    return absl::OkStatus();
  }

  void Put(const Result& result) { results_.Put(result, {}); }  // from the loop

 private:
  void Run() {
    Result result;
    while (!stop_.load(std::memory_order_acquire)) {
      if (results_.TakeWithin(std::chrono::milliseconds(20), result)) {
        std::visit([this](const auto& one) { Publish(one); }, result);
      }
    }
  }
  void Publish(const Measurement& measurement) {
    link::ToWire(measurement, measurement_wire_);
    measurements_->Write(measurement_wire_);
  }
  void Publish(const ProcessRecord& record) {
    link::ToWire(record, record_wire_);
    records_->Write(record_wire_);
    deviation_.Observe(1e-3 * std::abs(record.deviation_mm));
  }

  Histogram deviation_;
  SampleQueue<Result> results_{kResults};
  motion_wire::Measurement measurement_wire_;
  motion_wire::ProcessRecord record_wire_;
  std::optional<Writer<motion_wire::MeasurementPubSubType>> measurements_;
  std::optional<Writer<motion_wire::ProcessRecordPubSubType>> records_;
  std::atomic<bool> stop_ = false;
  std::thread thread_;
};

}  // namespace

void NodeConfig::Declare(ConfigSchema& schema) {
  loop.Declare(schema, &core.period_s, &core.overruns_allowed);
  schema.Add("control.output_horizon_s", &core.output_horizon_s, {0.002, 0.2},
             "outputs are handed to the time-stamped terminal this much ahead");
  schema.Add("link.drive_deadline_s", &core.drive_deadline_s, {0.004, 1.0},
             "drive state may be this old while cutting; then jet and abrasive go off at once");
  schema.Add("process.pump_pressure_mpa", &core.pump_pressure_mpa, {10.0, 700.0}, "pressure to cut with");
  schema.Add("process.stand_off_mm", &core.stand_off_mm, {0.5, 20.0}, "tube to sheet");
  schema.Add("process.gate_timeout_s", &core.gate_timeout_s, {1.0, 600.0},
             "a gate that takes longer is a fault");
  schema.Add("process.water_off_timeout_s", &core.water_off_timeout_s, {0.1, 60.0},
             "water that still flows so long after it was told to cease is a fault");
  schema.Add("process.camera_interval_s", &core.camera_interval_s, {0.004, 1.0},
             "between two tracking pictures");
}

class MainMotionNode::Inside {
 public:
  Inside(const link::NodeParts& parts, const NodeConfig& config, MainMotionHardware& hardware,
         std::function<void()> before_cycle, std::function<void(const MainMotionState&)> after_cycle,
         std::function<void()> running)
      : bus_(parts.bus),
        peer_age_(
            parts.metrics.AddGauge("lambdajet_link_peer_age_seconds", "Age of the newest drive state.")),
        pressure_(parts.metrics.AddGauge("lambdajet_pump_pressure_pascals", "Pump pressure.")),
        results_(parts.metrics.AddHistogram("lambdajet_process_event_deviation_meters",
                                            "How far from its place on the path a process event took effect.",
                                            {1e-6, 2e-6, 5e-6, 1e-5, 2e-5, 5e-5, 1e-4, 2e-4, 5e-4, 1e-3})),
        frame_(parts, config.core, config.loop, hardware,
               {.before_step = std::move(before_cycle),
                .after_step = [this] { HandOverResults(); },
                .after_cycle = std::move(after_cycle),
                .running = std::move(running)}) {}

  absl::Status Open() {
    absl::Status status = results_.Open(bus_);
    return status.ok() ? frame_.Open() : status;
  }

  void UpdateMetrics() {
    if (const std::optional<MainMotionState> state = frame_.UpdateMetrics()) {
      peer_age_.Set(state->peer_age_s);
      pressure_.Set(1e6 * state->pump_pressure_mpa);
    }
  }

 private:
  void HandOverResults() {
    while (const std::optional<Measurement> measurement = frame_.core().TakeMeasurement()) {
      results_.Put(*measurement);
    }
    while (const std::optional<ProcessRecord> record = frame_.core().TakeProcessRecord()) {
      results_.Put(*record);
    }
  }

  Participant& bus_;
  Gauge peer_age_, pressure_;
  ResultsOut results_;
  link::ModuleFrame<MainMotionModule> frame_;  // last: its loop uses the others
};

MainMotionNode::MainMotionNode() = default;
MainMotionNode::~MainMotionNode() = default;

absl::StatusOr<std::unique_ptr<MainMotionNode>> MainMotionNode::Open(
    const link::NodeParts& parts, const NodeConfig& config, MainMotionHardware& hardware,
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
