#include "link/bus/module_desk.hpp"

#include <unistd.h>

#include <atomic>
#include <chrono>
#include <mutex>
#include <thread>
#include <utility>

#include "lambdajet/calibration/v1/machine_description.h"
#include "lambdajet/calibration/v1/machine_description.schema.hpp"
#include "lambdajet/calibration/v1/machine_descriptionPubSubTypes.h"
#include "lambdajet/drive/v1/state.schema.hpp"
#include "lambdajet/drive/v1/statePubSubTypes.h"
#include "lambdajet/main_motion/v1/state.schema.hpp"
#include "lambdajet/main_motion/v1/statePubSubTypes.h"
#include "link/bus/clock_exchange.hpp"
#include "link/bus/description_wire.hpp"
#include "link/wire/link_wire.hpp"
#include "platform/bus/reader.hpp"
#include "platform/bus/sample_slots.hpp"
#include "platform/bus/writer.hpp"
#include "platform/process/common_clock.hpp"
#include "platform/process/periodic_loop.hpp"
#include "platform/telemetry/log.hpp"

namespace lambdajet::link {
namespace {

namespace calibration_wire = idl::calibration::v1;
namespace drive_wire = idl::drive::v1;
namespace motion_wire = idl::main_motion::v1;

constexpr std::chrono::milliseconds kPingEvery(100);
constexpr std::size_t kChanges = 64;
constexpr int kBusPriority = 20;  // below the control loop's

// What an operator reads when a module changes its mode.
std::string TextOf(const ModeChange& change) {
  std::string text(Name(change.from));
  text += " to ";
  text += Name(change.to);
  if (change.reason != ModuleReason::kNone) {
    text += " because of ";
    text += Name(change.reason);
  }
  return text;
}

}  // namespace

class ModuleDesk::Inside {
 public:
  Inside(const Clock& clock, Log& log, std::uint32_t sender, std::uint64_t session)
      : clock_(clock), log_(log), sender_(sender), session_(session) {}

  ~Inside() {
    stop_.store(true, std::memory_order_release);
    if (thread_.joinable()) {
      thread_.join();
    }
  }

  absl::Status Open(Participant& bus) {
    auto exchange = ClockExchange::Open(bus, clock_, sender_, session_);
    if (!exchange.ok()) {
      return exchange.status();
    }
    exchange_ = std::move(*exchange);
    if (absl::Status status = OpenEvents(bus); !status.ok()) {
      return status;
    }
    auto descriptions = Reader<calibration_wire::MachineDescriptionPubSubType>::Open(
        bus,
        {calibration_wire::MACHINE_DESCRIPTION_TOPIC,
         idl::schema::k_lambdajet_calibration_v1_machine_description, "description"},
        [this](const calibration_wire::MachineDescription& wire, const Arrival&) { TakeOver(wire); });
    if (!descriptions.ok()) {
      return descriptions.status();
    }
    descriptions_.emplace(std::move(*descriptions));
    thread_ = std::thread([this] { Run(); });
    return absl::OkStatus();
  }

  void Tell(const ModeChange& change) { changes_.Put(change, {}); }

  const MachineDescription* TakeDescription() {
    const std::unique_lock lock(mutex_, std::try_to_lock);
    if (!lock.owns_lock() || newest_ == nullptr) {
      return nullptr;
    }
    handed_.swap(newest_);
    retired_ = std::move(newest_);  // freed by the desk's thread, not by the loop
    return handed_.get();
  }

  LinkFigures figures() const { return exchange_->figures(); }

 private:
  absl::Status OpenEvents(Participant& bus) {
    if (sender_ == 1) {
      auto writer = Writer<drive_wire::EventPubSubType>::Open(
          bus, {drive_wire::EVENT_TOPIC, idl::schema::k_lambdajet_drive_v1_state, "event"});
      if (!writer.ok()) {
        return writer.status();
      }
      drive_events_.emplace(std::move(*writer));
      return absl::OkStatus();
    }
    auto writer = Writer<motion_wire::EventPubSubType>::Open(
        bus, {motion_wire::EVENT_TOPIC, idl::schema::k_lambdajet_main_motion_v1_state, "event"});
    if (!writer.ok()) {
      return writer.status();
    }
    motion_events_.emplace(std::move(*writer));
    return absl::OkStatus();
  }

