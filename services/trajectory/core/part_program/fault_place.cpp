#include "trajectory/core/part_program/fault_place.hpp"

#include <algorithm>
#include <map>
#include <string>

#include "trajectory/core/part_program/gcode_scan.hpp"

namespace lambdajet::trajectory {
namespace {

constexpr std::string_view kAxes = "XYZABC";

std::size_t BehindBracket(std::string_view line, std::size_t at, char close) {
  return std::min(line.find(close, at), line.size() - 1) + 1;
}

// Behind the letter at `at` and the number, parameter or expression that follows it.
std::size_t WordEnd(std::string_view line, std::size_t at) {
  std::size_t end = at + 1;
  int depth = 0;
  for (; end < line.size(); ++end) {
    const char c = line[end];
    depth += c == '[' ? 1 : c == ']' ? -1 : 0;
    if (depth <= 0 && c != ']' && (IsLetter(c) || c == '(' || c == ';' || IsSpace(c))) {
      break;
    }
  }
  return end;
}

// One word of a line of G-code: its first character and behind its last; empty at the end of the line.
struct Span {
  std::size_t begin = 0, end = 0;
};

Span NextWord(std::string_view line, std::size_t at) {
  while (at < line.size() && line[at] != ';') {
    if (line[at] == '(') {
      at = BehindBracket(line, at, ')');
    } else if (IsLetter(line[at])) {
      return {at, WordEnd(line, at)};
    } else {
      ++at;
    }
  }
  return {};
}

Span WordOf(std::string_view line, const std::string& wanted) {
  Span first, axis;
  for (Span w = NextWord(line, 0); w.end != 0; w = NextWord(line, w.end)) {
    const char letter = Upper(line[w.begin]);
    if (wanted.size() == 1 && letter == wanted.front()) {
      return w;
    }
    first = first.end == 0 && letter != 'N' ? w : first;
    axis = axis.end == 0 && kAxes.find(letter) != std::string_view::npos ? w : axis;
  }
  return axis.end != 0 ? axis : first;
}

}  // namespace

void PointAtWords(std::string_view program, std::vector<ProgramFault>& faults) {
  std::multimap<std::uint32_t, ProgramFault*> wanted;
  for (ProgramFault& f : faults) {
    if (f.line > 0 && f.column == 0) {
      wanted.emplace(f.line, &f);
    }
  }
  std::uint32_t number = 1;
  for (auto next = wanted.begin(); next != wanted.end() && !program.empty(); ++number) {
    const std::size_t size = std::min(program.find('\n'), program.size());
    for (; next != wanted.end() && next->first == number; ++next) {
      const std::string_view line = program.substr(0, size);
      const Span word = WordOf(line, next->second->word);
      if (word.end != 0) {
        next->second->column = static_cast<std::uint32_t>(word.begin + 1);
        next->second->word = line.substr(word.begin, word.end - word.begin);
      }
    }
    program.remove_prefix(std::min(size + 1, program.size()));
  }
}

}  // namespace lambdajet::trajectory
