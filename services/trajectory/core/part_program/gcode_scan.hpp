// Walks along one line of G-code: spaces, letters and numbers; the reader's own, not for others.
//
// Model: RS-274/NGC, "Format of a line" and "Numbers": spaces and tabs do not count, not even within a number.
// Threads: values. Cost: one look at each character, no allocation.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

namespace lambdajet::trajectory {

// A fault within a line; reason null where there is none.
struct WordFault {
  const char* reason = nullptr;
  std::uint32_t column = 0;
  std::uint32_t length = 1;  // of the word complained about
  const char* message = "";
};

inline bool IsSpace(char c) { return c == ' ' || c == '\t' || c == '\r'; }
inline bool IsDigit(char c) { return static_cast<unsigned char>(c - '0') < 10; }
inline char Upper(char c) { return static_cast<unsigned char>(c - 'a') < 26 ? static_cast<char>(c - 32) : c; }
inline bool IsLetter(char c) { return static_cast<unsigned char>(Upper(c) - 'A') < 26; }

class LineScan {
 public:
  explicit LineScan(std::string_view line, std::size_t at = 0) : line_(line), at_(at) {}

  bool AtEnd() const { return at_ >= line_.size(); }
  std::size_t at() const { return at_; }
  void GoTo(std::size_t at) { at_ = at; }
  void Step() { ++at_; }
  void SkipSpaces() {
    while (!AtEnd() && IsSpace(line_[at_])) {
      ++at_;
    }
  }
  // The next character that counts, 0 at the end; a letter as a capital.
  char Next() {
    SkipSpaces();
    return AtEnd() ? '\0' : Upper(line_[at_]);
  }
  // Whether the line goes on with these capitals, spaces left out; it is then behind them.
  bool Take(std::string_view capitals);

  // Sign, digits, point, digits; false, with no fault and nowhere moved to, if there is no digit.
  // A number that is too long is complained about at `word`.
  bool Number(double& value, std::size_t word);

  bool Fail(const char* reason, std::size_t from, const char* message);
  bool failed() const { return fault_.reason != nullptr; }
  const WordFault& fault() const { return fault_; }
  std::string_view line() const { return line_; }

 private:
  bool LongNumber(std::size_t from, std::size_t word, double& value);

  std::string_view line_;
  std::size_t at_ = 0;
  WordFault fault_;
};

}  // namespace lambdajet::trajectory
