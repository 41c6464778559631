#include "drive/core/state_table.hpp"

#include <array>

namespace lambdajet::drive {
namespace {

using enum ModuleMode;
using A = Action;
using E = Event;

constexpr std::array kTable = std::to_array<Row>({
    {kOff, E::kPowerUp, {kInitialising, A::kNone}},
    {kInitialising, E::kInitialised, {kSafe, A::kNone}},
    {kInitialising, E::kHomed, {kReady, A::kEnable}},
    {kInitialising, E::kStop, {kStopped, A::kDisable}},
    {kInitialising, E::kFault, {kFault, A::kDisable}},

    {kSafe, E::kHome, {kInitialising, A::kBeginHoming}},
    {kSafe, E::kLoad, {kSafe, A::kAdoptPlan}},
    {kSafe, E::kUnload, {kSafe, A::kDropPlan}},
    {kSafe, E::kReset, {kSafe, A::kNone}},
    {kSafe, E::kResetUnreferenced, {kSafe, A::kNone}},
    {kSafe, E::kStop, {kStopped, A::kDisable}},
    {kSafe, E::kFault, {kFault, A::kDisable}},

    {kReady, E::kHome, {kInitialising, A::kBeginHoming}},
    {kReady, E::kLoad, {kReady, A::kAdoptPlan}},
    {kReady, E::kUnload, {kReady, A::kDropPlan}},
    {kReady, E::kArm, {kReady, A::kPosition}},
    {kReady, E::kPositioned, {kArmed, A::kNone}},
    {kReady, E::kReset, {kReady, A::kNone}},
    {kReady, E::kStop, {kStopping, A::kRampDown}},
    {kReady, E::kFault, {kFault, A::kDisable}},

    {kArmed, E::kLoad, {kReady, A::kAdoptPlan}},
    {kArmed, E::kUnload, {kReady, A::kDropPlan}},
    {kArmed, E::kStart, {kArmed, A::kScheduleStart}},
    {kArmed, E::kStartTime, {kRunning, A::kBeginPlay}},
    {kArmed, E::kContinueTime, {kResuming, A::kAwaitPeer}},
    {kArmed, E::kStop, {kStopping, A::kRampDown}},
    {kArmed, E::kFault, {kFault, A::kDisable}},

    {kRunning, E::kHold, {kHolding, A::kRampDown}},
    {kRunning, E::kPlanEnd, {kComplete, A::kNone}},
    {kRunning, E::kStop, {kStopping, A::kRampDown}},
    {kRunning, E::kFault, {kFault, A::kDisable}},

    {kHolding, E::kHold, {kHolding, A::kRampDown}},
    {kHolding, E::kStandstill, {kHeld, A::kNone}},
    {kHolding, E::kResume, {kHolding, A::kResumeAfterwards}},
    {kHolding, E::kBackUp, {kHolding, A::kResumeAfterwards}},
    {kHolding, E::kStop, {kStopping, A::kRampDown}},
    {kHolding, E::kFault, {kFault, A::kDisable}},

    {kHeld, E::kHold, {kHeld, A::kRampDown}},  // takes a resume back that still waits for the peer
    {kHeld, E::kBackUp, {kHolding, A::kBackUp}},
    {kHeld, E::kRetrace, {kHolding, A::kRetrace}},
    {kHeld, E::kResume, {kResuming, A::kAwaitPeer}},
    {kHeld, E::kStop, {kStopping, A::kRampDown}},
    {kHeld, E::kFault, {kFault, A::kDisable}},

    {kResuming, E::kPeerReady, {kResuming, A::kRampUp}},
    {kResuming, E::kAtRate, {kRunning, A::kNone}},
    {kResuming, E::kPlanEnd, {kComplete, A::kNone}},
    {kResuming, E::kHold, {kHolding, A::kRampDown}},
    {kResuming, E::kStop, {kStopping, A::kRampDown}},
    {kResuming, E::kFault, {kFault, A::kDisable}},

    {kComplete, E::kLoad, {kReady, A::kAdoptPlan}},
    {kComplete, E::kUnload, {kReady, A::kDropPlan}},
    {kComplete, E::kStop, {kStopping, A::kRampDown}},
    {kComplete, E::kFault, {kFault, A::kDisable}},

    {kStopping, E::kStandstill, {kStopped, A::kDisable}},
    {kStopping, E::kStop, {kStopping, A::kNone}},
    {kStopping, E::kFault, {kFault, A::kDisable}},

    {kStopped, E::kStop, {kStopped, A::kNone}},
    {kStopped, E::kReset, {kReady, A::kEnable}},
    {kStopped, E::kResetUnreferenced, {kSafe, A::kNone}},
    {kStopped, E::kFault, {kFault, A::kDisable}},

    {kFault, E::kStop, {kFault, A::kNone}},
    {kFault, E::kReset, {kReady, A::kEnable}},
    {kFault, E::kResetUnreferenced, {kSafe, A::kNone}},
});

}  // namespace

std::span<const Row> StateTable() { return kTable; }

std::optional<Transition> Next(ModuleMode mode, Event event) {
  return FindTransition(StateTable(), mode, event);
}

}  // namespace lambdajet::drive
