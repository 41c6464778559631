#include "foundation/contract/trouble.hpp"

#include <cstdio>

namespace lambdajet {
namespace {

constexpr std::string_view kReasonUrl = "lambdajet/reason";
constexpr std::string_view kDetailUrl = "lambdajet/detail/";
constexpr std::string_view kViolationUrl = "lambdajet/violation/";
constexpr char kFieldEnd = '\x1f';  // unit separator: cannot stand in a field path or a reason

absl::string_view View(std::string_view text) { return {text.data(), text.size()}; }
std::string_view View(absl::string_view text) { return {text.data(), text.size()}; }

}  // namespace

absl::Status Trouble(absl::StatusCode code, std::string_view reason, std::string_view message,
                     const TroubleDetails& details) {
  absl::Status status(code, View(message));
  status.SetPayload(View(kReasonUrl), absl::Cord(View(reason)));
  for (const auto& [key, value] : details) {
    status.SetPayload(std::string(kDetailUrl) + key, absl::Cord(value));
  }
  return status;
}

absl::Status InvalidFields(std::string_view reason, std::string_view message,
                           const std::vector<FieldViolation>& violations) {
  absl::Status status = Trouble(absl::StatusCode::kInvalidArgument, reason, message);
  AttachViolations(status, violations);
  return status;
}

void AttachViolations(absl::Status& status, const std::vector<FieldViolation>& violations) {
  for (std::size_t i = 0; i < violations.size(); ++i) {
    char number[8];
    std::snprintf(number, sizeof number, "%04zu", i % 10000);  // payloads are visited in no stated order
    status.SetPayload(std::string(kViolationUrl) + number,
                      absl::Cord(violations[i].field + kFieldEnd + violations[i].reason + kFieldEnd +
                                 violations[i].description));
  }
}

std::string TroubleReason(const absl::Status& status) {
  const auto reason = status.GetPayload(View(kReasonUrl));
  return reason ? std::string(*reason) : std::string();
}

std::map<std::string, std::string> TroubleDetailsOf(const absl::Status& status) {
  std::map<std::string, std::string> details;
  status.ForEachPayload([&details](absl::string_view url, const absl::Cord& value) {
    if (View(url).starts_with(kDetailUrl)) {
      details[std::string(View(url).substr(kDetailUrl.size()))] = std::string(value);
    }
  });
  return details;
}

std::vector<FieldViolation> TroubleViolations(const absl::Status& status) {
  std::map<std::string, FieldViolation> in_order;
  status.ForEachPayload([&in_order](absl::string_view url, const absl::Cord& value) {
    if (!View(url).starts_with(kViolationUrl)) {
      return;
    }
    const std::string text(value);
    const std::size_t first = text.find(kFieldEnd);
    const std::size_t second = text.find(kFieldEnd, first + 1);
    if (second != std::string::npos) {
      in_order[std::string(View(url))] = {text.substr(0, first), text.substr(second + 1),
                                          text.substr(first + 1, second - first - 1)};
    }
  });
  std::vector<FieldViolation> violations;
  for (auto& [url, violation] : in_order) {
    violations.push_back(std::move(violation));
  }
  return violations;
}

}  // namespace lambdajet
