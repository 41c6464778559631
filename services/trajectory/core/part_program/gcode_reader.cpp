#include "trajectory/core/part_program/gcode_reader.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <utility>

#include "foundation/contract/expects.hpp"
#include "trajectory/core/part_program/gcode_expression.hpp"
#include "trajectory/core/part_program/gcode_flow_table.hpp"
#include "trajectory/core/part_program/gcode_reading.hpp"

namespace lambdajet::trajectory {
namespace {

constexpr std::size_t kLongestLine = 1000;
constexpr std::size_t kDeepestCall = 10;
constexpr double kMostRepeats = 1e9;

// Takes line after line, follows the O-words, and has the blocks obeyed.
class Reader {
 public:
  Reader(std::string_view text, const GcodeOptions& options) : text_(text), options_(options), r_(options) {}

  PartProgram Read() {
    if (!RefuseEncoding()) {
      const auto lines = static_cast<std::size_t>(std::count(text_.begin(), text_.end(), '\n'));
      r_.program.operations.reserve(std::min(lines + 16, options_.operation_limit));
      while (!r_.ended && at_ < text_.size() && GoOn()) {
        NextLine();
        ReadLine();
      }
      CloseProgram();
    }
    return std::move(r_.program);
  }

 private:
  struct Frame {
    std::size_t sub = kNowhere;  // of the flow table
    std::size_t at = 0;          // where the caller goes on
    std::uint32_t line = 0;
    std::size_t loops = 0;  // of the caller
    int repeats = 0;        // left, M98 L
    bool numbered = false;  // M98
  };
  struct Loop {
    std::size_t opener;
    double left;
  };

  bool RefuseEncoding() {
    if (text_.starts_with("\xEF\xBB\xBF")) {
      at_ = first_ = 3;
    }
    if (text_.starts_with("\xFF\xFE") || text_.starts_with("\xFE\xFF")) {
      r_.line_number = 1;
      r_.Fault(1, 1, "NOT_UTF8", "the file is UTF-16; save it as UTF-8 or ASCII");
      return true;
    }
    return false;
  }

  // What follows a fault is judged only where it does not hang on what the faulty line should have done.
  bool GoOn() const {
    const std::size_t faults = r_.program.faults.size();
    return faults == 0 || (faults < options_.fault_limit && !branches() && !settings_lost_);
  }

  bool branches() const { return flow_ && !(frames_.empty() && flow_->numbers_only()); }

  void NextLine() {
    const char* begin = text_.data() + at_;
    const auto* end = static_cast<const char*>(std::memchr(begin, '\n', text_.size() - at_));
    const std::size_t size = end == nullptr ? text_.size() - at_ : static_cast<std::size_t>(end - begin);
    r_.line = {begin, size};
    r_.left_in_doubt = 0;
    r_.moved = false;
    at_ += size + 1;
    ++r_.line_number;
    r_.program.line_count = std::max(r_.program.line_count, r_.line_number);
    if (++lines_obeyed_ > options_.line_limit) {
      Endless("more lines are run than the limit of " + std::to_string(options_.line_limit));
    }
  }

  void Endless(std::string message) {
    const std::size_t first = std::min(r_.line.find_first_not_of(" \t\r"), r_.line.size());
    const std::size_t end = std::min(r_.line.find_first_of(" \t\r", first), r_.line.size());
    r_.Fault(first < end ? static_cast<std::uint32_t>(first + 1) : 0, static_cast<std::uint32_t>(end - first),
             "PROGRAM_RUNS_TOO_LONG", std::move(message) + "; does a loop never end?");
    r_.ended = true;
  }

  // Behind a fault nobody knows what the parameters of the state hold.
  bool AsksForState() const {
    return !r_.program.faults.empty() &&
           (r_.line.find("#5") != std::string_view::npos || r_.line.find("#<_") != std::string_view::npos);
  }

