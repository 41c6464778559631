#include "trajectory/core/part_program/gcode_scan.hpp"

#include <array>
#include <charconv>

namespace lambdajet::trajectory {
namespace {

constexpr std::array<double, 16> kPowersOfTen = {1e0, 1e1, 1e2,  1e3,  1e4,  1e5,  1e6,  1e7,
                                                 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15};
constexpr int kMaxDigits = 40;
constexpr int kExactDigits = 15;

}  // namespace

bool LineScan::Take(std::string_view capitals) {
  const std::size_t from = at_;
  for (const char c : capitals) {
    if (Next() != c) {
      at_ = from;
      return false;
    }
    ++at_;
  }
  return true;
}

bool LineScan::Fail(const char* reason, std::size_t from, const char* message) {
  if (!failed()) {
    std::size_t end = at_ > from ? at_ : from + 1;
    while (end < line_.size() && (static_cast<unsigned char>(line_[end]) & 0xC0u) == 0x80u) {
      ++end;  // to the end of a character of several bytes
    }
    fault_ = {reason, static_cast<std::uint32_t>(from + 1), static_cast<std::uint32_t>(end - from), message};
  }
  return false;
}

// With up to 15 digits both integer and power of ten are exact doubles, and so is the rounding of their quotient; longer
// numbers take from_chars.
bool LineScan::Number(double& value, std::size_t word) {
  SkipSpaces();
  const std::size_t from = at_;
  bool negative = false;
  if (!AtEnd() && (line_[at_] == '-' || line_[at_] == '+')) {
    negative = line_[at_++] == '-';
  }
  std::uint64_t digits = 0;
  int count = 0, decimals = 0;
  bool point = false;
  for (; !AtEnd(); ++at_) {
    const char c = line_[at_];
    if (IsDigit(c)) {
      digits = digits * 10 + static_cast<std::uint64_t>(c - '0');
      ++count;
      decimals += point;
    } else if (c == '.' && !point) {
      point = true;
    } else if (!IsSpace(c)) {
      break;
    }
  }
  if (count == 0) {
    at_ = from;
    return false;
  }
  if (count > kExactDigits) {
    return LongNumber(from, word, value);
  }
  value = static_cast<double>(digits) / kPowersOfTen[static_cast<std::size_t>(decimals)];
  value = negative ? -value : value;
  return true;
}

bool LineScan::LongNumber(std::size_t from, std::size_t word, double& value) {
  std::array<char, kMaxDigits + 3> text{};
  std::size_t size = 0;
  for (std::size_t i = from; i < at_; ++i) {
    if (IsSpace(line_[i]) || line_[i] == '+') {
      continue;
    }
    if (size == text.size()) {
      return Fail("NUMBER_TOO_LONG", word, "a number has at most 40 digits");
    }
    text[size++] = line_[i];
  }
  const auto read = std::from_chars(text.data(), text.data() + size, value, std::chars_format::fixed);
  return read.ec == std::errc() || Fail("BAD_NUMBER", word, "not a number");
}

}  // namespace lambdajet::trajectory
