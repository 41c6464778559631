// Writes a file so that a reader, or a restart after a crash, finds the old content or the new, never half.
//
// Model: temporary file beside it, fsync, rename, fsync of the folder.
// Errors: RESOURCE_EXHAUSTED DISK_FULL, PERMISSION_DENIED NOT_PERMITTED, NOT_FOUND NO_SUCH_FILE, INTERNAL
// FILE_TROUBLE.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace lambdajet {

absl::Status WriteFileAtomically(const std::string& path, std::string_view content);

// Whether WriteFileAtomically could write there now, tried with an empty file that does not stay: for a start that shall
// fail early rather than late.
absl::Status CheckFileCanBeWritten(const std::string& path);

// The whole file; refuses one larger than `most_bytes` (OUT_OF_RANGE FILE_TOO_LARGE) and anything but a
// regular file.
absl::StatusOr<std::string> ReadWholeFile(const std::string& path, std::size_t most_bytes);

}  // namespace lambdajet
