#include "main_motion/core/state_table.hpp"

#include <array>

namespace lambdajet::main_motion {
namespace {

using enum ModuleMode;
using A = Action;
using E = Event;

constexpr std::array kTable = std::to_array<Row>({
    {kOff, E::kPowerUp, {kInitialising, A::kShutDown}},
    {kInitialising, E::kInitialised, {kSafe, A::kNone}},
    {kInitialising, E::kHomed, {kReady, A::kNone}},
    {kInitialising, E::kStop, {kStopping, A::kShutDown}},
    {kInitialising, E::kFault, {kFault, A::kShutDown}},

    {kSafe, E::kHome, {kInitialising, A::kBeginHoming}},
    {kSafe, E::kLoad, {kSafe, A::kAdoptPlan}},
    {kSafe, E::kUnload, {kSafe, A::kDropPlan}},
    {kSafe, E::kReset, {kSafe, A::kNone}},
    {kSafe, E::kResetUnreferenced, {kSafe, A::kNone}},
    {kSafe, E::kStop, {kStopping, A::kShutDown}},
    {kSafe, E::kFault, {kFault, A::kShutDown}},

    {kReady, E::kHome, {kInitialising, A::kBeginHoming}},
    {kReady, E::kLoad, {kReady, A::kAdoptPlan}},
    {kReady, E::kUnload, {kReady, A::kDropPlan}},
    {kReady, E::kArm, {kReady, A::kPrepare}},
    {kReady, E::kArmed, {kArmed, A::kNone}},
    {kReady, E::kReset, {kReady, A::kNone}},
    {kReady, E::kStop, {kStopping, A::kShutDown}},
    {kReady, E::kFault, {kFault, A::kShutDown}},

    {kArmed, E::kLoad, {kReady, A::kAdoptPlan}},
    {kArmed, E::kUnload, {kReady, A::kDropPlan}},
    {kArmed, E::kPeerRunning, {kRunning, A::kNone}},
    {kArmed, E::kPeerResuming, {kResuming, A::kRestore}},
    {kArmed, E::kStop, {kStopping, A::kShutDown}},
    {kArmed, E::kFault, {kFault, A::kShutDown}},

    {kRunning, E::kPeerHolding, {kHolding, A::kNone}},
    {kRunning, E::kPeerHeld, {kHolding, A::kSuspend}},
    {kRunning, E::kPeerComplete, {kComplete, A::kFinish}},
    {kRunning, E::kPeerLost, {kHolding, A::kShutDown}},
    {kRunning, E::kInputMissing, {kHolding, A::kSuspend}},
    {kRunning, E::kStop, {kStopping, A::kShutDown}},
    {kRunning, E::kFault, {kFault, A::kShutDown}},

    {kHolding, E::kPeerHeld, {kHolding, A::kSuspend}},
    {kHolding, E::kPeerLost, {kHolding, A::kShutDown}},
    {kHolding, E::kOutputsOff, {kHeld, A::kNone}},
    {kHolding, E::kStop, {kStopping, A::kShutDown}},
    {kHolding, E::kFault, {kFault, A::kShutDown}},

    {kHeld, E::kPeerResuming, {kResuming, A::kRestore}},
    {kHeld, E::kPeerLost, {kHeld, A::kShutDown}},
    {kHeld, E::kStop, {kStopping, A::kShutDown}},
    {kHeld, E::kFault, {kFault, A::kShutDown}},

    {kResuming, E::kRestored, {kRunning, A::kNone}},
    {kResuming, E::kPeerHolding, {kHolding, A::kSuspend}},
    {kResuming, E::kPeerHeld, {kHolding, A::kSuspend}},
    {kResuming, E::kPeerLost, {kHolding, A::kShutDown}},
    {kResuming, E::kStop, {kStopping, A::kShutDown}},
    {kResuming, E::kFault, {kFault, A::kShutDown}},

    {kComplete, E::kLoad, {kReady, A::kAdoptPlan}},
    {kComplete, E::kUnload, {kReady, A::kDropPlan}},
    {kComplete, E::kStop, {kStopping, A::kShutDown}},
    {kComplete, E::kFault, {kFault, A::kShutDown}},

    {kStopping, E::kOutputsOff, {kStopped, A::kNone}},
    {kStopping, E::kStop, {kStopping, A::kNone}},
    {kStopping, E::kFault, {kFault, A::kShutDown}},

    {kStopped, E::kStop, {kStopped, A::kNone}},
    {kStopped, E::kReset, {kReady, A::kNone}},
    {kStopped, E::kResetUnreferenced, {kSafe, A::kNone}},
    {kStopped, E::kFault, {kFault, A::kShutDown}},

    {kFault, E::kStop, {kFault, A::kShutDown}},
    {kFault, E::kReset, {kReady, A::kNone}},
    {kFault, E::kResetUnreferenced, {kSafe, A::kNone}},
});

}  // namespace

std::span<const Row> StateTable() { return kTable; }

std::optional<Transition> Next(ModuleMode mode, Event event) {
  return FindTransition(StateTable(), mode, event);
}

}  // namespace lambdajet::main_motion
