#include "kinematics/bus/pose_door.hpp"

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include "kinematics/bus/description_wire.hpp"
#include "kinematics/bus/pose_wire.hpp"
#include "lambdajet/calibration/v1/machine_description.schema.hpp"
#include "lambdajet/calibration/v1/machine_descriptionPubSubTypes.h"
#include "lambdajet/drive/v1/state.schema.hpp"
#include "lambdajet/drive/v1/statePubSubTypes.h"
#include "lambdajet/kinematics/v1/pose.schema.hpp"
#include "lambdajet/kinematics/v1/posePubSubTypes.h"
#include "platform/bus/reader.hpp"
#include "platform/bus/writer.hpp"
#include "platform/process/common_clock.hpp"
#include "platform/telemetry/log.hpp"
#include "platform/telemetry/metrics.hpp"

namespace lambdajet::kinematics {
namespace {

namespace calibration_v1 = idl::calibration::v1;
namespace drive_v1 = idl::drive::v1;
namespace kinematics_v1 = idl::kinematics::v1;

}  // namespace

class PoseDoor::Inside {
 public:
  Inside(MachineSlot& slot, Log& log, Metrics& metrics, std::function<void()> on_description)
      : slot_(slot),
        log_(log),
        on_description_(std::move(on_description)),
        dropped_(metrics.AddCounter("lambdajet_kinematics_dropped_samples_total",
                                    "Drive samples that were old, repeated or of an ended session")),
        poses_(metrics.AddCounter("lambdajet_kinematics_poses_total", "Poses published on the bus")),
        refused_(metrics.AddCounter("lambdajet_kinematics_refused_descriptions_total",
                                    "Machine descriptions that could not be taken over")),
        version_(metrics.AddGauge("lambdajet_kinematics_model_version",
                                  "Version of the machine description in use")) {}

  absl::Status Open(Participant& bus) {
    auto writer = Writer<kinematics_v1::PosePubSubType>::Open(
        bus, {kinematics_v1::POSE_TOPIC, idl::schema::k_lambdajet_kinematics_v1_pose, "state"});
    if (!writer.ok()) {
      return writer.status();
    }
    writer_.emplace(std::move(*writer));
    auto descriptions = Reader<calibration_v1::MachineDescriptionPubSubType>::Open(
        bus,
        {calibration_v1::MACHINE_DESCRIPTION_TOPIC,
         idl::schema::k_lambdajet_calibration_v1_machine_description, "description"},
        [this](const calibration_v1::MachineDescription& sample, const Arrival&) { TakeOver(sample); });
    if (!descriptions.ok()) {
      return descriptions.status();
    }
    descriptions_.emplace(std::move(*descriptions));
    auto drive = Reader<drive_v1::StatePubSubType>::Open(
        bus, {drive_v1::STATE_TOPIC, idl::schema::k_lambdajet_drive_v1_state, "state"},
        [this](const drive_v1::State& sample, const Arrival&) { Publish(sample); });
    if (!drive.ok()) {
      return drive.status();
    }
    drive_.emplace(std::move(*drive));
    return absl::OkStatus();
  }

 private:
  void TakeOver(const calibration_v1::MachineDescription& sample) {
    auto machine = FromWire(sample);
    if (!machine.ok()) {
      refused_.Increment();
      log_.Error("description_refused", std::string(machine.status().message()),
                 {{"version", sample.version()}});
      return;
    }
    version_.Set(machine->version);
    log_.Info("description_taken_over", "calculating with a new machine description",
              {{"machine_id", machine->machine_id}, {"version", machine->version}, {"hash", machine->hash}});
    slot_.Publish(std::move(*machine));
    on_description_();
  }

  // Sessions are numbers without an order: one that another has taken the place of has ended.
  bool IsNew(const idl::link::v1::Header& header) {
    if (header.session() == session_) {
      const bool newer = header.sequence_number() > sequence_;
      sequence_ = std::max(sequence_, header.sequence_number());
      return newer;
    }
    if (std::find(ended_.begin(), ended_.end(), header.session()) != ended_.end()) {
      return false;
    }
    ended_[++sessions_ % ended_.size()] = session_;
    session_ = header.session();
    sequence_ = header.sequence_number();
    return true;
  }

  void Publish(const drive_v1::State& drive) {
    const auto machine = slot_.Current();
    if (machine == nullptr) {
      return;
    }
    if (!IsNew(drive.header())) {
      dropped_.Increment();
      return;
    }
    ToWire(*machine, drive, pose_);
    pose_.header().session(own_session_);
    pose_.header().sequence_number(++own_sequence_);
    writer_->Write(pose_);
    poses_.Increment();
  }

  MachineSlot& slot_;
  Log& log_;
  std::function<void()> on_description_;
  Counter dropped_;
  Counter poses_;
  Counter refused_;
  Gauge version_;
  const std::uint64_t own_session_ = static_cast<std::uint64_t>(CommonClock().now_ns());
  std::uint64_t own_sequence_ = 0;
  std::uint64_t session_ = 0;
  std::array<std::uint64_t, 8> ended_{};
  std::size_t sessions_ = 0;
  std::uint64_t sequence_ = 0;
  kinematics_v1::Pose pose_;
  std::optional<Writer<kinematics_v1::PosePubSubType>> writer_;
  std::optional<Reader<calibration_v1::MachineDescriptionPubSubType>> descriptions_;
  std::optional<Reader<drive_v1::StatePubSubType>> drive_;  // last: it ends before what it writes to
};

PoseDoor::PoseDoor() = default;
PoseDoor::~PoseDoor() = default;

absl::StatusOr<std::unique_ptr<PoseDoor>> PoseDoor::Open(Participant& bus, MachineSlot& slot, Log& log,
                                                         Metrics& metrics,
                                                         std::function<void()> on_description) {
  std::unique_ptr<PoseDoor> door(new PoseDoor);
  door->inside_ = std::make_unique<Inside>(slot, log, metrics, std::move(on_description));
  if (absl::Status status = door->inside_->Open(bus); !status.ok()) {
    return status;
  }
  return door;
}

}  // namespace lambdajet::kinematics
