// Checks certificate files before gRPC reads them, so that what is wrong with one is said in words at start.
//
// Errors: those of ReadWholeFile; INVALID_ARGUMENT BAD_CERTIFICATE, BAD_KEY or KEY_MISMATCH with the file's name.
#pragma once

#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace lambdajet {

// The text of a PEM file of at most 1 MiB.
absl::StatusOr<std::string> ReadPem(const std::string& file);

// A PEM certificate (chain) and the private key that belongs to it.
absl::Status CheckKeyPair(const std::string& certificate_file, const std::string& key_file);

// At least one PEM certificate.
absl::Status CheckCertificates(const std::string& file);

}  // namespace lambdajet
