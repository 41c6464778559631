#include "platform/rpc/status_mapping.hpp"

#include <grpcpp/support/status.h>

#include "foundation/contract/trouble.hpp"
#include "lambdajet/type/v1/error.pb.h"

namespace lambdajet {
namespace {

namespace v1 = lambdajet::type::v1;

constexpr char kErrorInfoUrl[] = "type.googleapis.com/google.rpc.ErrorInfo";
constexpr char kBadRequestUrl[] = "type.googleapis.com/google.rpc.BadRequest";
constexpr char kDomain[] = "lambdajet";

// INVALID_ARGUMENT and so on: already UPPER_SNAKE.
std::string ReasonOf(const absl::Status& status) {
  const std::string reason = TroubleReason(status);
  return reason.empty() ? absl::StatusCodeToString(status.code()) : reason;
}

v1::Status Details(const absl::Status& status) {
  v1::Status details;
  details.set_code(static_cast<int>(status.code()));
  details.set_message(std::string(status.message()));
  v1::ErrorInfo info;
  info.set_reason(ReasonOf(status));
  info.set_domain(kDomain);
  for (const auto& [key, value] : TroubleDetailsOf(status)) {
    (*info.mutable_metadata())[key] = value;
  }
  auto* any = details.add_details();
  any->set_type_url(kErrorInfoUrl);
  any->set_value(info.SerializeAsString());
  v1::BadRequest bad_request;
  for (const FieldViolation& violation : TroubleViolations(status)) {
    auto* entry = bad_request.add_field_violations();
    entry->set_field(violation.field);
    entry->set_description(violation.description);
    entry->set_reason(violation.reason);
  }
  if (bad_request.field_violations_size() > 0) {
    any = details.add_details();
    any->set_type_url(kBadRequestUrl);
    any->set_value(bad_request.SerializeAsString());
  }
  return details;
}

}  // namespace

grpc::Status ToWire(const absl::Status& status) {
  if (status.ok()) {
    return grpc::Status::OK;
  }
  return {static_cast<grpc::StatusCode>(status.code()), std::string(status.message()),
          Details(status).SerializeAsString()};
}

absl::Status FromWire(const grpc::Status& status) {
  if (status.ok()) {
    return absl::OkStatus();
  }
  const auto code = static_cast<absl::StatusCode>(status.error_code());
  v1::Status details;
  v1::ErrorInfo info;
  std::vector<FieldViolation> violations;
  if (details.ParseFromString(status.error_details())) {
    for (const auto& any : details.details()) {
      v1::BadRequest bad_request;
      if (any.type_url() == kErrorInfoUrl) {
        info.ParseFromString(any.value());
      } else if (any.type_url() == kBadRequestUrl && bad_request.ParseFromString(any.value())) {
        for (const auto& entry : bad_request.field_violations()) {
          violations.push_back({entry.field(), entry.description(), entry.reason()});
        }
      }
    }
  }
  // A call refused before its handler has no room for details: the reason stands before the words.
  const std::string& message = status.error_message();
  constexpr std::string_view kRefusedByRole = "ROLE_NOT_ALLOWED: ";
  if (info.reason().empty() && code == absl::StatusCode::kPermissionDenied &&
      message.starts_with(kRefusedByRole)) {
    return Trouble(code, "ROLE_NOT_ALLOWED", message.substr(kRefusedByRole.size()));
  }
  const TroubleDetails metadata(info.metadata().begin(), info.metadata().end());
  const std::string reason = info.reason().empty() ? absl::StatusCodeToString(code) : info.reason();
  absl::Status trouble = Trouble(code, reason, status.error_message(), metadata);
  AttachViolations(trouble, violations);
  return trouble;
}

}  // namespace lambdajet
