// Names the modes, commands and reasons that both machine modules and everyone who talks to them share.
//
// Model: one table of modes for drive and main motion (CiA 402 towards hardware, PLCopen and ISA-95 words towards people).
// The numbers are the wire's: append only.
// Threads: constants.
#pragma once

#include <cstdint>
#include <string_view>

namespace lambdajet {

enum class ModuleMode : std::uint32_t {
  kOff,
  kInitialising,
  kSafe,
  kReady,
  kArmed,
  kRunning,
  kHolding,
  kHeld,
  kResuming,
  kComplete,
  kStopping,
  kStopped,
  kFault
};

enum class Verb : std::uint32_t {
  kNone,
  kLoad,
  kArm,
  kStart,
  kHold,
  kResume,
  kRetrace,
  kOverride,
  kStop,
  kReset,
  kHome,
  kUnload,
  kJog
};

enum class ModuleReason : std::uint32_t {
  kNone,
  kCommanded,    // an operator, MES or CAM asked for it
  kPeerLost,     // the other module's state did not come in time
  kPeerStopped,  // the other module stands in STOPPED, FAULT or SAFE
  kStarved,      // the buffer would have run out
  kRestarted,    // the node started anew: reference before motion
  kNotReferenced,
  kWrongMode,  // the command does not fit the mode
  kWrongPlan,
  kFollowingError,
  kActuatorLimit,
  kOverruns,
  kClockOffset,
  kTwoWriters,
  kPressureLost,
  kSensorFault,
  kNoMachineDescription,
  kGateTimeout,
  kStaleCommand,
  kInputTimeout,  // an input for which the program waits did not come in time
  kJetNotClosed   // water still flows long after the valve was told to close
};

// Plays no path and obeys none: stands, or is about to, and needs a person or its own start before it may move.
bool IsDown(ModuleMode mode);

// UPPER_SNAKE, as on every wire: "PEER_LOST".
std::string_view Name(ModuleMode mode);
std::string_view Name(Verb verb);
std::string_view Name(ModuleReason reason);

}  // namespace lambdajet
