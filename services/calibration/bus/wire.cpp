#include "calibration/bus/wire.hpp"

#include <array>

#include "lambdajet/calibration/v1/machine_description.h"
#include "lambdajet/main_motion/v1/state.h"

namespace lambdajet::calibration {
namespace {

Eigen::Vector2d Pair(const std::array<double, 2>& numbers) { return {numbers[0], numbers[1]}; }

}  // namespace

std::optional<RecordedLook> FromWire(const idl::main_motion::v1::Measurement& wire) {
  RecordedLook recorded;
  recorded.plan = wire.plan();
  recorded.session = wire.header().session();
  recorded.sequence_number = wire.header().sequence_number();
  recorded.gate = wire.gate();
  Measurement& look = recorded.look;
  look.kind = KindOf(wire.gate(), wire.mark());
  look.seen = wire.seen();
  look.mark = wire.mark();
  look.exposure_ns = wire.exposure_ns();
  look.p_C_mm = {wire.x_C_mm(), wire.y_C_mm()};
  look.actuator_position_mm = Pair(wire.actuator_position_mm());
  look.actuator_velocity_mm_per_s = Pair(wire.actuator_velocity_mm_per_s());
  look.actuator_acceleration_mm_per_s2 = Pair(wire.actuator_acceleration_mm_per_s2());
  look.pierce_actuator_position_mm = Pair(wire.jet_pierce_actuator_position_mm());
  const bool finite = look.p_C_mm.allFinite() && look.actuator_position_mm.allFinite() &&
                      look.actuator_velocity_mm_per_s.allFinite() &&
                      look.actuator_acceleration_mm_per_s2.allFinite() &&
                      look.pierce_actuator_position_mm.allFinite();
  return finite ? std::optional(recorded) : std::nullopt;
}

void ToWire(const MachineDescription& machine, const std::string& as_designed_yaml,
            idl::calibration::v1::MachineDescription& wire) {
  wire.version(machine.version);
  wire.hash(machine.hash.c_str());
  wire.as_designed_yaml(as_designed_yaml.c_str());
  for (std::size_t i = 0; i < kParameterCount; ++i) {
    wire.parameters()[i] = machine.parameters[static_cast<Eigen::Index>(i)];
    for (std::size_t j = 0; j < kParameterCount; ++j) {
      wire.covariance()[i * kParameterCount + j] =
          machine.covariance(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
    }
  }
}

}  // namespace lambdajet::calibration