  void ReadLine() {
    settings_lost_ = settings_lost_ || AsksForState();
    if (r_.ended || settings_lost_) {
      return;
    }
    if (r_.line.size() > kLongestLine) {
      r_.Fault(static_cast<std::uint32_t>(kLongestLine + 1), 1, "LINE_TOO_LONG",
               "a line has at most 1000 characters");
      r_.doubt |= r_.left_in_doubt;
      settings_lost_ = true;
      return;
    }
    const LineParse parse = ParseLine(r_.line, r_.block, r_.parameters);
    if (parse.deleted && options_.obey_block_delete) {
      r_.parameters.Forget();
      return;
    }
    if (parse.fault.reason != nullptr) {
      r_.parameters.Forget();
      r_.Fault(parse.fault.column, parse.fault.length, parse.fault.reason, parse.fault.message);
      settings_lost_ = r_.line.find('=') != std::string_view::npos;
      anything_ = obeyed_ = true;
      TakeAtItsWords(r_, false);
      return;
    }
    if (parse.percent) {
      Percent();
      return;
    }
    if (parse.flow) {
      ObeyFlowLine();
      anything_ = obeyed_ = true;
      return;
    }
    if (parse.abort_column != 0) {
      r_.Fault(parse.abort_column, 60, "PROGRAM_ABORTS", "the program itself ends here with a message");
      r_.ended = true;
      return;
    }
    ObeyLine();
  }

  void ObeyLine() {
    if (r_.parameters.pending()) {
      anything_ = true;
      r_.parameters.Settle();
    }
    if (r_.block.empty()) {
      return;
    }
    anything_ = obeyed_ = true;
    if (!ObeyBlock(r_)) {
      TakeAtItsWords(r_, true);
    }
    if (r_.flow.call || r_.flow.leave) {
      const FlowRequest request = std::move(r_.flow);
      r_.flow = {};
      if (r_.program.faults.empty()) {
        request.call ? CallNumbered(request) : LeaveNumbered();
      } else {
        r_.doubt |= kEveryDoubt;
        r_.ended = r_.ended || request.leave;
      }
    }
  }

  void Percent() {
    if (!anything_ && !percent_) {
      percent_ = anything_ = true;
    } else if (percent_) {
      EndProgram(r_);
    } else {
      r_.Fault(1, 1, "PERCENT_NOT_FIRST", "a percent sign ends a program only if one began it; end with M2");
    }
  }

  void CloseProgram() {
    if (r_.ended || !GoOn() || (r_.doubt & kEndDoubt) != 0) {
      return;
    }
    r_.line = {};
    if (!anything_) {
      r_.Fault(0, 0, "PROGRAM_EMPTY", "there is nothing to do; write at least a motion and M2");
    } else {
      r_.Fault(0, 0, "PROGRAM_END_MISSING",
               "the program ends without M2, M30 or a second percent sign; is it complete?");
    }
  }

  // ---- O-words ----

  // Made once, at the first O-word or M98.
  bool HasFlow() {
    if (flow_) {
      return true;
    }
    flow_ = std::make_unique<FlowTable>(text_, first_, options_.obey_block_delete);
    const std::uint32_t number = r_.line_number;
    const std::string_view line = r_.line;
    for (const FlowFault& f : flow_->faults()) {
      r_.line_number = f.line;
      r_.line = f.text;
      r_.Fault(f.fault.column, f.fault.length, f.fault.reason, f.fault.message);
    }
    r_.line_number = number;
    r_.line = line;
    return flow_->faults().empty();
  }

  void ObeyFlowLine() {
    if (!HasFlow() || (!r_.program.faults.empty() && branches())) {
      return;
    }
    const std::size_t index = flow_->AtLine(r_.line_number);
    if (index == kNowhere) {
      r_.Fault(1, 1, "O_WORD_NOT_FIRST", "an O-word stands first in its line");
      return;
    }
    const bool arriving = std::exchange(arriving_, kNowhere) == index;
    const FlowLine& f = flow_->at(index);
    LineScan scan(r_.line, f.rest_at);
    if (!Obey(scan, f, index, arriving) && scan.failed()) {
      const WordFault& fault = scan.fault();
      r_.Fault(fault.column, fault.length, fault.reason, fault.message);
    }
  }

