// Splits one line of G-code into its words; the reader's own, not for others.
//
// Model: RS-274/NGC, "Format of a line". A word is a letter and a number; comments stand in round brackets or after a
// semicolon; spaces and tabs do not count, not even within a number.
// Threads: values. Cost: one look at each character, no allocation for a line without faults.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

namespace lambdajet::trajectory {

inline constexpr int kMaxCodesPerLine = 16;

// G and M codes are held tenfold: G61.1 is 611.
struct Code {
  int tenfold = 0;
  std::uint32_t column = 0;
};

struct Block {
  std::array<double, 26> value;  // valid where `present` says so
  std::array<std::uint32_t, 26> column;
  std::uint32_t present = 0;  // bit per letter, without G, M and N
  std::uint32_t used = 0;     // bit per letter that some code has taken
  std::array<Code, kMaxCodesPerLine> g;
  std::array<Code, kMaxCodesPerLine> m;
  int g_count = 0;
  int m_count = 0;

  void Clear() { present = used = 0, g_count = m_count = 0; }
  bool has(char letter) const { return (present >> (letter - 'A')) & 1u; }
  double at(char letter) const { return value[static_cast<std::size_t>(letter - 'A')]; }
  double Take(char letter) {
    used |= 1u << (letter - 'A');
    return at(letter);
  }
  std::uint32_t column_of(char letter) const { return column[static_cast<std::size_t>(letter - 'A')]; }
};

// A fault within a line; reason null where there is none.
struct WordFault {
  const char* reason = nullptr;
  std::uint32_t column = 0;
  std::uint32_t length = 1;  // of the word complained about
  const char* message = "";
};

// `line` is without its line end. `percent` and `deleted` report lines of "%" and "/" kind.
struct LineParse {
  WordFault fault;
  bool percent = false;
  bool deleted = false;
};
LineParse ParseLine(std::string_view line, Block& block);

}  // namespace lambdajet::trajectory
