// Reads the bus' keys from their file.
//
// Model: one key a line, "<id 0 to 255> <at least 32 bytes in hex>"; '#' starts a comment. The first key signs, all of
// them are accepted, so a key is rotated by adding the new one everywhere, then moving it to the front, then removing
// the old one.
// Errors: FAILED_PRECONDITION KEY_FILE_OPEN_TO_OTHERS if others may read or write it, INVALID_ARGUMENT BAD_KEY_FILE with
// the line, and those of ReadWholeFile. No message shows key material.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"

namespace lambdajet {

struct GuardKey {
  std::uint8_t id = 0;
  std::vector<std::uint8_t> secret;
};

absl::StatusOr<std::vector<GuardKey>> ReadGuardKeys(const std::string& path);

}  // namespace lambdajet
