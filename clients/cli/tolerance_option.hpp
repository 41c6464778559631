// Reads tolerances for a part of a program as they are typed: 20-40=0.05 for lines, 2=0.05 for a contour.
//
// Units: mm. Threads: any. Errors: nothing where the text is no such word.
#pragma once

#include <charconv>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace lambdajet::cli {

struct ToleranceWord {
  std::uint32_t first = 0;
  std::uint32_t last = 0;
  double tolerance_mm = 0.0;
};

inline std::optional<ToleranceWord> ParseTolerance(std::string_view text) {
  const auto equals = text.find('=');
  if (equals == std::string_view::npos) {
    return std::nullopt;
  }
  const std::string_view range = text.substr(0, equals), value = text.substr(equals + 1);
  const auto dash = range.find('-');
  ToleranceWord word;
  const auto read = [](std::string_view from, auto& to) {
    const auto [end, error] = std::from_chars(from.data(), from.data() + from.size(), to);
    return error == std::errc{} && end == from.data() + from.size();
  };
  const bool first = read(range.substr(0, dash), word.first);
  const bool last = dash == std::string_view::npos || read(range.substr(dash + 1), word.last);
  word.last = dash == std::string_view::npos ? word.first : word.last;
  const bool good =
      first && last && read(value, word.tolerance_mm) && word.first > 0 && word.first <= word.last;
  return good ? std::optional(word) : std::nullopt;
}

// For CLI11's check(): empty if good.
inline std::string ToleranceWordFault(const std::string& text) {
  return ParseTolerance(text) ? "" : "'" + text + "' is not like 20-40=0.05 (from-to=mm) or 2=0.05";
}

}  // namespace lambdajet::cli
