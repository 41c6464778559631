// Splits one line of G-code into its words; the reader's own, not for others.
//
// Model: RS-274/NGC, "Format of a line". A word is a letter and a value; comments stand in round brackets or after a
// semicolon; settings of parameters wait until the line is read.
// Threads: values. Cost: one look at each character, no allocation for a line of plain words without faults.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "trajectory/core/part_program/gcode_parameters.hpp"
#include "trajectory/core/part_program/gcode_scan.hpp"

namespace lambdajet::trajectory {

inline constexpr int kMaxCodesPerLine = 16;

// G and M codes are held tenfold: G61.1 is 611.
struct Code {
  int tenfold = 0;
  std::uint32_t column = 0;
};

constexpr std::uint32_t LetterBit(char letter) { return 1u << (letter - 'A'); }

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
  bool empty() const { return present == 0 && g_count == 0 && m_count == 0; }
  bool has(char letter) const { return (present & LetterBit(letter)) != 0; }
  double at(char letter) const { return value[static_cast<std::size_t>(letter - 'A')]; }
  double Take(char letter) {
    used |= LetterBit(letter);
    return at(letter);
  }
  std::uint32_t column_of(char letter) const { return column[static_cast<std::size_t>(letter - 'A')]; }
};

// `line` is without its line end.
struct LineParse {
  WordFault fault;
  bool percent = false;            // a line of its own
  bool deleted = false;            // begins with a slash
  bool flow = false;               // an O-word stands first; the rest of the line is not read
  std::uint32_t abort_column = 0;  // of an (ABORT, …) comment that counts, 0: none
};
LineParse ParseLine(std::string_view line, Block& block, Parameters& parameters);

}  // namespace lambdajet::trajectory