  bool Obey(LineScan& scan, const FlowLine& f, std::size_t index, bool arriving) {
    switch (f.kind) {
      case FlowKind::kIf:
        return Branch(scan, f);
      case FlowKind::kElseIf:
        return arriving ? Branch(scan, f) : JumpBehind(f.closer);
      case FlowKind::kElse:
        return EndOfLine(scan) && (arriving || JumpBehind(f.closer));
      case FlowKind::kWhile:
        return While(scan, f);
      case FlowKind::kDoWhile:
        return DoWhile(scan, f);
      case FlowKind::kRepeat:
        return Repeat(scan, f, index);
      case FlowKind::kEndWhile:
        return EndOfLine(scan) && CountJump() && JumpTo(f.opener);
      case FlowKind::kEndRepeat:
        return EndOfLine(scan) && EndRepeat(f);
      case FlowKind::kBreak:
        return EndOfLine(scan) && Break(f);
      case FlowKind::kContinue:
        return EndOfLine(scan) && Continue(f);
      case FlowKind::kSub:
        return EndOfLine(scan) && Define(scan, f, index);
      case FlowKind::kReturn:
      case FlowKind::kEndSub:
        return Return(scan, f);
      case FlowKind::kCall:
        return Call(scan, f);
      case FlowKind::kSubprogram:
        return Subprogram(scan, f);
      default:
        return EndOfLine(scan);
    }
  }

  bool EndOfLine(LineScan& scan) {
    while (scan.Next() == '(') {
      const std::size_t close = scan.line().find(')', scan.at());
      if (close == std::string_view::npos) {
        return scan.Fail("COMMENT_NOT_CLOSED", scan.at(), "a comment ends with ) in its own line");
      }
      scan.GoTo(close + 1);
    }
    return scan.AtEnd() || scan.Next() == ';' ||
           scan.Fail("O_WORD_NOT_ALONE", scan.at(), "an O-word stands in a line of its own");
  }

  bool Condition(LineScan& scan, double& value) {
    return ReadExpression(scan, r_.parameters, value) && EndOfLine(scan);
  }

  bool JumpTo(std::size_t index) {
    const FlowLine& f = flow_->at(index);
    arriving_ = index;
    at_ = f.begin;
    r_.line_number = f.line - 1;
    return true;
  }

  bool JumpBehind(std::size_t index) {
    const FlowLine& f = flow_->at(index);
    at_ = f.end;
    r_.line_number = f.line;
    return true;
  }

  bool CountJump() {
    if (++jumps_ > options_.jump_limit) {
      Endless("more turns of loops and calls than the limit of " + std::to_string(options_.jump_limit));
    }
    return true;
  }

  bool Branch(LineScan& scan, const FlowLine& f) {
    double value = 0.0;
    if (!Condition(scan, value)) {
      return false;
    }
    if (value != 0.0) {
      return true;
    }
    return f.next == f.closer ? JumpBehind(f.closer) : JumpTo(f.next);
  }

  bool While(LineScan& scan, const FlowLine& f) {
    double value = 0.0;
    return Condition(scan, value) && (value != 0.0 || JumpBehind(f.closer));
  }

  bool DoWhile(LineScan& scan, const FlowLine& f) {
    double value = 0.0;
    return Condition(scan, value) && (value == 0.0 || (CountJump() && JumpBehind(f.opener)));
  }

