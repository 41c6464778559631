// Lists the major words of CLDATA that the reader obeys; the CLDATA reader's own, not for others.
//
// Model: the words of ISO 4343 as CAM posts write them, with what NX, Creo and CATIA call the same. Threads: pure.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace lambdajet::trajectory {

enum class CldataMajor : std::uint8_t {
  kText,  // says nothing about motion
  kUnits,
  kFrom,
  kGoto,
  kGodelta,
  kRapid,
  kFeedrate,
  kCircle,
  kMoveArc,
  kCutter,
  kToolCompensation,
  kMultax,
  kToolAxis,
  kFrame,
  kCycle,
  kSpindle,
  kAuxiliary,
  kCoolant,
  kDelay,
  kLoadTool,
  kTolerance,
  kStop,
  kEnd,
  kFinish,
};

// Nothing for a word that is not obeyed. The word in upper case without spaces.
std::optional<CldataMajor> FindCldataMajor(std::string_view word);

// Words a post may well write that the reader refuses, with what to do instead.
const char* AdviceOnCldataWord(std::string_view word);

}  // namespace lambdajet::trajectory