  void TakeOver(const calibration_wire::MachineDescription& wire) {
    auto machine = FromWire(wire);
    if (!machine.ok()) {
      log_.Error("description_refused", std::string(machine.status().message()),
                 {{"version", wire.version()}});
      return;
    }
    log_.Info("description_taken_over", "limits and delays of a new machine description",
              {{"machine_id", machine->machine_id}, {"version", machine->version}, {"hash", machine->hash}});
    auto fresh = std::make_unique<MachineDescription>(std::move(*machine));
    const std::lock_guard lock(mutex_);
    retired_.reset();
    newest_ = std::move(fresh);
  }

  void Run() {
    auto next_ping = std::chrono::steady_clock::now();
    while (!stop_.load(std::memory_order_acquire)) {
      ModeChange change;
      if (changes_.TakeWithin(std::chrono::milliseconds(20), change)) {
        Announce(change);
      }
      if (std::chrono::steady_clock::now() >= next_ping) {
        next_ping += kPingEvery;
        exchange_->Ping();
      }
    }
  }

  void Announce(const ModeChange& change) {
    const std::string text = TextOf(change);
    const bool bad = change.to == ModuleMode::kFault || change.to == ModuleMode::kStopped;
    const auto write = [&](auto& writer, auto&& event) {
      ToWire({session_, ++events_, change.time_ns}, event.header());
      event.code(std::string(Name(change.to)));
      event.text(text);
      event.plan(change.plan);
      event.s_mm(change.s_mm);
      writer->Write(event);
    };
    if (drive_events_) {
      write(drive_events_, drive_wire::Event());
    } else {
      write(motion_events_, motion_wire::Event());
    }
    const std::initializer_list<LogField> fields = {{"to", Name(change.to)},
                                                    {"reason", Name(change.reason)},
                                                    {"common_time_ns", change.time_ns},
                                                    {"s_mm", change.s_mm}};
    if (bad) {
      log_.Warning("mode", text, fields);
    } else {
      log_.Info("mode", text, fields);
    }
  }

  const Clock& clock_;
  Log& log_;
  std::uint32_t sender_;
  std::uint64_t session_;
  std::uint64_t events_ = 0;
  SampleQueue<ModeChange> changes_{kChanges};
  std::mutex mutex_;
  std::unique_ptr<MachineDescription> newest_;
  std::unique_ptr<MachineDescription> handed_;
  std::unique_ptr<MachineDescription> retired_;
  std::atomic<bool> stop_ = false;
  std::unique_ptr<ClockExchange> exchange_;
  std::optional<Writer<drive_wire::EventPubSubType>> drive_events_;
  std::optional<Writer<motion_wire::EventPubSubType>> motion_events_;
  std::optional<Reader<calibration_wire::MachineDescriptionPubSubType>> descriptions_;
  std::thread thread_;
};

ModuleDesk::ModuleDesk() = default;
ModuleDesk::~ModuleDesk() = default;

absl::StatusOr<std::unique_ptr<ModuleDesk>> ModuleDesk::Open(Participant& bus, const Clock& clock, Log& log,
                                                             std::uint32_t sender, std::uint64_t session) {
  std::unique_ptr<ModuleDesk> desk(new ModuleDesk());
  desk->inside_ = std::make_unique<Inside>(clock, log, sender, session);
  if (absl::Status status = desk->inside_->Open(bus); !status.ok()) {
    return status;
  }
  return desk;
}

void ModuleDesk::Tell(const ModeChange& change) { inside_->Tell(change); }
const MachineDescription* ModuleDesk::TakeDescription() { return inside_->TakeDescription(); }
LinkFigures ModuleDesk::figures() const { return inside_->figures(); }

std::uint64_t NewSession(const Clock& clock) {
  return static_cast<std::uint64_t>(clock.now_ns()) ^ (static_cast<std::uint64_t>(getpid()) << 40);
}

void EnterModulePriority() { PeriodicLoop({.fifo_priority = kBusPriority}).EnterRealTime(); }

}  // namespace lambdajet::link
