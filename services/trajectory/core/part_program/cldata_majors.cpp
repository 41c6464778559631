#include "trajectory/core/part_program/cldata_majors.hpp"

#include <algorithm>
#include <array>

namespace lambdajet::trajectory {
namespace {

struct MajorWord {
  std::string_view word;
  CldataMajor major;
};

constexpr std::array<MajorWord, 50> kMajors = {{
    {"PARTNO", CldataMajor::kText},
    {"PPRINT", CldataMajor::kText},
    {"REMARK", CldataMajor::kText},
    {"TPRINT", CldataMajor::kText},
    {"OPNAME", CldataMajor::kText},
    {"MACHIN", CldataMajor::kText},
    {"PAINT", CldataMajor::kText},
    {"MODE", CldataMajor::kText},
    {"TOOLPATH", CldataMajor::kText},
    {"END-OF-PATH", CldataMajor::kText},
    {"UNITS", CldataMajor::kUnits},
    {"FROM", CldataMajor::kFrom},
    {"GOTO", CldataMajor::kGoto},
    {"GODLTA", CldataMajor::kGodelta},
    {"RAPID", CldataMajor::kRapid},
    {"FEDRAT", CldataMajor::kFeedrate},
    {"CIRCLE", CldataMajor::kCircle},
    {"MOVARC", CldataMajor::kMoveArc},
    {"CUTTER", CldataMajor::kCutter},
    {"TLDATA", CldataMajor::kCutter},
    {"TLCOMP", CldataMajor::kToolCompensation},
    {"CUTCOM", CldataMajor::kToolCompensation},
    {"MULTAX", CldataMajor::kMultax},
    {"CYCLE", CldataMajor::kCycle},
    {"SPINDL", CldataMajor::kSpindle},
    {"AUXFUN", CldataMajor::kAuxiliary},
    {"COOLNT", CldataMajor::kCoolant},
    {"DELAY", CldataMajor::kDelay},
    {"LOADTL", CldataMajor::kLoadTool},
    {"LOAD", CldataMajor::kLoadTool},
    {"TURRET", CldataMajor::kLoadTool},
    {"TOLER", CldataMajor::kTolerance},
    {"STOP", CldataMajor::kStop},
    {"OPSTOP", CldataMajor::kStop},
    {"END", CldataMajor::kEnd},
    {"FINI", CldataMajor::kFinish},
    {"CLPRNT", CldataMajor::kText},
    {"NOPOST", CldataMajor::kText},
    {"TOOLNO", CldataMajor::kText},
    {"INTOL", CldataMajor::kText},
    {"OUTTOL", CldataMajor::kText},
    {"SEQNO", CldataMajor::kText},
    {"ARCSLP", CldataMajor::kText},
    {"CLEARP", CldataMajor::kText},
    {"REWIND", CldataMajor::kText},
    {"AUTOPS", CldataMajor::kText},
    {"INDIRV", CldataMajor::kText},
    {"INDIRP", CldataMajor::kText},
    {"TLAXIS", CldataMajor::kToolAxis},
    {"MSYS", CldataMajor::kFrame},
}};

}  // namespace

std::optional<CldataMajor> FindCldataMajor(std::string_view word) {
  const auto* found =
      std::find_if(kMajors.begin(), kMajors.end(), [&](const MajorWord& m) { return m.word == word; });
  return found == kMajors.end() ? std::nullopt : std::optional(found->major);
}

const char* AdviceOnCldataWord(std::string_view word) {
  if (word == "INSERT") {
    return "have the post write AUXFUN/n for an M word; G-code may not stand in CLDATA";
  }
  if (word == "GOHOME" || word == "ORIGIN" || word == "TRACUT" || word == "ROTABL" || word == "ROTHED" ||
      word == "ROTATE" || word == "TRANS") {
    return "have the post write the motions themselves, as GOTO in the part's coordinates";
  }
  if (word == "TLON" || word == "GOFWD") {
    return "have the post write arcs as CIRCLE with points, or as MOVARC";
  }
  return "not a word of this machine; see the table of supported words";
}

}  // namespace lambdajet::trajectory
