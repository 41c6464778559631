// Checks the arguments of a request and collects all that is wrong, up to 20 fields, before any work is done.
//
// Model: each check that fails adds a FieldViolation with the value, what would be right and a reason; status() is
// INVALID_ARGUMENT with the first one's reason, or OK. Nothing is clamped. No more than 256 bytes of a client's text are
// ever repeated to it.
// Reasons: NOT_FINITE, OUT_OF_RANGE, MUST_BE_POSITIVE, EMPTY, BAD_ID, NOT_UTF8, TOO_LARGE, TOO_FEW, TOO_MANY, or the
// caller's own with Require.
// Threads: one. Example:
//   ArgumentChecks checks;
//   checks.Id("machine_id", request.machine_id());
//   checks.InRange("feed_mm_per_s", request.feed_mm_per_s(), 0.1, 500.0, "mm/s");
//   if (!checks.ok()) return checks.status();
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "foundation/contract/trouble.hpp"

namespace lambdajet {

class ArgumentChecks {
 public:
  static constexpr std::size_t kMostViolations = 20;

  void Finite(std::string_view field, double value, std::string_view unit = "");
  void Positive(std::string_view field, double value, std::string_view unit = "");  // finite and above 0
  void InRange(std::string_view field, double value, double least, double most, std::string_view unit = "");
  void CountInRange(std::string_view field, std::size_t count, std::size_t least, std::size_t most);
  void NonEmpty(std::string_view field, std::string_view text);
  void Id(std::string_view field, std::string_view text);                            // [a-z0-9-]{1,63}
  void Text(std::string_view field, std::string_view text, std::size_t most_bytes);  // UTF-8, no NUL
  void Require(bool holds, std::string_view field, std::string_view reason, std::string_view description);

  // Every element of a packed batch: any container of double with begin() and end().
  template <typename Numbers>
  void AllFinite(std::string_view field, const Numbers& numbers) {
    std::size_t index = 0;
    for (const double number : numbers) {
      if (!IsFinite(number) && !full()) {
        Finite(std::string(field) + "[" + std::to_string(index) + "]", number);
      }
      ++index;
    }
  }

  bool ok() const { return violations_.empty(); }
  bool full() const { return violations_.size() >= kMostViolations; }
  absl::Status status() const;

 private:
  static bool IsFinite(double number);
  void Add(std::string_view field, std::string_view reason, std::string description);
  std::vector<FieldViolation> violations_;
};

bool IsUtf8(std::string_view text);  // no overlong forms, no surrogates

}  // namespace lambdajet
