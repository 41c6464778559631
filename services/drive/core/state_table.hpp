// Is the drive module's state machine: one table (mode, event) -> (mode, action).
//
// Model: the modes of link.md's module words; guards are decided before an event is named, so that the table has no
// conditions. A pair that is not in the table is refused and changes nothing. Threads: constants.
#pragma once

#include <optional>
#include <span>

#include "foundation/motion/state_table.hpp"

namespace lambdajet::drive {

enum class Event {
  kPowerUp,
  kInitialised,
  kHome,
  kHomed,
  kLoad,
  kUnload,
  kArm,
  kPositioned,
  kStart,
  kStartTime,
  kContinueTime,
  kHold,
  kStandstill,
  kBackUp,
  kRetrace,
  kResume,
  kPeerReady,
  kAtRate,
  kPlanEnd,
  kStop,
  kReset,
  kResetUnreferenced,
  kFault
};

enum class Action {
  kNone,
  kBeginHoming,
  kEnable,
  kAdoptPlan,
  kDropPlan,
  kPosition,
  kScheduleStart,
  kBeginPlay,
  kRampDown,
  kBackUp,
  kRetrace,
  kResumeAfterwards,
  kAwaitPeer,
  kRampUp,
  kDisable
};

using Transition = ModeTransition<Action>;
using Row = ModeRow<Event, Action>;

std::span<const Row> StateTable();
std::optional<Transition> Next(ModuleMode mode, Event event);

}  // namespace lambdajet::drive
