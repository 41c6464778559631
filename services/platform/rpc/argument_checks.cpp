#include "platform/rpc/argument_checks.hpp"

#include <cmath>
#include <cstdint>
#include <cstdio>

namespace lambdajet {
namespace {

constexpr std::size_t kMostEcho = 256;
constexpr std::size_t kMostIdBytes = 63;

std::string NumberText(double value, std::string_view unit) {
  char text[32];
  std::snprintf(text, sizeof text, "%.10g", value);
  return unit.empty() ? std::string(text) : std::string(text) + " " + std::string(unit);
}

// What of a client's text may be repeated: printable ASCII, the rest as '?'.
std::string Echo(std::string_view text) {
  std::string echo;
  for (const char c : text.substr(0, kMostEcho)) {
    echo += c >= 0x20 && c < 0x7f ? c : '?';
  }
  return "'" + echo + (text.size() > kMostEcho ? "…'" : "'");
}

// The bytes of one UTF-8 sequence from `text`, 0 if it is none.
std::size_t SequenceBytes(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<std::uint8_t>(text[i]); };
  if (byte(0) < 0x80) {
    return 1;
  }
  const std::size_t size = byte(0) >= 0xf0 ? 4 : byte(0) >= 0xe0 ? 3 : 2;
  if (byte(0) < 0xc2 || byte(0) > 0xf4 || text.size() < size) {
    return 0;
  }
  for (std::size_t i = 1; i < size; ++i) {
    if ((byte(i) & 0xc0) != 0x80) {
      return 0;
    }
  }
  const bool overlong = (byte(0) == 0xe0 && byte(1) < 0xa0) || (byte(0) == 0xf0 && byte(1) < 0x90);
  const bool surrogate = byte(0) == 0xed && byte(1) >= 0xa0;
  const bool beyond = byte(0) == 0xf4 && byte(1) >= 0x90;
  return overlong || surrogate || beyond ? 0 : size;
}

}  // namespace

bool IsUtf8(std::string_view text) {
  while (!text.empty()) {
    const std::size_t size = SequenceBytes(text);
    if (size == 0) {
      return false;
    }
    text.remove_prefix(size);
  }
  return true;
}

bool ArgumentChecks::IsFinite(double number) { return std::isfinite(number); }

void ArgumentChecks::Add(std::string_view field, std::string_view reason, std::string description) {
  if (!full()) {
    violations_.push_back({std::string(field), std::move(description), std::string(reason)});
  }
}

void ArgumentChecks::Finite(std::string_view field, double value, std::string_view unit) {
  if (!std::isfinite(value)) {
    Add(field, "NOT_FINITE", "is " + NumberText(value, unit) + "; right is a finite number");
  }
}

void ArgumentChecks::Positive(std::string_view field, double value, std::string_view unit) {
  if (!std::isfinite(value)) {
    Finite(field, value, unit);
  } else if (value <= 0.0) {
    Add(field, "MUST_BE_POSITIVE", "is " + NumberText(value, unit) + "; right is a number above 0");
  }
}

void ArgumentChecks::InRange(std::string_view field, double value, double least, double most,
                             std::string_view unit) {
  if (!std::isfinite(value)) {
    Finite(field, value, unit);
  } else if (value < least || value > most) {
    Add(field, "OUT_OF_RANGE",
        "is " + NumberText(value, unit) + "; right is " + NumberText(least, "") + " to " +
            NumberText(most, unit));
  }
}

void ArgumentChecks::CountInRange(std::string_view field, std::size_t count, std::size_t least,
                                  std::size_t most) {
  if (count < least || count > most) {
    Add(field, count < least ? "TOO_FEW" : "TOO_MANY",
        "has " + std::to_string(count) + " entries; right is " + std::to_string(least) + " to " +
            std::to_string(most));
  }
}

void ArgumentChecks::NonEmpty(std::string_view field, std::string_view text) {
  if (text.empty()) {
    Add(field, "EMPTY", "is empty; right is a text");
  }
}

void ArgumentChecks::Id(std::string_view field, std::string_view text) {
  const bool good = !text.empty() && text.size() <= kMostIdBytes &&
                    text.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789-") == std::string_view::npos;
  if (text.empty()) {
    Add(field, "EMPTY", "is empty; right is 1 to 63 of a-z, 0-9 and '-'");
  } else if (!good) {
    Add(field, "BAD_ID", "is " + Echo(text) + "; right is 1 to 63 of a-z, 0-9 and '-'");
  }
}

void ArgumentChecks::Text(std::string_view field, std::string_view text, std::size_t most_bytes) {
  if (text.size() > most_bytes) {
    Add(field, "TOO_LARGE",
        "has " + std::to_string(text.size()) + " bytes; right is at most " + std::to_string(most_bytes));
  } else if (text.find('\0') != std::string_view::npos || !IsUtf8(text)) {
    Add(field, "NOT_UTF8", "holds a byte that is not UTF-8, or a NUL; right is UTF-8 text");
  }
}

void ArgumentChecks::Require(bool holds, std::string_view field, std::string_view reason,
                             std::string_view description) {
  if (!holds) {
    Add(field, reason, std::string(description));
  }
}

absl::Status ArgumentChecks::status() const {
  if (ok()) {
    return absl::OkStatus();
  }
  const FieldViolation& first = violations_.front();
  std::string message = first.field + " " + first.description;
  if (violations_.size() > 1) {
    message += "; and " + std::to_string(violations_.size() - 1) + " more";
  }
  return InvalidFields(first.reason, message, violations_);
}

}  // namespace lambdajet
