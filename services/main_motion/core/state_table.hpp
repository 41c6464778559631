// Is the main-motion module's state machine: one table (mode, event) -> (mode, action).
//
// Model: the same modes as the drive's; main motion follows the drive, so most events are what the drive's state says.
// A pair that is not in the table is refused and changes nothing. Threads: constants.
#pragma once

#include <optional>
#include <span>

#include "foundation/motion/state_table.hpp"

namespace lambdajet::main_motion {

enum class Event {
  kPowerUp,
  kInitialised,
  kHome,
  kHomed,
  kLoad,
  kUnload,
  kArm,
  kArmed,
  kPeerRunning,
  kPeerHolding,
  kPeerHeld,
  kPeerResuming,
  kRestored,
  kPeerComplete,
  kPeerLost,
  kInputMissing,
  kStop,
  kOutputsOff,
  kReset,
  kResetUnreferenced,
  kFault
};

enum class Action {
  kNone,
  kBeginHoming,
  kAdoptPlan,
  kDropPlan,
  kPrepare,
  kSuspend,
  kRestore,
  kFinish,
  kShutDown
};

using Transition = ModeTransition<Action>;
using Row = ModeRow<Event, Action>;

std::span<const Row> StateTable();
std::optional<Transition> Next(ModuleMode mode, Event event);

}  // namespace lambdajet::main_motion
