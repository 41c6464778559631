#include "kinematics/bus/pose_door.hpp"

#include <optional>
#include <utility>

#include "foundation/motion/sequence_guard.hpp"
#include "kinematics/bus/hexapod_wire.hpp"
#include "kinematics/bus/pose_wire.hpp"
#include "lambdajet/calibration/v1/machine_description.schema.hpp"
#include "lambdajet/calibration/v1/machine_descriptionPubSubTypes.h"
#include "lambdajet/drive/v1/state.schema.hpp"
#include "lambdajet/drive/v1/statePubSubTypes.h"
#include "lambdajet/kinematics/v1/pose.schema.hpp"
#include "lambdajet/kinematics/v1/posePubSubTypes.h"
#include "lambdajet/kinematics/v1/spatial_pose.schema.hpp"
#include "lambdajet/kinematics/v1/spatial_posePubSubTypes.h"
#include "platform/bus/reader.hpp"
#include "platform/bus/writer.hpp"
#include "platform/machine_file/machine_file.hpp"
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
    return slot_.hexapod() != nullptr ? OpenHexapod(bus, *slot_.hexapod()) : absl::OkStatus();
  }

 private:
  absl::Status OpenHexapod(Participant& bus, const OwnHexapod& own) {
    follower_.emplace(own);
    auto writer = Writer<kinematics_v1::SpatialPosePubSubType>::Open(
        bus,
        {kinematics_v1::SPATIAL_POSE_TOPIC, idl::schema::k_lambdajet_kinematics_v1_spatial_pose, "state"});
    if (!writer.ok()) {
      return writer.status();
    }
    spatial_writer_.emplace(std::move(*writer));
    auto struts = Reader<kinematics_v1::StrutReadingsPubSubType>::Open(
        bus,
        {kinematics_v1::STRUT_READINGS_TOPIC, idl::schema::k_lambdajet_kinematics_v1_spatial_pose, "state"},
        [this](const kinematics_v1::StrutReadings& sample, const Arrival&) { PublishSpatial(sample); });
    if (!struts.ok()) {
      return struts.status();
    }
    struts_.emplace(std::move(*struts));
    return absl::OkStatus();
  }

  void TakeOver(const calibration_v1::MachineDescription& sample) {
    auto machine = DescribedMachine({sample.as_designed_yaml().to_string(), sample.parameters(),
                                     sample.covariance(), sample.version(), sample.hash().to_string()});
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

  // Old, repeated, or of a session that has ended.
  bool IsStale(const idl::link::v1::Header& header, SequenceGuard& guard) {
    const SampleVerdict verdict = guard.Judge({header.session(), header.sequence_number(), header.time_ns()});
    const bool stale = verdict == SampleVerdict::kOld || verdict == SampleVerdict::kTwoWriters;
    if (stale) {
      dropped_.Increment();
    }
    return stale;
  }

  void Publish(const drive_v1::State& drive) {
    const auto machine = slot_.Current();
    if (machine == nullptr) {
      return;
    }
    if (IsStale(drive.header(), drive_guard_)) {
      return;
    }
    ToWire(*machine, drive, pose_);
    pose_.header().session(own_session_);
    pose_.header().sequence_number(++own_sequence_);
    writer_->Write(pose_);
    poses_.Increment();
  }

  void PublishSpatial(const kinematics_v1::StrutReadings& readings) {
    if (IsStale(readings.header(), struts_guard_)) {
      return;
    }
    follower_->ToWire(readings, spatial_pose_);
    spatial_pose_.header().session(own_session_);
    spatial_pose_.header().sequence_number(++spatial_sequence_);
    spatial_writer_->Write(spatial_pose_);
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
  SequenceGuard drive_guard_;
  SequenceGuard struts_guard_;
  std::uint64_t spatial_sequence_ = 0;
  std::optional<HexapodFollower> follower_;
  kinematics_v1::SpatialPose spatial_pose_;
  kinematics_v1::Pose pose_;
  std::optional<Writer<kinematics_v1::PosePubSubType>> writer_;
  std::optional<Reader<calibration_v1::MachineDescriptionPubSubType>> descriptions_;
  std::optional<Writer<kinematics_v1::SpatialPosePubSubType>> spatial_writer_;
  std::optional<Reader<drive_v1::StatePubSubType>> drive_;  // last: readers end before what they write to
  std::optional<Reader<kinematics_v1::StrutReadingsPubSubType>> struts_;
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
