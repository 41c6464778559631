#include "trajectory/bus/own_hexapod.hpp"

#include "platform/machine_file/hexapod_file.hpp"

namespace lambdajet::trajectory {

OwnHexapod::OwnHexapod(ConfigSchema& schema) {
  schema.AddPath("hexapod_file", &file_,
                 "a hexapod to plan for as well, where a request names it; alone where no machine "
                 "description comes; empty: none");
}

absl::Status OwnHexapod::Read() {
  if (file_.empty()) {
    return absl::OkStatus();
  }
  const auto file = ReadHexapodFile(file_);
  if (file.ok()) {
    model_ = std::make_shared<const HexapodModel>(
        HexapodModel{file->machine_id, HexapodHash(*file), file->geometry, file->motion});
  }
  return file.status();
}

}  // namespace lambdajet::trajectory
