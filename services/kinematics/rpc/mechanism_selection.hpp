// Finds the mechanism that a question is about: the machine's own lambda, the house's own hexapod, or the geometry the
// request brings along.
//
// Errors: INVALID_ARGUMENT with the field's reason; NOT_FOUND UNKNOWN_MACHINE; FAILED_PRECONDITION NO_MACHINE_DESCRIPTION
// or VERSION_MISMATCH, or NO_HEXAPOD.
// Threads: pure, but for the slot. Cost: for the machine's own mechanism a copy of some 300 bytes.
#pragma once

#include <optional>

#include "absl/status/statusor.h"
#include "kinematics/core/active_machine.hpp"
#include "kinematics/core/hexapod.hpp"
#include "lambdajet/kinematics/v1/kinematics.pb.h"
#include "platform/rpc/argument_checks.hpp"

namespace lambdajet::kinematics {

struct SelectedMechanism {
  LambdaMechanism planar;
  std::optional<Hexapod> hexapod;  // if it is there, the question is about it
};

// Also writes what it computed with into `version`. `mode` and `assembly_mode` take the place of the mechanism's own.
absl::StatusOr<SelectedMechanism> SelectMechanism(const MachineSlot& slot, const v1::MechanismSelection& wire,
                                                  const v1::WorkingMode* mode,
                                                  std::optional<int> assembly_mode,
                                                  lambdajet::machine::v1::ModelVersion& version);

// The active machine, if it is the one that is asked for; `wanted_id` empty: any.
absl::StatusOr<std::shared_ptr<const ActiveMachine>> SelectMachine(const MachineSlot& slot,
                                                                   const std::string& wanted_id);

void ToWire(const MachineDescription& machine, lambdajet::machine::v1::ModelVersion& wire);

// What a request says of modes in the fields that every question has.
template <class Request>
const v1::WorkingMode* ModeIn(const Request& request) {
  return request.has_working_mode() ? &request.working_mode() : nullptr;
}
template <class Request>
std::optional<int> AssemblyIn(const Request& request) {
  return request.has_assembly_mode() ? std::optional<int>(request.assembly_mode()) : std::nullopt;
}

}  // namespace lambdajet::kinematics
