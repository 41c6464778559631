#include "trajectory/bus/machine_reader.hpp"

#include <optional>

#include "lambdajet/calibration/v1/machine_description.h"
#include "lambdajet/calibration/v1/machine_description.schema.hpp"
#include "lambdajet/calibration/v1/machine_descriptionPubSubTypes.h"
#include "platform/bus/participant.hpp"
#include "platform/bus/reader.hpp"
#include "platform/machine_file/machine_file.hpp"
#include "platform/telemetry/log.hpp"

namespace lambdajet::trajectory {
namespace {

namespace wire = lambdajet::idl::calibration::v1;

absl::StatusOr<MachineDescription> FromWire(const wire::MachineDescription& sample) {
  return DescribedMachine({sample.as_designed_yaml().to_string(), sample.parameters(), sample.covariance(),
                           sample.version(), sample.hash().to_string()});
}

}  // namespace

struct MachineReader::Link {
  std::optional<Reader<wire::MachineDescriptionPubSubType>> reader;
};

MachineReader::MachineReader() : link_(std::make_unique<Link>()) {}
MachineReader::~MachineReader() = default;

std::shared_ptr<const MachineDescription> MachineReader::active() const {
  const std::lock_guard lock(mutex_);
  return held_.empty() ? nullptr : held_.back();
}

std::shared_ptr<const MachineDescription> MachineReader::Version(std::uint32_t version) const {
  const std::lock_guard lock(mutex_);
  for (auto machine = held_.rbegin(); machine != held_.rend(); ++machine) {
    if ((*machine)->version == version) {
      return *machine;
    }
  }
  return nullptr;
}

void MachineReader::Take(std::shared_ptr<const MachineDescription> machine) {
  const std::lock_guard lock(mutex_);
  held_.push_back(std::move(machine));
  if (held_.size() > kKept) {
    held_.pop_front();
  }
}

absl::StatusOr<std::unique_ptr<MachineReader>> MachineReader::Open(Participant& bus, Log& log,
                                                                   std::function<void()> on_first) {
  std::unique_ptr<MachineReader> machines(new MachineReader());
  auto reader = Reader<wire::MachineDescriptionPubSubType>::Open(
      bus,
      {wire::MACHINE_DESCRIPTION_TOPIC, idl::schema::k_lambdajet_calibration_v1_machine_description,
       "description"},
      [self = machines.get(), &log, on_first = std::move(on_first)](const wire::MachineDescription& sample,
                                                                    const Arrival&) {
        absl::StatusOr<MachineDescription> machine = FromWire(sample);
        if (!machine.ok()) {
          log.Error("machine_description_refused", machine.status().ToString(),
                    {{"version", sample.version()}});
          return;
        }
        const bool first = self->active() == nullptr;
        log.Info("machine_description_taken", "calculating with a new version",
                 {{"version", machine->version}, {"hash", machine->hash}});
        self->Take(std::make_shared<const MachineDescription>(std::move(*machine)));
        if (first && on_first) {
          on_first();
        }
      });
  if (!reader.ok()) {
    return reader.status();
  }
  machines->link_->reader.emplace(std::move(*reader));
  return machines;
}

}  // namespace lambdajet::trajectory
