#include "kinematics/bus/own_hexapod.hpp"

#include "platform/machine_file/hexapod_file.hpp"

namespace lambdajet::kinematics {

absl::StatusOr<std::shared_ptr<const OwnHexapod>> ReadOwnHexapod(const std::string& path) {
  if (path.empty()) {
    return nullptr;
  }
  const auto file = ReadHexapodFile(path);
  if (!file.ok()) {
    return file.status();
  }
  return std::make_shared<const OwnHexapod>(
      OwnHexapod{file->machine_id, HexapodHash(*file), Hexapod(file->geometry)});
}

}  // namespace lambdajet::kinematics
