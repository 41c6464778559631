#include "trajectory/core/part_program/gcode_words.hpp"

#include <charconv>
#include <cmath>

namespace lambdajet::trajectory {
namespace {

constexpr std::array<double, 23> kPowersOfTen = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,
                                                 1e8,  1e9,  1e10, 1e11, 1e12, 1e13, 1e14, 1e15,
                                                 1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};
constexpr int kMaxDigits = 40;

bool IsSpace(char c) { return c == ' ' || c == '\t' || c == '\r'; }
bool IsDigit(char c) { return static_cast<unsigned char>(c - '0') < 10; }
char Upper(char c) { return static_cast<unsigned char>(c - 'a') < 26 ? static_cast<char>(c - 32) : c; }

class LineParser {
 public:
  LineParser(std::string_view line, Block& block) : line_(line), block_(block) {}

  LineParse Parse() {
    SkipSpaces();
    if (!AtEnd() && line_[at_] == '%') {
      return Percent();
    }
    if (!AtEnd() && line_[at_] == '/') {
      result_.deleted = true;
      ++at_;
    }
    while (Words()) {
    }
    return result_;
  }

 private:
  bool AtEnd() const { return at_ >= line_.size(); }
  void SkipSpaces() {
    while (!AtEnd() && IsSpace(line_[at_])) {
      ++at_;
    }
  }
  std::uint32_t Column() const { return static_cast<std::uint32_t>(at_ + 1); }

  bool Fail(const char* reason, std::size_t from, const char* message) {
    result_.fault = {reason, static_cast<std::uint32_t>(from + 1),
                     static_cast<std::uint32_t>(at_ > from ? at_ - from : 1), message};
    return false;
  }

  LineParse Percent() {
    const std::size_t from = at_++;
    SkipSpaces();
    if (AtEnd()) {
      result_.percent = true;
    } else {
      Fail("PERCENT_NOT_ALONE", from, "a percent sign stands alone in its line");
    }
    return result_;
  }

  // One word or comment; false at the end of the line or at a fault.
  bool Words() {
    SkipSpaces();
    if (AtEnd() || line_[at_] == ';') {
      return false;
    }
    const char c = Upper(line_[at_]);
    if (c >= 'A' && c <= 'Z') {
      return Word(c);
    }
    if (c == '(') {
      return Comment();
    }
    return FailCharacter();
  }

  bool FailCharacter() {
    switch (line_[at_]) {
      case '/':
        return Fail("BLOCK_DELETE_NOT_FIRST", at_,
                    "a slash stands first in its line; division belongs into [ ]");
      case '#':
        return Fail("PARAMETERS_NOT_SUPPORTED", at_, "write the number itself, parameters are not read");
      case ')':
        return Fail("COMMENT_NOT_OPEN", at_, "a closing bracket without an opening one");
      case '%':
        return Fail("PERCENT_NOT_ALONE", at_, "a percent sign stands alone in its line");
      default:
        return Fail("BAD_CHARACTER", at_, "a letter of a word was expected here");
    }
  }

  bool Comment() {
    const std::size_t from = at_;
    for (++at_; !AtEnd(); ++at_) {
      if (line_[at_] == ')') {
        ++at_;
        return true;
      }
      if (line_[at_] == '(') {
        return Fail("COMMENT_NESTED", at_, "a comment within a comment; close the first one before");
      }
    }
    at_ = line_.size();
    return Fail("COMMENT_NOT_CLOSED", from, "a comment ends with ) in its own line");
  }

  bool Word(char letter) {
    const std::size_t from = at_++;
    if (letter == 'O') {
      return Fail("O_WORD_NOT_SUPPORTED", from,
                  "subroutines and loops are not read; have the CAM system write them out");
    }
    double value = 0.0;
    if (!Number(from, value)) {
      return false;
    }
    return letter == 'G' || letter == 'M' ? AddCode(letter, from, value)
           : letter == 'N'                ? true
                                          : AddWord(letter, from, value);
  }

  bool AddCode(char letter, std::size_t from, double value) {
    const double tenfold = value * 10.0;
    const double rounded = std::round(tenfold);
    if (value < 0.0 || value > 1000.0 || std::abs(tenfold - rounded) > 1e-6) {
      return Fail("UNKNOWN_CODE", from, "a code is a number with at most one decimal, as in G61.1");
    }
    int& count = letter == 'G' ? block_.g_count : block_.m_count;
    if (count == kMaxCodesPerLine) {
      return Fail("TOO_MANY_CODES", from, "at most 16 G or M codes stand in a line");
    }
    (letter == 'G' ? block_.g : block_.m)[static_cast<std::size_t>(count++)] = {
        static_cast<int>(rounded), static_cast<std::uint32_t>(from + 1)};
    return true;
  }

  bool AddWord(char letter, std::size_t from, double value) {
    const auto index = static_cast<std::size_t>(letter - 'A');
    if (block_.has(letter)) {
      return Fail("WORD_TWICE", from, "the same letter stands twice in this line");
    }
    block_.present |= 1u << index;
    block_.value[index] = value;
    block_.column[index] = static_cast<std::uint32_t>(from + 1);
    return true;
  }

  // Sign, digits, point, digits. With up to 15 digits both integer and power of ten are exact doubles, and so is the
  // rounding of their quotient; longer numbers take from_chars.
  bool Number(std::size_t word, double& value) {
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
      return FailNumber(word);
    }
    if (count > 15) {
      return LongNumber(word, from, value);
    }
    value = static_cast<double>(digits) / kPowersOfTen[static_cast<std::size_t>(decimals)];
    value = negative ? -value : value;
    return true;
  }

  bool FailNumber(std::size_t word) {
    if (!AtEnd() && line_[at_] == '#') {
      return Fail("PARAMETERS_NOT_SUPPORTED", word, "write the number itself, parameters are not read");
    }
    if (!AtEnd() && line_[at_] == '[') {
      return Fail("EXPRESSIONS_NOT_SUPPORTED", word, "write the number itself, expressions are not read");
    }
    return Fail("BAD_NUMBER", word, "a number was expected after the letter");
  }

  bool LongNumber(std::size_t word, std::size_t from, double& value) {
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

  std::string_view line_;
  Block& block_;
  std::size_t at_ = 0;
  LineParse result_;
};

}  // namespace

LineParse ParseLine(std::string_view line, Block& block) {
  block.Clear();
  return LineParser(line, block).Parse();
}

}  // namespace lambdajet::trajectory
