// Reads and writes the YAML file that describes one machine (foundation/machine).
//
// Model: every key is required but `covariance`; each parameter has a value and, in its own unit, a one-sigma figure, and
// the covariance is diagonal from these unless `covariance` gives all of it (19 rows of 19, in the order of the
// parameter vector). What has been read is checked by Validate(). Written text is canonical: a fixed order of keys and
// the shortest digits that read back to the same number, so equal machines give equal text.
// Hash: the first 12 hex digits of SHA-256 over the canonical text without machine_id and version: two machines with the
// same hash calculate the same.
// Units: in the keys. Threads: any.
// Errors: INVALID_ARGUMENT BAD_MACHINE_FILE with up to 20 violations, each with key, value, unit and line; those of
// ReadWholeFile; of DescribedMachine BAD_MACHINE_DESCRIPTION and DESCRIPTION_HASH_MISMATCH.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "absl/status/statusor.h"
#include "foundation/machine/machine_description.hpp"

namespace lambdajet {

absl::StatusOr<MachineDescription> ReadMachineFile(const std::string& path);

// `name` stands for the file in messages.
absl::StatusOr<MachineDescription> ParseMachine(const std::string& yaml, const std::string& name);

std::string MachineText(const MachineDescription& machine);
absl::Status WriteMachineFile(const std::string& path, const MachineDescription& machine);  // atomically

// What `machine.hash` must be; set it after every change.
std::string MachineHash(const MachineDescription& machine);

// The first 12 hex digits of SHA-256.
std::string ContentHash(const std::string& text);

// A machine as calibration describes it on the bus: the as-designed file as text, with parameters and covariance (row by row)
// in the place of its own, and the hash that its writer made of both.
struct DescribedParts {
  std::string as_designed_yaml;
  std::span<const double> parameters;
  std::span<const double> covariance;
  std::uint32_t version = 0;
  std::string hash;
};
absl::StatusOr<MachineDescription> DescribedMachine(const DescribedParts& parts);

}  // namespace lambdajet
