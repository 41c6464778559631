// Reads and writes whole text files; "-" is standard input or output.
//
// Errors: NOT_FOUND, INVALID_ARGUMENT (reason FILE_TOO_LARGE over 128 MiB), UNAVAILABLE never: a disk that is
// full is INTERNAL with reason FILE_NOT_WRITTEN. Threads: any.
#pragma once

#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace lambdajet::cli {

absl::StatusOr<std::string> ReadTextFile(const std::string& path);
absl::Status WriteTextFile(const std::string& path, std::string_view text);

}  // namespace lambdajet::cli
