#include "trajectory/core/part_program/gcode_reading.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <numbers>

namespace lambdajet::trajectory {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

}  // namespace

std::string ShortNumber(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", value);
  return text;
}

bool Reading::HasAxisWords() const {
  constexpr std::uint32_t kAll =
      LetterBit('X') | LetterBit('Y') | LetterBit('Z') | LetterBit('A') | LetterBit('B') | LetterBit('C');
  return (block.present & kAll) != 0;
}

bool Reading::AxesTaken() const {
  switch (code(kOnce)) {
    case 100:
    case 280:
    case 300:
    case 520:
    case 920:
      return true;
    default:
      return code(kLength) == 431;
  }
}

Operation& Reading::Add(OperationKind kind) {
  Operation& o = program.operations.emplace_back();
  o.kind = kind;
  o.axes = options.axes;
  o.line = line_number;
  o.x_W_mm = state.position[0];
  o.y_W_mm = state.position[1];
  o.z_W_mm = state.position[2];
  o.a_rad = kDegree * state.position[3];
  o.b_rad = kDegree * state.position[4];
  o.c_rad = kDegree * state.position[5];
  o.feed_mm_per_s = state.feed_mm_per_s;
  if (program.operations.size() >= options.operation_limit) {
    Fault(0, 0, "PROGRAM_TOO_LONG",
          "more than " + std::to_string(options.operation_limit) + " operations; split the program");
    ended = true;
  }
  return o;
}

Operation& Reading::Move(OperationKind kind, const AxisValues& end) {
  state.position = end;
  moved = true;
  Operation& o = Add(kind);
  o.kerf_offset_mm = state.kerf_offset_mm;
  return o;
}

// From the letter to the next letter or space, or over the expression.
std::uint32_t Reading::WordLength(std::uint32_t column) const {
  std::size_t end = column;
  while (end < line.size() && (std::isdigit(static_cast<unsigned char>(line[end])) != 0 || line[end] == '.' ||
                               line[end] == '-' || line[end] == '+' || line[end] == '#')) {
    ++end;
  }
  return static_cast<std::uint32_t>(end - (column - 1));
}

bool Reading::FaultAt(char letter, std::string_view reason, std::string message) {
  const std::uint32_t column = block.column_of(letter);
  return Fault(column, WordLength(column), reason, std::move(message));
}

bool Reading::FaultAt(Group group, std::string_view reason, std::string message) {
  return Fault(columns[group], WordLength(columns[group]), reason, std::move(message));
}

bool Reading::FaultAtMotion(std::string_view reason, std::string message) {
  if (code(kMotion) != kNoCode) {
    return FaultAt(kMotion, reason, std::move(message));
  }
  std::uint32_t first = 0;
  for (const char letter : kAxisLetters) {
    if (block.has(letter) && (first == 0 || block.column_of(letter) < first)) {
      first = block.column_of(letter);
    }
  }
  return Fault(first, first == 0 ? 0 : WordLength(first), reason, std::move(message));
}

bool Reading::Fault(std::uint32_t column, std::uint32_t length, std::string_view reason,
                    std::string message) {
  left_in_doubt |= LeavesInDoubt(reason);
  if ((RestsOn(reason) & doubt) != 0) {
    return false;
  }
  std::string word;
  if (column > 0 && column <= line.size()) {
    word = std::string(line.substr(column - 1, std::min<std::size_t>(length, 60)));
    while (!word.empty() && IsSpace(word.back())) {
      word.pop_back();
    }
  }
  program.faults.push_back({line_number, column, reason, std::move(word), std::move(message)});
  return false;
}

}  // namespace lambdajet::trajectory
