#include "simulated_plant/bus/truth_doors.hpp"

#include <cmath>
#include <cstddef>
#include <optional>
#include <utility>

#include "lambdajet/plant/v1/truth.h"
#include "lambdajet/plant/v1/truth.schema.hpp"
#include "lambdajet/plant/v1/truthPubSubTypes.h"
#include "platform/bus/reader.hpp"
#include "platform/bus/sample_slots.hpp"
#include "platform/bus/writer.hpp"

namespace lambdajet::simulated_plant {
namespace {

namespace wire = idl::plant::v1;

constexpr std::size_t kBatch = 10;
constexpr std::size_t kSwitches = 8;
constexpr std::size_t kQueued = 4096;  // samples between two cycles of the reader's loop

TopicSpec Topic(const std::string& name) {
  return {name, idl::schema::k_lambdajet_plant_v1_truth, "setpoint"};
}

void SetHeader(const SampleHeader& of, std::uint64_t& number, idl::link::v1::Header& header) {
  header.session(of.session);
  header.sequence_number(++number);
  header.time_ns(of.time_ns);
}

}  // namespace

class DriveTruthDoor::Inside {
 public:
  Inside(DrivePlant& plant, Writer<wire::DriveTruthPubSubType> writer)
      : plant_(plant), writer_(std::move(writer)) {}

  void Publish(const DriveState& state) {
    while (const std::optional<SheetSample> sample = plant_.TakeSheetSample()) {
      wire::SheetSample& to = batch_.samples()[batch_.count()];
      to.time_ns(sample->time_ns);
      to.x_mm(sample->X_DW.x_mm);
      to.y_mm(sample->X_DW.y_mm);
      to.theta_rad(sample->X_DW.theta_rad);
      to.s_mm(state.s_mm +
              state.s_rate_mm_per_s * 1e-9 * static_cast<double>(sample->time_ns - state.header.time_ns));
      batch_.count(batch_.count() + 1);
      if (batch_.count() == kBatch) {
        SetHeader(state.header, number_, batch_.header());
        batch_.plan(state.plan);
        writer_.Write(batch_);
        batch_.count(0);
      }
    }
  }

 private:
  DrivePlant& plant_;
  Writer<wire::DriveTruthPubSubType> writer_;
  wire::DriveTruth batch_;
  std::uint64_t number_ = 0;
};

DriveTruthDoor::DriveTruthDoor() = default;
DriveTruthDoor::~DriveTruthDoor() = default;

absl::StatusOr<std::unique_ptr<DriveTruthDoor>> DriveTruthDoor::Open(Participant& bus, DrivePlant& plant) {
  auto writer = Writer<wire::DriveTruthPubSubType>::Open(bus, Topic(wire::DRIVE_TRUTH_TOPIC));
  if (!writer.ok()) {
    return writer.status();
  }
  std::unique_ptr<DriveTruthDoor> door(new DriveTruthDoor());
  door->inside_ = std::make_unique<Inside>(plant, std::move(*writer));
  return door;
}

void DriveTruthDoor::Publish(const DriveState& state) { inside_->Publish(state); }

class JetTruthDoor::Inside {
 public:
  Inside(MainMotionPlant& plant, Writer<wire::JetTruthPubSubType> writer)
      : plant_(plant), writer_(std::move(writer)) {}

  void Publish(const MainMotionState& state) {
    while (batch_.switch_count() < kSwitches) {
      const std::optional<JetSwitch> change = plant_.TakeJetSwitch();
      if (!change) {
        break;
      }
      wire::JetSwitch& to = batch_.switches()[batch_.switch_count()];
      to.time_ns(change->time_ns);
      to.on(change->on);
      batch_.switch_count(batch_.switch_count() + 1);
    }
    while (const std::optional<JetSample> sample = plant_.TakeJetSample()) {
      wire::JetSample& to = batch_.samples()[batch_.count()];
      to.time_ns(sample->time_ns);
      to.x_D_mm(sample->p_DJ_mm.x());
      to.y_D_mm(sample->p_DJ_mm.y());
      batch_.count(batch_.count() + 1);
      if (batch_.count() == kBatch) {
        SetHeader(state.header, number_, batch_.header());
        batch_.plan(state.plan);
        batch_.lag_time_s(plant_.lag_time_s());
        batch_.jet_on(plant_.jet_on());
        writer_.Write(batch_);
        batch_.count(0);
        batch_.switch_count(0);
      }
    }
  }

 private:
  MainMotionPlant& plant_;
  Writer<wire::JetTruthPubSubType> writer_;
  wire::JetTruth batch_;
  std::uint64_t number_ = 0;
};

JetTruthDoor::JetTruthDoor() = default;
JetTruthDoor::~JetTruthDoor() = default;

absl::StatusOr<std::unique_ptr<JetTruthDoor>> JetTruthDoor::Open(Participant& bus, MainMotionPlant& plant) {
  auto writer = Writer<wire::JetTruthPubSubType>::Open(bus, Topic(wire::JET_TRUTH_TOPIC));
  if (!writer.ok()) {
    return writer.status();
  }
  std::unique_ptr<JetTruthDoor> door(new JetTruthDoor());
  door->inside_ = std::make_unique<Inside>(plant, std::move(*writer));
  return door;
}

void JetTruthDoor::Publish(const MainMotionState& state) { inside_->Publish(state); }

class SheetTruthDoor::Inside {
 public:
  SampleQueue<SheetSample> queue{kQueued};
  std::optional<Reader<wire::DriveTruthPubSubType>> reader;  // last
};

SheetTruthDoor::SheetTruthDoor() = default;
SheetTruthDoor::~SheetTruthDoor() = default;

absl::StatusOr<std::unique_ptr<SheetTruthDoor>> SheetTruthDoor::Open(Participant& bus) {
  std::unique_ptr<SheetTruthDoor> door(new SheetTruthDoor());
  door->inside_ = std::make_unique<Inside>();
  Inside* inside = door->inside_.get();
  auto reader = Reader<wire::DriveTruthPubSubType>::Open(
      bus, Topic(wire::DRIVE_TRUTH_TOPIC), [inside](const wire::DriveTruth& batch, const Arrival& arrival) {
        for (std::size_t i = 0; i < std::min<std::size_t>(batch.count(), kBatch); ++i) {
          const wire::SheetSample& s = batch.samples()[i];
          if (std::isfinite(s.x_mm()) && std::isfinite(s.y_mm()) && std::isfinite(s.theta_rad())) {
            inside->queue.Put({s.time_ns(), {s.x_mm(), s.y_mm(), s.theta_rad()}}, arrival);
          }
        }
      });
  if (!reader.ok()) {
    return reader.status();
  }
  inside->reader.emplace(std::move(*reader));
  return door;
}

void SheetTruthDoor::Refresh() {
  SheetSample sample;
  while (inside_->queue.TryTake(sample)) {
    history_.Push(sample);
  }
}

}  // namespace lambdajet::simulated_plant
