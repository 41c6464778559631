#include "trajectory/core/part_program/gcode_flow_table.hpp"

#include <algorithm>
#include <array>
#include <cstring>

#include "trajectory/core/part_program/gcode_expression.hpp"

namespace lambdajet::trajectory {
namespace {

constexpr std::size_t kMostFaults = 100;
constexpr std::size_t kDeepestBlocks = 100;

struct FlowName {
  std::string_view name;
  FlowKind kind;
};
// Longer names before those they begin with.
constexpr std::array<FlowName, 15> kNames = {{{"SUB", FlowKind::kSub},
                                              {"ENDSUB", FlowKind::kEndSub},
                                              {"RETURN", FlowKind::kReturn},
                                              {"CALL", FlowKind::kCall},
                                              {"IF", FlowKind::kIf},
                                              {"ELSEIF", FlowKind::kElseIf},
                                              {"ELSE", FlowKind::kElse},
                                              {"ENDIF", FlowKind::kEndIf},
                                              {"WHILE", FlowKind::kWhile},
                                              {"ENDWHILE", FlowKind::kEndWhile},
                                              {"DO", FlowKind::kDo},
                                              {"REPEAT", FlowKind::kRepeat},
                                              {"ENDREPEAT", FlowKind::kEndRepeat},
                                              {"BREAK", FlowKind::kBreak},
                                              {"CONTINUE", FlowKind::kContinue}}};

bool Loop(FlowKind kind) {
  return kind == FlowKind::kWhile || kind == FlowKind::kDo || kind == FlowKind::kRepeat;
}

// What a block that `kind` ends was begun with.
FlowKind OpenerOf(FlowKind kind) {
  switch (kind) {
    case FlowKind::kEndSub:
      return FlowKind::kSub;
    case FlowKind::kEndWhile:
      return FlowKind::kWhile;
    case FlowKind::kEndRepeat:
      return FlowKind::kRepeat;
    case FlowKind::kDoWhile:
      return FlowKind::kDo;
    default:
      return FlowKind::kIf;
  }
}

// Behind spaces, a slash and the line number, at the O-word; false if there is none.
bool FindFlowWord(LineScan& scan, bool obey_block_delete) {
  if (scan.Next() == '/') {
    if (obey_block_delete) {
      return false;
    }
    scan.Step();
  }
  while (scan.Next() == '(') {
    const std::size_t close = scan.line().find(')', scan.at());
    if (close == std::string_view::npos) {
      return false;
    }
    scan.GoTo(close + 1);
  }
  if (scan.Next() == 'N') {
    double number = 0.0;
    scan.Step();
    if (!scan.Number(number, scan.at())) {
      return false;
    }
  }
  return scan.Next() == 'O';
}

}  // namespace

FlowTable::FlowTable(std::string_view text, std::size_t begin, bool obey_block_delete) {
  std::uint32_t number = 0;
  bool percent = false;
  while (begin < text.size() && faults_.size() < kMostFaults) {
    const void* found = std::memchr(text.data() + begin, '\n', text.size() - begin);
    const std::size_t end = found == nullptr
                                ? text.size()
                                : static_cast<std::size_t>(static_cast<const char*>(found) - text.data());
    const std::string_view line = text.substr(begin, end - begin);
    ++number;
    LineScan scan(line);
    if (scan.Next() == '%') {
      if (percent) {
        break;
      }
      percent = true;
    } else if (FindFlowWord(scan, obey_block_delete)) {
      FlowLine& flow = lines_.emplace_back();
      flow.line = number;
      flow.begin = begin;
      flow.end = end + 1;
      if (!Read(scan, flow) || !Match(scan, flow)) {
        faults_.push_back({number, line, scan.fault()});
        lines_.pop_back();
      }
    }
    begin = end + 1;
  }
  RefuseOpen(text);
}

bool FlowTable::Read(LineScan& scan, FlowLine& flow) const {
  flow.label_at = scan.at();
  scan.Step();
  return ReadLabel(scan, flow) && ReadWord(scan, flow);
}

bool FlowTable::ReadLabel(LineScan& scan, FlowLine& flow) const {
  const char c = scan.Next();
  if (c == '<') {
    std::string name;
    if (!ReadName(scan, name)) {
      return false;
    }
    flow.label = "<" + name + ">";
    return true;
  }
  if (c == '#' || c == '[') {
    flow.computed = true;
    // Over the expression, whose value is not known yet, to the word behind its last bracket.
    const std::size_t last = scan.line().find_first_of("cC", scan.at());
    if (last == std::string_view::npos) {
      return scan.Fail("O_LABEL_COMPUTED", flow.label_at, "only a call may compute its label");
    }
    return true;
  }
  while (IsDigit(scan.Next())) {
    if (!(flow.label == "0" && flow.label.size() == 1)) {
      flow.label += scan.Next();
    } else {
      flow.label = scan.Next();
    }
    scan.Step();
  }
  if (flow.label.empty() || flow.label.size() > 9) {
    return scan.Fail("O_LABEL_MISSING", flow.label_at,
                     "an O is followed by a number, a <name> or an expression");
  }
  return true;
}

bool FlowTable::ReadWord(LineScan& scan, FlowLine& flow) const {
  if (flow.computed) {
    flow.kind = FlowKind::kCall;
    return true;
  }
  for (const FlowName& f : kNames) {
    if (scan.Take(f.name)) {
      flow.kind = f.kind;
      flow.rest_at = scan.at();
      return true;
    }
  }
  const char c = scan.Next();
  if ((c == '\0' && scan.AtEnd()) || c == '(' || c == ';') {
    flow.kind = FlowKind::kSubprogram;
    flow.rest_at = scan.at();
    return flow.label.front() != '<' ||
           scan.Fail("O_WORD_UNKNOWN", flow.label_at, "a subprogram of M98 has a number, not a name");
  }
  return scan.Fail(
      "O_WORD_UNKNOWN", flow.label_at,
      "sub, endsub, return, call, if, elseif, else, endif, while, endwhile, do, repeat, endrepeat, "
      "break or continue was expected");
}

bool FlowTable::Match(LineScan& scan, FlowLine& flow) {
  switch (flow.kind) {
    case FlowKind::kWhile:
      if (!open_.empty() && lines_[open_.back()].kind == FlowKind::kDo &&
          lines_[open_.back()].label == flow.label) {
        flow.kind = FlowKind::kDoWhile;
        return Close(scan, flow);
      }
      return Open(scan, flow);
    case FlowKind::kSub:
    case FlowKind::kSubprogram:
      if (!open_.empty()) {
        return scan.Fail("SUB_NESTED", flow.label_at, "a subroutine begins outside of all other blocks");
      }
      if (!(flow.kind == FlowKind::kSub ? subs_ : subprograms_)
               .emplace(flow.label, lines_.size() - 1)
               .second) {
        return scan.Fail("SUB_TWICE", flow.label_at, "this subroutine is defined before");
      }
      return flow.kind == FlowKind::kSubprogram || Open(scan, flow);
    case FlowKind::kIf:
    case FlowKind::kDo:
    case FlowKind::kRepeat:
      return Open(scan, flow);
    case FlowKind::kElseIf:
    case FlowKind::kElse:
      return Branch(scan, flow, flow.kind == FlowKind::kElse);
    case FlowKind::kBreak:
    case FlowKind::kContinue:
      return Leave(scan, flow);
    case FlowKind::kReturn:
      return Return(scan, flow);
    case FlowKind::kCall:
      return true;
    default:
      return Close(scan, flow);
  }
}

bool FlowTable::Open(LineScan& scan, FlowLine& flow) {
  if (open_.size() == kDeepestBlocks) {
    return scan.Fail("O_WORD_TOO_DEEP", flow.label_at, "blocks are nested at most 100 deep");
  }
  open_.push_back(lines_.size() - 1);
  branch_.push_back(lines_.size() - 1);
  return true;
}

bool FlowTable::Branch(LineScan& scan, FlowLine& flow, bool last) {
  if (open_.empty() || lines_[open_.back()].kind != FlowKind::kIf ||
      lines_[open_.back()].label != flow.label) {
    return scan.Fail("O_WORD_WITHOUT_OPENER", flow.label_at, "no open if of this label stands before");
  }
  FlowLine& before = lines_[branch_.back()];
  if (before.kind == FlowKind::kElse) {
    return scan.Fail("ELSE_NOT_LAST", flow.label_at,
                     last ? "the block has an else already" : "else is the last branch");
  }
  before.next = lines_.size() - 1;
  flow.opener = open_.back();
  branch_.back() = lines_.size() - 1;
  return true;
}

bool FlowTable::Close(LineScan& scan, FlowLine& flow) {
  const FlowKind kind = OpenerOf(flow.kind);
  if (open_.empty() || lines_[open_.back()].kind != kind || lines_[open_.back()].label != flow.label) {
    return scan.Fail("O_WORD_WITHOUT_OPENER", flow.label_at,
                     "the innermost open block is not begun by the word and label that belong to this one");
  }
  const std::size_t self = lines_.size() - 1;
  flow.opener = open_.back();
  lines_[flow.opener].closer = self;
  if (kind == FlowKind::kIf) {
    for (std::size_t b = flow.opener; lines_[b].next != kNowhere; b = lines_[b].next) {
      lines_[lines_[b].next].closer = self;
    }
    lines_[branch_.back()].next = self;
  }
  open_.pop_back();
  branch_.pop_back();
  return true;
}

bool FlowTable::Leave(LineScan& scan, FlowLine& flow) {
  for (std::size_t i = open_.size(); i > 0; --i) {
    const FlowLine& block = lines_[open_[i - 1]];
    if (Loop(block.kind) && block.label == flow.label) {
      flow.opener = open_[i - 1];
      return true;
    }
  }
  return scan.Fail("O_WORD_WITHOUT_OPENER", flow.label_at, "no open loop of this label stands before");
}

bool FlowTable::Return(LineScan& scan, FlowLine& flow) {
  if (open_.empty() || lines_[open_.front()].kind != FlowKind::kSub ||
      lines_[open_.front()].label != flow.label) {
    return scan.Fail("O_WORD_WITHOUT_OPENER", flow.label_at, "return stands in the subroutine of its label");
  }
  flow.opener = open_.front();
  return true;
}

void FlowTable::RefuseOpen(std::string_view text) {
  for (const std::size_t index : open_) {
    const FlowLine& flow = lines_[index];
    const std::string_view line = text.substr(flow.begin, std::min(flow.end - 1, text.size()) - flow.begin);
    faults_.push_back({flow.line,
                       line,
                       {"O_WORD_NOT_CLOSED", static_cast<std::uint32_t>(flow.label_at + 1),
                        static_cast<std::uint32_t>(std::max(flow.rest_at, flow.label_at + 1) - flow.label_at),
                        "the end of this block is missing"}});
  }
}

std::size_t FlowTable::AtLine(std::uint32_t line) const {
  const auto found = std::lower_bound(lines_.begin(), lines_.end(), line,
                                      [](const FlowLine& flow, std::uint32_t n) { return flow.line < n; });
  return found == lines_.end() || found->line != line ? kNowhere
                                                      : static_cast<std::size_t>(found - lines_.begin());
}

}  // namespace lambdajet::trajectory
