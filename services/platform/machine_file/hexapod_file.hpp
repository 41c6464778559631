// Reads and writes the YAML file that describes one hexapod (foundation/machine/hexapod_geometry.hpp, hexapod_motion.hpp).
//
// Model: every key is required but a strut's `joint`; a strut without it has a perfect universal joint. The joint frames are
// laid by LayJointFrames from the file's joint centres and home. Poses are x_mm, y_mm, z_mm and the Krylov angles of
// foundation/geometry/pose.hpp. Written text is canonical: a fixed order of keys, shortest digits that read back.
// Units: in the keys. Threads: any.
// Errors: INVALID_ARGUMENT BAD_HEXAPOD_FILE with up to 20 violations, each with key, value, unit and line; those of
// ReadWholeFile.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "foundation/machine/hexapod_geometry.hpp"
#include "foundation/machine/hexapod_motion.hpp"

namespace lambdajet {

struct HexapodMachine {
  std::string machine_id;
  HexapodGeometry geometry;
  HexapodMotion motion;
};

absl::StatusOr<HexapodMachine> ReadHexapodFile(const std::string& path);
absl::StatusOr<HexapodMachine> ParseHexapod(const std::string& yaml, const std::string& name);
std::string HexapodText(const HexapodMachine& machine);
// Of the canonical text: the same hexapod, the same 12 hex digits.
std::string HexapodHash(const HexapodMachine& machine);

}  // namespace lambdajet
