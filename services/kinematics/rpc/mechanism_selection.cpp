#include "kinematics/rpc/mechanism_selection.hpp"

#include <fmt/format.h>

#include <cstdint>
#include <string>

#include "foundation/contract/trouble.hpp"
#include "kinematics/rpc/wire_planar.hpp"
#include "kinematics/rpc/wire_spatial.hpp"

namespace lambdajet::kinematics {
namespace {

// 48 bits of FNV-1a over the geometry as it came: the same numbers, the same hash.
template <class Message>
std::string GeometryHash(const Message& geometry) {
  std::uint64_t hash = 14695981039346656037ULL;
  for (const char byte : geometry.SerializeAsString()) {
    hash = (hash ^ static_cast<unsigned char>(byte)) * 1099511628211ULL;
  }
  return fmt::format("{:012x}", hash >> 16);
}

absl::Status UnknownMachine(const std::string& served, const std::string& wanted) {
  return Trouble(absl::StatusCode::kNotFound, "UNKNOWN_MACHINE",
                 fmt::format("this service serves {}, not {}", served,
                             IsUtf8(wanted) ? wanted.substr(0, 64) : "the machine asked for"));
}

absl::Status CheckVersion(const v1::MechanismSelection& wire, const ActiveMachine& machine) {
  if (!wire.has_version() || wire.version() == machine.description.version) {
    return absl::OkStatus();
  }
  return Trouble(absl::StatusCode::kFailedPrecondition, "VERSION_MISMATCH",
                 fmt::format("version {} is asked for, {} is active; ask for the active one", wire.version(),
                             machine.description.version),
                 {{"active_version", std::to_string(machine.description.version)}});
}

absl::Status TakeMachine(const MachineSlot& slot, const v1::MechanismSelection& wire,
                         SelectedMechanism& selected, lambdajet::machine::v1::ModelVersion& version) {
  auto machine = SelectMachine(slot, wire.machine_id());
  if (!machine.ok()) {
    return machine.status();
  }
  ToWire((*machine)->description, version);
  selected.planar = (*machine)->mechanism;
  return CheckVersion(wire, **machine);
}

absl::Status TakeOwnHexapod(const MachineSlot& slot, const v1::MechanismSelection& wire,
                            SelectedMechanism& selected, lambdajet::machine::v1::ModelVersion& version) {
  const OwnHexapod* own = slot.hexapod();
  if (own == nullptr) {
    return Trouble(
        absl::StatusCode::kFailedPrecondition, "NO_HEXAPOD",
        "this service was started without a hexapod file; start it with one, or bring a geometry along");
  }
  if (!wire.machine_id().empty() && wire.machine_id() != own->machine_id) {
    return UnknownMachine(own->machine_id, wire.machine_id());
  }
  version.set_machine_id(own->machine_id);
  version.set_hash(own->hash);
  selected.hexapod = own->hexapod;
  return absl::OkStatus();
}

// A client's own geometry needs no machine, but names the one that is there.
void TakeGeometry(const MachineSlot& slot, const v1::MechanismSelection& wire, SelectedMechanism& selected,
                  lambdajet::machine::v1::ModelVersion& version, ArgumentChecks& checks) {
  if (const auto machine = slot.Current()) {
    ToWire(machine->description, version);
  }
  if (wire.has_lambda()) {
    selected.planar = FromWire(wire.lambda(), checks);
    version.set_hash(GeometryHash(wire.lambda()));
  } else if (wire.has_biglide()) {
    selected.planar = FromWire(wire.biglide(), checks);
    version.set_hash(GeometryHash(wire.biglide()));
  } else {
    selected.hexapod = FromWire(wire.hexapod(), checks);
    version.set_hash(GeometryHash(wire.hexapod()));
  }
}

}  // namespace

void ToWire(const MachineDescription& machine, lambdajet::machine::v1::ModelVersion& wire) {
  wire.set_machine_id(machine.machine_id);
  wire.set_version(machine.version);
  wire.set_hash(machine.hash);
}

absl::StatusOr<std::shared_ptr<const ActiveMachine>> SelectMachine(const MachineSlot& slot,
                                                                   const std::string& wanted_id) {
  auto machine = slot.Current();
  if (machine == nullptr) {
    return Trouble(absl::StatusCode::kFailedPrecondition, "NO_MACHINE_DESCRIPTION",
                   "no machine description has arrived yet; start calibration, or bring a geometry along");
  }
  if (!wanted_id.empty() && wanted_id != machine->description.machine_id) {
    return UnknownMachine(machine->description.machine_id, wanted_id);
  }
  return machine;
}

absl::StatusOr<SelectedMechanism> SelectMechanism(const MachineSlot& slot, const v1::MechanismSelection& wire,
                                                  const v1::WorkingMode* mode,
                                                  std::optional<int> assembly_mode,
                                                  lambdajet::machine::v1::ModelVersion& version) {
  SelectedMechanism selected;
  ArgumentChecks checks;
  if (wire.geometry_case() == v1::MechanismSelection::GEOMETRY_NOT_SET) {
    if (absl::Status status = TakeMachine(slot, wire, selected, version); !status.ok()) {
      return status;
    }
  } else if (wire.has_own_hexapod()) {
    if (absl::Status status = TakeOwnHexapod(slot, wire, selected, version); !status.ok()) {
      return status;
    }
  } else {
    TakeGeometry(slot, wire, selected, version, checks);
  }
  if (mode != nullptr || assembly_mode.has_value()) {
    const WorkingMode wanted =
        mode != nullptr ? FromWire(*mode, "working_mode", checks) : selected.planar.working_mode;
    const int side = assembly_mode.value_or(selected.planar.assembly_mode);
    checks.Require(side == 1 || side == -1, "assembly_mode", "OUT_OF_RANGE",
                   fmt::format("{} is not +1 or -1", side));
    selected.planar = selected.planar.WithModes(wanted, side);
  }
  if (!checks.ok()) {
    return checks.status();
  }
  return selected;
}

}  // namespace lambdajet::kinematics
