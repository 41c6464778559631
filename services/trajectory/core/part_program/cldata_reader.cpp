#include "trajectory/core/part_program/cldata_reader.hpp"

#include <algorithm>

#include "trajectory/core/part_program/cldata_reading.hpp"

namespace lambdajet::trajectory {
namespace {

std::string_view WithoutMark(std::string_view text) {
  return text.starts_with("\xEF\xBB\xBF") ? text.substr(3) : text;
}

}  // namespace

CldataReading::CldataReading(std::string_view text, const CldataOptions& options)
    : text_(text), options_(options), lines_(WithoutMark(text)) {}

PartProgram CldataReading::Read() {
  if (text_.starts_with("\xFF\xFE") || text_.starts_with("\xFE\xFF")) {
    Fault({1, 1, {}}, "NOT_UTF8", "the file is UTF-16; save it as UTF-8 or ASCII");
    return std::move(program_);
  }
  CldataFault fault;
  while (!stopped_ && program_.faults.size() < options_.fault_limit && lines_.Next(statement_, fault)) {
    if (finished_) {
      Fault(statement_.place, "TEXT_AFTER_FINI", "FINI ends the file");
      break;
    }
    if (fault.reason != nullptr) {
      Fault(fault.place, fault.reason, fault.message);
      continue;
    }
    Obey();
  }
  program_.line_count = lines_.line_count();
  CloseProgram();
  return std::move(program_);
}

void CldataReading::CloseProgram() {
  if (finished_ || stopped_ || !program_.faults.empty()) {
    return;
  }
  Fault({lines_.line_count(), 0, {}}, anything_ ? "PROGRAM_END_MISSING" : "PROGRAM_EMPTY",
        anything_ ? "the program ends without FINI; is it complete?"
                  : "there is nothing to do; write at least a motion and FINI");
}

bool CldataReading::Obey() {
  anything_ = true;
  const std::optional<CldataMajor> word = FindCldataMajor(statement_.major);
  if (!word) {
    return Fault(statement_.place, "UNKNOWN_WORD", AdviceOnCldataWord(statement_.major));
  }
  if (ended_ && *word != CldataMajor::kFinish && *word != CldataMajor::kText) {
    return Fault(statement_.place, "STATEMENT_AFTER_END", "END ends the program; only FINI may follow");
  }
  if (*word != CldataMajor::kGoto) {
    circle_.reset();
  }
  if (rapid_ && *word != CldataMajor::kGoto && *word != CldataMajor::kGodelta &&
      *word != CldataMajor::kText) {
    return Fault(statement_.place, "RAPID_WITHOUT_MOTION", "RAPID belongs to the GOTO that follows it");
  }
  if (drills_ && MovesWithoutHole(*word)) {
    return Fault(
        statement_.place, "CYCLE_STILL_ON",
        "CYCLE/OFF must stand before a motion that drills nothing; under a cycle every GOTO is a hole");
  }
  return Obey(*word);
}

bool CldataReading::MovesWithoutHole(CldataMajor major) {
  return major == CldataMajor::kRapid || major == CldataMajor::kGodelta || major == CldataMajor::kFrom ||
         major == CldataMajor::kCircle || major == CldataMajor::kMoveArc;
}

bool CldataReading::Obey(CldataMajor major) {
  switch (major) {
    case CldataMajor::kText:
      return true;
    case CldataMajor::kUnits:
      return Units();
    case CldataMajor::kFrom:
      return From();
    case CldataMajor::kGoto:
      return Goto();
    case CldataMajor::kGodelta:
      return GoDelta();
    case CldataMajor::kRapid:
      return Count(0, 0) && (rapid_ = true);
    case CldataMajor::kFeedrate:
      return Feedrate();
    case CldataMajor::kCircle:
      return ReadCircle();
    case CldataMajor::kMoveArc:
      return MoveArc();
    case CldataMajor::kCutter:
      return Cutter();
    case CldataMajor::kToolCompensation:
      return ToolCompensation();
    case CldataMajor::kMultax:
      return Multax();
    case CldataMajor::kToolAxis:
      return Count(3, 3) && ToolAxis(0);
    case CldataMajor::kFrame:
      return Frame();
    default:
      return ObeySwitch(major);
  }
}

bool CldataReading::ObeySwitch(CldataMajor major) {
  switch (major) {
    case CldataMajor::kCycle:
      return Cycle();
    case CldataMajor::kSpindle:
      return Spindle();
    case CldataMajor::kAuxiliary:
      return Auxiliary();
    case CldataMajor::kCoolant:
      return Coolant();
    case CldataMajor::kDelay:
      return Delay();
    case CldataMajor::kLoadTool:
      return LoadTool();
    case CldataMajor::kTolerance:
      return Tolerance();
    case CldataMajor::kStop:
      return Count(0, 0) && Add(OperationKind::kStop);
    case CldataMajor::kEnd:
      return Count(0, 0) && End();
    default:
      finished_ = true;
      return Count(0, 0) && (ended_ || End());
  }
}

PartProgram ReadCldata(std::string_view text, const CldataOptions& options) {
  return CldataReading(text, options).Read();
}

bool LooksLikeCldata(std::string_view text) {
  if (text.starts_with("\xEF\xBB\xBF")) {
    text.remove_prefix(3);
  }
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  if (first == std::string_view::npos) {
    return false;
  }
  text.remove_prefix(first);
  if (text.starts_with("$$")) {
    return true;
  }
  CldataLines lines(text.substr(0, std::min(text.size(), text.find('\n'))));
  CldataStatement statement;
  CldataFault fault;
  return lines.Next(statement, fault) && statement.major.size() > 2 &&
         FindCldataMajor(statement.major).has_value();
}

}  // namespace lambdajet::trajectory
