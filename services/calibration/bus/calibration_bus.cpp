#include "calibration/bus/calibration_bus.hpp"

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <random>
#include <thread>
#include <utility>

#include "calibration/bus/wire.hpp"
#include "lambdajet/calibration/v1/machine_description.schema.hpp"
#include "lambdajet/calibration/v1/machine_descriptionPubSubTypes.h"
#include "lambdajet/main_motion/v1/state.schema.hpp"
#include "lambdajet/main_motion/v1/statePubSubTypes.h"
#include "platform/bus/reader.hpp"
#include "platform/bus/sample_slots.hpp"
#include "platform/bus/writer.hpp"
#include "platform/telemetry/log.hpp"
#include "platform/telemetry/metrics.hpp"

namespace lambdajet::calibration {
namespace {

namespace described = idl::calibration::v1;
namespace measured = idl::main_motion::v1;

constexpr std::size_t kQueue = 8192;  // over a minute of pictures at 100 Hz
constexpr std::size_t kBatch = 512;
constexpr std::chrono::milliseconds kPatience{50};
constexpr std::chrono::milliseconds kRetry{500};
constexpr std::chrono::milliseconds kMostWait{2000};

}  // namespace

class CalibrationBus::Inside {
 public:
  Inside(CalibrationDesk& desk, const Clock& clock, Log& log, Metrics& metrics)
      : desk_(desk),
        clock_(clock),
        log_(log),
        queue_(kQueue),
        taken_(metrics.AddCounter("lambdajet_calibration_looks_total",
                                  "Looks of the camera written to the store")),
        refused_(metrics.AddCounter("lambdajet_calibration_looks_refused_total",
                                    "Looks dropped: not finite, or the queue was full")),
        version_(metrics.AddGauge("lambdajet_calibration_active_version",
                                  "Version of the machine description in force")) {
    std::random_device random;
    session_ = (static_cast<std::uint64_t>(random()) << 32U) | random();
  }

  ~Inside() {
    reader_.reset();
    stop_ = true;
    if (keeper_.joinable()) {
      keeper_.join();
    }
  }

  absl::Status Start(Participant& bus) {
    auto writer = Writer<described::MachineDescriptionPubSubType>::Open(
        bus, {described::MACHINE_DESCRIPTION_TOPIC,
              idl::schema::k_lambdajet_calibration_v1_machine_description, "description"});
    if (!writer.ok()) {
      return writer.status();
    }
    writer_.emplace(std::move(*writer));
    auto reader = Reader<measured::MeasurementPubSubType>::Open(
        bus, {measured::MEASUREMENT_TOPIC, idl::schema::k_lambdajet_main_motion_v1_state, "setpoint"},
        [this](const measured::Measurement& sample, const Arrival& arrival) { Take(sample, arrival); });
    if (!reader.ok()) {
      return reader.status();
    }
    reader_.emplace(std::move(*reader));
    keeper_ = std::thread([this] { Keep(); });
    return absl::OkStatus();
  }

  // Until every look that has arrived is in the store; gives up where the store cannot take them.
  void AwaitKept() {
    std::unique_lock lock(mutex_);
    const std::uint64_t wanted = arrived_;
    changed_.wait_for(lock, kMostWait, [&] { return kept_ >= wanted; });
  }

  void Publish(const MachineDescription& machine, const std::string& as_designed_yaml) {
    auto sample = std::make_unique<described::MachineDescription>();  // 36 KiB: not on the stack
    sample->header().session(session_);
    sample->header().sequence_number(++sequence_number_);
    sample->header().time_ns(clock_.now_ns());
    ToWire(machine, as_designed_yaml, *sample);
    version_.Set(machine.version);
    if (writer_->Write(*sample)) {
      log_.Info("description_published", "everyone who calculates is told",
                {{"version", machine.version}, {"hash", machine.hash}});
    } else {
      log_.Error("description_not_published", "the bus did not take the machine description",
                 {{"version", machine.version}});
    }
  }

 private:
  void Take(const measured::Measurement& sample, const Arrival& arrival) {
    const auto look = FromWire(sample);
    if (!look || !queue_.Put(*look, arrival)) {
      refused_.Increment();
      return;
    }
    const std::lock_guard lock(mutex_);
    ++arrived_;
  }

  void Fill(std::vector<RecordedLook>& batch) {
    RecordedLook look;
    std::chrono::milliseconds patience = kPatience;
    while (batch.size() < kBatch && queue_.TakeWithin(patience, look)) {
      batch.push_back(look);
      patience = std::chrono::milliseconds(0);
    }
  }

  void Keep() {
    std::vector<RecordedLook> batch;
    while (!stop_ || queue_.size() > 0) {
      Fill(batch);
      if (batch.empty()) {
        continue;
      }
      const auto added = desk_.TakeLooks(batch);
      if (added.ok()) {
        taken_.Increment(*added);
        const std::lock_guard lock(mutex_);
        kept_ += batch.size();
        changed_.notify_all();
        batch.clear();
        continue;
      }
      log_.Error("looks_not_kept", added.status().ToString(), {{"looks", batch.size()}});
      if (stop_) {
        return;
      }
      std::this_thread::sleep_for(kRetry);
    }
  }

  CalibrationDesk& desk_;
  const Clock& clock_;
  Log& log_;
  SampleQueue<RecordedLook> queue_;
  Counter taken_;
  Counter refused_;
  Gauge version_;
  std::uint64_t session_ = 0;
  std::uint64_t sequence_number_ = 0;
  std::optional<Writer<described::MachineDescriptionPubSubType>> writer_;
  std::optional<Reader<measured::MeasurementPubSubType>> reader_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::uint64_t arrived_ = 0;  // in the queue or beyond
  std::uint64_t kept_ = 0;
  std::atomic<bool> stop_ = false;
  std::thread keeper_;
};

CalibrationBus::CalibrationBus() = default;
CalibrationBus::~CalibrationBus() = default;

absl::StatusOr<std::unique_ptr<CalibrationBus>> CalibrationBus::Open(Participant& bus, CalibrationDesk& desk,
                                                                     const Clock& clock, Log& log,
                                                                     Metrics& metrics) {
  std::unique_ptr<CalibrationBus> room(new CalibrationBus());
  room->inside_ = std::make_unique<Inside>(desk, clock, log, metrics);
  if (const absl::Status started = room->inside_->Start(bus); !started.ok()) {
    return started;
  }
  desk.Listen([inside = room->inside_.get()](const MachineDescription& machine, const std::string& yaml) {
    inside->Publish(machine, yaml);
  });
  desk.BeforeReading([inside = room->inside_.get()] { inside->AwaitKept(); });
  return room;
}

}  // namespace lambdajet::calibration
