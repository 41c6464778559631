// Says that the work could not be done, as an absl::Status that also carries a machine-readable reason.
//
// Model: the third kind of bad news (bug, answer, trouble). The reason (UPPER_SNAKE), the details and the
// field violations are payloads of the status; platform/rpc/status_mapping turns them into
// google.rpc.ErrorInfo and BadRequest on the wire and back, so a client reads the same trouble that the
// service wrote. Errors: an absl::OkStatus has no reason, no details and no violations. Threads: values.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/status/status.h"

namespace lambdajet {

// One field of a request that is not as it must be.
struct FieldViolation {
  std::string field;        // dotted path in the request, as "poses[3].x_mm"
  std::string description;  // value with its unit, and what would be right
  std::string reason;       // UPPER_SNAKE
  friend bool operator==(const FieldViolation&, const FieldViolation&) = default;
};

using TroubleDetails = std::vector<std::pair<std::string, std::string>>;

// Message: what was wrong, the value with its unit, and what would be right. A detail's key is snake_case.
absl::Status Trouble(absl::StatusCode code, std::string_view reason, std::string_view message,
                     const TroubleDetails& details = {});

// Trouble of code INVALID_ARGUMENT that names its fields.
absl::Status InvalidFields(std::string_view reason, std::string_view message,
                           const std::vector<FieldViolation>& violations);

// What Trouble() and InvalidFields() wrote; empty if the status does not come from them.
std::string TroubleReason(const absl::Status& status);
std::map<std::string, std::string> TroubleDetailsOf(const absl::Status& status);
std::vector<FieldViolation> TroubleViolations(const absl::Status& status);

// Puts violations on a status that has come from elsewhere, as a client does with what it reads from the
// wire.
void AttachViolations(absl::Status& status, const std::vector<FieldViolation>& violations);

}  // namespace lambdajet
