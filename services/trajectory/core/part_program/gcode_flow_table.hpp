// Finds the O-words of a program and what belongs to what: subroutines, branches, loops; the reader's own, not for others.
//
// Model: RS-274/NGC as LinuxCNC documents it. Blocks are nested and carry the same label at both ends; labels of
// subroutines are the program's, labels of loops and branches are their subroutine's. A bare O-number begins a numbered
// subprogram (M98, M99). Threads: values. Cost: one look at each line of the program, made at its first O-word or M98.
#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "trajectory/core/part_program/gcode_scan.hpp"

namespace lambdajet::trajectory {

enum class FlowKind : std::uint8_t {
  kSub,
  kEndSub,
  kReturn,
  kCall,
  kIf,
  kElseIf,
  kElse,
  kEndIf,
  kWhile,
  kEndWhile,
  kDo,
  kDoWhile,
  kRepeat,
  kEndRepeat,
  kBreak,
  kContinue,
  kSubprogram,
};

inline constexpr std::size_t kNowhere = static_cast<std::size_t>(-1);

// One line with an O-word; the indices are of the table.
struct FlowLine {
  FlowKind kind = FlowKind::kSub;
  bool computed = false;          // the label is an expression, found when the line is obeyed
  std::uint32_t line = 0;         // of the program
  std::size_t begin = 0;          // of the line in the text
  std::size_t end = 0;            // of the next line
  std::size_t label_at = 0;       // in the line
  std::size_t rest_at = 0;        // in the line, behind the word
  std::string label;              // "100", or "<name>"
  std::size_t opener = kNowhere;  // of the block it belongs to; return: the subroutine
  std::size_t next = kNowhere;    // if, elseif: the next branch
  std::size_t closer = kNowhere;  // opener and branches: the end of the block
};

struct FlowFault {
  std::uint32_t line = 0;
  std::string_view text;  // of the line
  WordFault fault;
};

class FlowTable {
 public:
  FlowTable(std::string_view text, std::size_t begin, bool obey_block_delete);

  const std::vector<FlowFault>& faults() const { return faults_; }
  bool numbers_only() const {
    return std::all_of(lines_.begin(), lines_.end(),
                       [](const FlowLine& l) { return l.kind == FlowKind::kSubprogram; });
  }
  const FlowLine& at(std::size_t index) const { return lines_[index]; }
  std::size_t AtLine(std::uint32_t line) const;  // kNowhere if it has no O-word
  std::size_t Sub(const std::string& label) const { return Find(subs_, label); }
  std::size_t Subprogram(const std::string& label) const { return Find(subprograms_, label); }
  const FlowLine& closer_of(const FlowLine& line) const { return lines_[line.closer]; }

 private:
  void Line(std::string_view line, std::size_t begin, std::size_t end, std::uint32_t number);
  bool Read(LineScan& scan, FlowLine& flow) const;
  bool ReadLabel(LineScan& scan, FlowLine& flow) const;
  bool ReadWord(LineScan& scan, FlowLine& flow) const;
  bool Match(LineScan& scan, FlowLine& flow);
  bool Open(LineScan& scan, FlowLine& flow);
  bool Branch(LineScan& scan, FlowLine& flow, bool last);
  bool Close(LineScan& scan, FlowLine& flow);
  bool Leave(LineScan& scan, FlowLine& flow);
  bool Return(LineScan& scan, FlowLine& flow);
  void RefuseOpen(std::string_view text);

  std::vector<FlowLine> lines_;
  std::vector<FlowFault> faults_;
  using Labels = std::map<std::string, std::size_t>;
  static std::size_t Find(const Labels& labels, const std::string& label) {
    const auto found = labels.find(label);
    return found == labels.end() ? kNowhere : found->second;
  }

  Labels subs_;
  Labels subprograms_;
  std::vector<std::size_t> open_;
  std::vector<std::size_t> branch_;  // the last branch of each open block
};

}  // namespace lambdajet::trajectory
