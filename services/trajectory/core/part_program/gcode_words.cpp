#include "trajectory/core/part_program/gcode_words.hpp"

#include <cmath>

#include "trajectory/core/part_program/gcode_expression.hpp"

namespace lambdajet::trajectory {
namespace {

class LineParser {
 public:
  LineParser(std::string_view line, Block& block, Parameters& parameters)
      : scan_(line), block_(block), parameters_(parameters) {}

  LineParse Parse() {
    const char first = scan_.Next();
    if (first == '%') {
      Percent();
    } else {
      if (first == '/') {
        result_.deleted = true;
        scan_.Step();
      }
      while (OneItem()) {
      }
    }
    result_.fault = scan_.fault();
    return result_;
  }

 private:
  void Percent() {
    const std::size_t from = scan_.at();
    scan_.Step();
    if (scan_.Next() == '\0' && scan_.AtEnd()) {
      result_.percent = true;
    } else {
      scan_.Fail("PERCENT_NOT_ALONE", from, "a percent sign stands alone in its line");
    }
  }

  // One word, comment or setting; false at the end of the line or at a fault.
  bool OneItem() {
    const char c = scan_.Next();
    if (scan_.AtEnd()) {
      return false;
    }
    if (c >= 'A' && c <= 'Z') {
      return Word(c);
    }
    switch (c) {
      case '$':
        return Spindle();
      case ';':
        result_.abort_column = 0;  // only the last comment of a line is active
        return false;
      case '(':
        return Comment();
      case '#':
        return ReadSetting(scan_, parameters_);
      default:
        return FailCharacter();
    }
  }

  bool FailCharacter() {
    switch (scan_.Next()) {
      case '/':
        return scan_.Fail("BLOCK_DELETE_NOT_FIRST", scan_.at(),
                          "a slash stands first in its line; division belongs into [ ]");
      case ')':
        return scan_.Fail("COMMENT_NOT_OPEN", scan_.at(), "a closing bracket without an opening one");
      case '%':
        return scan_.Fail("PERCENT_NOT_ALONE", scan_.at(), "a percent sign stands alone in its line");
      case '[':
      case ']':
        return scan_.Fail("BRACKET_WITHOUT_WORD", scan_.at(),
                          "an expression stands after the letter of a word; is a bracket too many?");
      case '@':
      case '^':
        return scan_.Fail("POLAR_NOT_SUPPORTED", scan_.at(), "write the point in X and Y");
      default:
        return scan_.Fail("BAD_CHARACTER", scan_.at(), "a letter of a word was expected here");
    }
  }

  bool Comment() {
    const std::size_t from = scan_.at();
    const std::string_view line = scan_.line();
    for (scan_.Step(); !scan_.AtEnd(); scan_.Step()) {
      const char c = line[scan_.at()];
      if (c == ')') {
        scan_.Step();
        LineScan inside(line, from + 1);
        result_.abort_column = inside.Take("ABORT,") ? static_cast<std::uint32_t>(from + 1) : 0;
        return true;
      }
      if (c == '(') {
        return scan_.Fail("COMMENT_NESTED", scan_.at(),
                          "a comment within a comment; close the first one before");
      }
    }
    return scan_.Fail("COMMENT_NOT_CLOSED", from, "a comment ends with ) in its own line");
  }

  bool Word(char letter) {
    const std::size_t from = scan_.at();
    scan_.Step();
    if (letter == 'O') {
      return FlowWord(from);
    }
    double value = 0.0;
    if (!Value(value, from)) {
      return false;
    }
    if (letter == 'G' || letter == 'M') {
      return AddCode(letter, from, value);
    }
    return letter == 'N' ? LineNumber(from, value) : AddWord(letter, from, value);
  }

  bool Value(double& value, std::size_t from) {
    return scan_.Number(value, from) || (!scan_.failed() && ReadValue(scan_, parameters_, from, value));
  }

  bool LineNumber(std::size_t from, double value) {
    if (numbered_ || !block_.empty() || parameters_.pending()) {
      return scan_.Fail("LINE_NUMBER_NOT_FIRST", from, "N stands once, before the other words of its line");
    }
    numbered_ = true;
    return value >= 0.0 || scan_.Fail("LINE_NUMBER_NEGATIVE", from, "N takes a number from 0");
  }

  // $0, the first spindle, is what M3 and M5 switch without it, too.
  bool Spindle() {
    const std::size_t from = scan_.at();
    scan_.Step();
    double value = 0.0;
    return Value(value, from) &&
           (value == 0.0 || scan_.Fail("SPINDLE_UNKNOWN", from, "this machine has one jet or spindle, $0"));
  }

  bool FlowWord(std::size_t from) {
    if (!block_.empty() || parameters_.pending()) {
      return scan_.Fail("O_WORD_NOT_ALONE", from, "an O-word stands in a line of its own");
    }
    result_.flow = true;
    return false;
  }

  bool AddCode(char letter, std::size_t from, double value) {
    const double tenfold = value * 10.0;
    const double rounded = std::round(tenfold);
    if (!(value > -0.01 && value <= 1000.0 && std::abs(tenfold - rounded) <= 1e-4)) {
      return scan_.Fail("UNKNOWN_CODE", from, "a code is a number with at most one decimal, as in G61.1");
    }
    int& count = letter == 'G' ? block_.g_count : block_.m_count;
    if (count == kMaxCodesPerLine) {
      return scan_.Fail("TOO_MANY_CODES", from, "at most 16 G or M codes stand in a line");
    }
    (letter == 'G' ? block_.g : block_.m)[static_cast<std::size_t>(count++)] = {
        static_cast<int>(rounded), static_cast<std::uint32_t>(from + 1)};
    return true;
  }

  bool AddWord(char letter, std::size_t from, double value) {
    const auto index = static_cast<std::size_t>(letter - 'A');
    if (block_.has(letter)) {
      return scan_.Fail("WORD_TWICE", from, "the same letter stands twice in this line");
    }
    block_.present |= LetterBit(letter);
    block_.value[index] = value;
    block_.column[index] = static_cast<std::uint32_t>(from + 1);
    return true;
  }

  LineScan scan_;
  Block& block_;
  Parameters& parameters_;
  LineParse result_;
  bool numbered_ = false;
};

}  // namespace

LineParse ParseLine(std::string_view line, Block& block, Parameters& parameters) {
  block.Clear();
  return LineParser(line, block, parameters).Parse();
}

}  // namespace lambdajet::trajectory