  bool Repeat(LineScan& scan, const FlowLine& f, std::size_t index) {
    double count = 0.0;
    if (!Condition(scan, count)) {
      return false;
    }
    if (!(std::abs(count) <= kMostRepeats)) {
      return scan.Fail("REPEATS_OUT_OF_RANGE", f.rest_at, "a block is repeated at most 1e9 times");
    }
    count = std::round(count);
    if (count < 1.0) {
      return JumpBehind(f.closer);
    }
    loops_.push_back({index, count});
    return true;
  }

  bool EndRepeat(const FlowLine& f) {
    Expects(!loops_.empty() && loops_.back().opener == f.opener, "a repeat runs where it ends");
    Loop& loop = loops_.back();
    loop.left -= 1.0;
    if (loop.left < 0.5) {
      loops_.pop_back();
      return true;
    }
    return CountJump() && JumpBehind(f.opener);
  }

  // Repeats within the loop that is left are over too.
  void LeaveLoops(std::size_t opener, bool also_itself) {
    const std::size_t base = frames_.empty() ? 0 : frames_.back().loops;
    while (loops_.size() > base &&
           (loops_.back().opener > opener || (also_itself && loops_.back().opener == opener))) {
      loops_.pop_back();
    }
  }

  bool Break(const FlowLine& f) {
    LeaveLoops(f.opener, true);
    return JumpBehind(flow_->at(f.opener).closer);
  }

  bool Continue(const FlowLine& f) {
    LeaveLoops(f.opener, false);
    const FlowLine& loop = flow_->at(f.opener);
    return CountJump() && JumpTo(loop.kind == FlowKind::kWhile ? f.opener : loop.closer);
  }

  // ---- subroutines ----

  bool Define(LineScan& scan, const FlowLine& f, std::size_t index) {
    if (!frames_.empty()) {
      return scan.Fail("SUBPROGRAM_END_MISSING", f.label_at,
                       "M99 ends the subprogram before this one begins");
    }
    defined_.resize(std::max(defined_.size(), index + 1), false);
    defined_[index] = true;
    return JumpBehind(f.closer);
  }

  bool Call(LineScan& scan, const FlowLine& f) {
    std::string label = f.label;
    if (f.computed && !ComputedLabel(scan, f, label)) {
      return false;
    }
    std::vector<double> arguments;
    while (scan.Next() == '[') {
      if (arguments.size() == kArguments) {
        return scan.Fail("CALL_ARGUMENTS", scan.at(), "a call has at most 30 arguments");
      }
      if (!ReadExpression(scan, r_.parameters, arguments.emplace_back())) {
        return false;
      }
    }
    if (!EndOfLine(scan)) {
      return false;
    }
    const std::size_t sub = flow_->Sub(label);
    if (sub == kNowhere || sub >= defined_.size() || !defined_[sub]) {
      return scan.Fail(
          "SUB_NOT_DEFINED", f.label_at,
          "the subroutine must stand in this program, before its call; other files are not read");
    }
    if (!Enter(scan, f.label_at, {sub, at_, r_.line_number, loops_.size(), 0, false})) {
      return false;
    }
    r_.parameters.Enter(arguments);
    return true;
  }

  bool ComputedLabel(LineScan& scan, const FlowLine& f, std::string& label) {
    scan.GoTo(f.label_at + 1);
    double number = 0.0;
    if (!ReadValue(scan, r_.parameters, f.label_at, number)) {
      return false;
    }
    if (!(number >= 0.0 && number < 1e9) || std::abs(number - std::round(number)) > 1e-4) {
      return scan.Fail("O_LABEL_COMPUTED", f.label_at, "a computed label is a whole number from 0");
    }
    if (!scan.Take("CALL")) {
      return scan.Fail("O_LABEL_COMPUTED", f.label_at, "only a call may compute its label");
    }
    label = std::to_string(std::lround(number));
    return true;
  }

  bool Enter(LineScan& scan, std::size_t column_at, const Frame& frame) {
    if (frames_.size() == kDeepestCall) {
      return scan.Fail("CALLS_TOO_DEEP", column_at, "subroutines call each other at most 10 deep");
    }
    frames_.push_back(frame);
    return CountJump() && JumpBehind(frame.sub);
  }

