#include "trajectory/core/part_program/cldata_words.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>

#include "trajectory/core/part_program/cldata_majors.hpp"

namespace lambdajet::trajectory {
namespace {

constexpr std::size_t kLongestLine = 1000;

constexpr std::array<std::string_view, 8> kTakeText = {"PARTNO", "PPRINT", "REMARK", "INSERT",
                                                       "TPRINT", "OPNAME", "MACHIN", "PAINT"};

bool Blank(char c) { return c == ' ' || c == '\t'; }
char Upper(char c) { return c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c; }
bool Letter(char c) { return Upper(c) >= 'A' && Upper(c) <= 'Z'; }
bool Digit(char c) { return c >= '0' && c <= '9'; }

std::string Squeezed(std::string_view text) {
  std::string word;
  for (const char c : text) {
    if (!Blank(c)) {
      word += Upper(c);
    }
  }
  return word;
}

// Where the comment begins that "$" or "$$" opens outside of quotes; the line's size if there is none.
std::size_t CommentAt(std::string_view line) {
  bool quoted = false;
  for (std::size_t i = 0; i < line.size(); ++i) {
    quoted = quoted != (line[i] == '\'');
    if (line[i] == '$' && !quoted) {
      return i;
    }
  }
  return line.size();
}

bool ReadNumber(std::string_view text, double& value) {
  if (!text.empty() && text.front() == '+') {
    text.remove_prefix(1);
  }
  if (text.empty() || !(Digit(text.front()) || text.front() == '.' || text.front() == '-')) {
    return false;
  }
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size() && std::isfinite(value);
}

// Behind these comments of Creo stands a statement of its own notation, which may go on over lines.
constexpr std::string_view kCreoComment = "$$->";

bool TakesText(std::string_view major) {
  return std::find(kTakeText.begin(), kTakeText.end(), major) != kTakeText.end();
}

}  // namespace

CldataPlace CldataLines::PlaceOf(std::size_t from, std::size_t to) const {
  return {line_number_, static_cast<std::uint32_t>(from + 1),
          line_.substr(from, std::min<std::size_t>(to - from, 60))};
}

bool CldataLines::Refuse(CldataFault& fault, std::size_t from, std::size_t to, const char* reason,
                         const char* message) const {
  fault = {reason, PlaceOf(from, to), message};
  return false;
}

bool CldataLines::NextLine() {
  if (at_ >= text_.size()) {
    return false;
  }
  const std::size_t end = std::min(text_.find('\n', at_), text_.size());
  line_ = text_.substr(at_, end - at_);
  at_ = end + 1;
  ++line_number_;
  if (!line_.empty() && line_.back() == '\r') {
    line_.remove_suffix(1);
  }
  return true;
}

bool CldataLines::Next(CldataStatement& statement, CldataFault& fault) {
  fault = {};
  while (NextLine()) {
    const std::size_t first = line_.find_first_not_of(" \t");
    if (first == std::string_view::npos || line_.substr(first).starts_with("$$")) {
      SkipComment(first);
      continue;
    }
    Scan(statement, fault);
    if (fault.reason != nullptr) {
      SkipContinued();
    }
    return true;
  }
  return false;
}

void CldataLines::SkipComment(std::size_t first) {
  if (first != std::string_view::npos && line_.substr(first).starts_with(kCreoComment)) {
    while (line_.find_last_not_of(" \t") != std::string_view::npos &&
           line_[line_.find_last_not_of(" \t")] == '$' && NextLine()) {
    }
  }
}

// Whether the comment that begins there is the mark by which the line goes on in the next.
bool CldataLines::Continued(std::size_t comment) const {
  return comment < line_.size() && (comment + 1 == line_.size() || line_[comment + 1] != '$');
}

// The rest of a statement that is not read is no statement of its own.
void CldataLines::SkipContinued() {
  while (Continued(CommentAt(line_)) && NextLine()) {
  }
}

void CldataLines::Scan(CldataStatement& statement, CldataFault& fault) {
  statement.parameters.clear();
  if (line_.size() > kLongestLine) {
    Refuse(fault, kLongestLine, line_.size(), "LINE_TOO_LONG", "a line has at most 1000 characters");
    return;
  }
  const std::size_t first = line_.find_first_not_of(" \t");
  std::size_t at = first;
  while (at < line_.size() &&
         (Letter(line_[at]) || Digit(line_[at]) || Blank(line_[at]) || line_[at] == '-')) {
    ++at;
    if (const auto word = Squeezed(line_.substr(first, at - first)); word.size() == 6 && TakesText(word)) {
      break;
    }
  }
  std::size_t word_end = at;
  while (word_end > first && Blank(line_[word_end - 1])) {
    --word_end;
  }
  statement.place = PlaceOf(first, word_end);
  statement.major = Squeezed(statement.place.text);
  if (TakesText(statement.major)) {
    return;
  }
  if (!Letter(line_[first])) {
    Refuse(fault, first, first + 1, "BAD_CHARACTER", "a statement begins with a word, as in GOTO/10,20,0");
    return;
  }
  const std::optional<CldataMajor> word = FindCldataMajor(statement.major);
  const bool of_letters = std::all_of(statement.major.begin(), statement.major.end(), Letter);
  const bool written =
      at >= line_.size() || line_[at] == '/' || line_[at] == '$' || (line_[at] == ',' && of_letters);
  if (written && word.value_or(CldataMajor::kText) == CldataMajor::kText) {
    SkipContinued();  // what describes, or is refused by its first word, is not looked at
    return;
  }
  Parameters(statement, fault, at);
}

// From behind the major word to the end of the statement, over continued lines.
bool CldataLines::Parameters(CldataStatement& statement, CldataFault& fault, std::size_t at) {
  std::size_t end = CommentAt(line_);
  const auto continued = [&] { return Continued(end); };
  if (at < end && line_[at] == '=') {
    return Refuse(
        fault, at, at + 1, "APT_SOURCE",
        "this is APT source with definitions; send the cutter location file that its processor makes");
  }
  if (at < end && line_[at] != '/') {
    return Refuse(fault, at, at + 1, "BAD_CHARACTER", "a slash must stand between a word and its parameters");
  }
  if (at >= end) {
    return !continued() ||
           Refuse(fault, end, end + 1, "CONTINUATION_MISPLACED", "nothing is here to go on with");
  }
  ++at;
  while (true) {
    std::size_t comma = at;
    for (bool quoted = false; comma < end && (quoted || line_[comma] != ','); ++comma) {
      quoted = quoted != (line_[comma] == '\'');
    }
    const bool last_of_line = comma == end;
    const bool goes_on = last_of_line && continued();
    const bool blank = line_.substr(at, comma - at).find_first_not_of(" \t") == std::string_view::npos;
    if (!(goes_on && blank) && !Parameter(statement, fault, at, comma)) {
      return false;
    }
    at = comma + 1;
    if (last_of_line && !goes_on) {
      return true;
    }
    if (goes_on) {
      if (!NextLine()) {
        return Refuse(fault, 0, line_.size(), "CONTINUATION_MISSING", "the line goes on, but the file ends");
      }
      if (line_.size() > kLongestLine) {
        return Refuse(fault, kLongestLine, line_.size(), "LINE_TOO_LONG",
                      "a line has at most 1000 characters");
      }
      end = CommentAt(line_);
      at = 0;
      // The comma may stand at the end of a line or begin the next.
      const std::size_t first = std::min(line_.find_first_not_of(" \t"), line_.size());
      if (!blank && (first == line_.size() || line_[first] != ',')) {
        return Refuse(fault, first, first + 1, "COMMA_MISSING", "a comma must stand between two parameters");
      }
      at = blank ? 0 : first + 1;
    }
  }
}

bool CldataLines::Parameter(CldataStatement& statement, CldataFault& fault, std::size_t from,
                            std::size_t to) {
  while (from < to && Blank(line_[from])) {
    ++from;
  }
  while (to > from && Blank(line_[to - 1])) {
    --to;
  }
  if (from == to) {
    return Refuse(fault, std::min(from, line_.size()), from, "PARAMETER_MISSING",
                  "a comma or slash has nothing behind it");
  }
  if (statement.parameters.size() == kMostParameters) {
    return Refuse(fault, from, to, "TOO_MANY_PARAMETERS", "a statement has at most 64 parameters");
  }
  CldataParameter& p = statement.parameters.emplace_back();
  p.place = PlaceOf(from, to);
  const std::string squeezed =
      Squeezed(p.place.text.size() < to - from ? line_.substr(from, to - from) : p.place.text);
  p.is_number = ReadNumber(squeezed, p.value);
  if (p.is_number) {
    return true;
  }
  p.word = squeezed;
  if (p.word.front() == '\'') {
    return (p.word.size() > 1 && p.word.back() == '\'') ||
           Refuse(fault, from, to, "TEXT_NOT_CLOSED",
                  "a single quote opens a text and another must close it");
  }
  if (Digit(p.word.front()) || p.word.front() == '.' || p.word.front() == '-' || p.word.front() == '+') {
    return Refuse(fault, from, to, "BAD_NUMBER", "a number is written as 12.5 or -1.25E-3");
  }
  for (std::size_t i = from; i < to; ++i) {
    if (line_[i] == '(' || line_[i] == '=') {
      return Refuse(
          fault, i, i + 1, "APT_SOURCE",
          "this is APT source with definitions; send the cutter location file that its processor makes");
    }
    if (!Letter(line_[i]) && !Digit(line_[i]) && !Blank(line_[i]) && line_[i] != '-' && line_[i] != '_') {
      return Refuse(fault, i, i + 1, "BAD_CHARACTER", "words are of letters and digits");
    }
  }
  return true;
}

}  // namespace lambdajet::trajectory