  bool Return(LineScan& scan, const FlowLine& f) {
    std::optional<double> value;
    if (scan.Next() == '[') {
      double given = 0.0;
      if (!ReadExpression(scan, r_.parameters, given)) {
        return false;
      }
      value = given;
    }
    if (!EndOfLine(scan)) {
      return false;
    }
    if (frames_.empty() || frames_.back().sub != f.opener) {
      return scan.Fail("RETURN_WITHOUT_CALL", f.label_at, "the subroutine that runs is another one");
    }
    r_.parameters.Leave(value);
    PopFrame();
    return true;
  }

  void PopFrame() {
    const Frame& frame = frames_.back();
    at_ = frame.at;
    r_.line_number = frame.line;
    loops_.resize(frame.loops, Loop{0, 0.0});
    frames_.pop_back();
  }

  // ---- numbered subprograms, M98 and M99 ----

  // The number of the main program stands before everything else; others are met only by their calls.
  bool Subprogram(LineScan& scan, const FlowLine& f) {
    return !obeyed_ || scan.Fail("SUBPROGRAM_REACHED", f.label_at,
                                 "the program runs into this subprogram; M2, M30 or M99 must stand before");
  }

  void CallNumbered(const FlowRequest& request) {
    LineScan scan(r_.line, r_.columns[kCallWord] - 1);
    if (!HasFlow()) {
      return;
    }
    const std::size_t sub = flow_->Subprogram(request.label);
    const std::size_t column = r_.columns[kCallWord] - 1;
    if (sub == kNowhere) {
      const bool other = flow_->Sub(request.label) != kNowhere;
      r_.FaultAt(kCallWord, other ? "SUB_STYLES_MIXED" : "SUB_NOT_DEFINED",
                 other ? "a subroutine of sub and endsub is called by O-call"
                       : "the subprogram, an O-number in a line of its own, is not in this program");
    } else if (flow_->at(sub).line <= r_.line_number && frames_.empty()) {
      r_.FaultAt(kCallWord, "SUB_NOT_DEFINED", "a numbered subprogram stands behind the main program");
    } else if (request.repeats > 0 &&
               !Enter(scan, column, {sub, at_, r_.line_number, loops_.size(), request.repeats, true})) {
      r_.FaultAt(kCallWord, scan.fault().reason, scan.fault().message);
    }
  }

  void LeaveNumbered() {
    if (frames_.empty() || !frames_.back().numbered) {
      r_.FaultAt(kCallWord, frames_.empty() ? "ENDLESS_PROGRAM" : "SUB_STYLES_MIXED",
                 frames_.empty() ? "M99 would begin the program anew for ever; end it with M2"
                                 : "a subroutine that began with sub ends with endsub");
      return;
    }
    Frame& frame = frames_.back();
    --frame.repeats;
    if (frame.repeats > 0) {
      loops_.resize(frame.loops, Loop{0, 0.0});
      CountJump();
      JumpBehind(frame.sub);
    } else {
      PopFrame();
    }
  }

  std::string_view text_;
  const GcodeOptions& options_;
  Reading r_;
  std::size_t at_ = 0;
  std::size_t first_ = 0;  // behind a byte order mark
  bool anything_ = false;
  bool percent_ = false;
  bool obeyed_ = false;         // a block or an O-word
  bool settings_lost_ = false;  // of parameters, in a line that could not be read
  std::size_t lines_obeyed_ = 0;
  std::size_t jumps_ = 0;

  std::unique_ptr<FlowTable> flow_;
  std::vector<bool> defined_;
  std::vector<Frame> frames_;
  std::vector<Loop> loops_;
  std::size_t arriving_ = kNowhere;
};

}  // namespace

PartProgram ReadGcode(std::string_view text, const GcodeOptions& options) {
  return Reader(text, options).Read();
}

}  // namespace lambdajet::trajectory
