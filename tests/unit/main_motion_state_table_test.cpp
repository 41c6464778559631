#include <gtest/gtest.h>

#include <set>
#include <vector>

#include "main_motion/core/state_table.hpp"

// The table is written down here a second time on purpose: a row that is changed, lost or added by mistake is seen.
namespace lambdajet::main_motion {
namespace {

using enum ModuleMode;
using E = Event;
using A = Action;

const std::vector<Row> kExpected = {
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
};

constexpr int kModeCount = static_cast<int>(kFault) + 1;
constexpr int kEventCount = static_cast<int>(E::kFault) + 1;

TEST(MainMotionStateTable, HasExactlyTheseRows) {
  std::size_t found = 0;
  for (int mode = 0; mode < kModeCount; ++mode) {
    for (int event = 0; event < kEventCount; ++event) {
      const auto m = static_cast<ModuleMode>(mode);
      const auto e = static_cast<Event>(event);
      std::optional<Transition> expected;
      for (const Row& row : kExpected) {
        if (row.mode == m && row.event == e) {
          expected = row.transition;
        }
      }
      EXPECT_EQ(Next(m, e), expected) << Name(m) << " event " << event;
      found += Next(m, e).has_value() ? 1 : 0;
    }
  }
  EXPECT_EQ(found, kExpected.size());
  EXPECT_EQ(StateTable().size(), kExpected.size()) << "a pair stands in the table twice";
}

bool Plays(ModuleMode mode) { return mode == kRunning || mode == kHolding || mode == kResuming; }

TEST(MainMotionStateTable, StopsFromEverywhereAndLatches) {
  for (int mode = static_cast<int>(kInitialising); mode < kModeCount; ++mode) {
    const auto m = static_cast<ModuleMode>(mode);
    ASSERT_TRUE(Next(m, E::kStop)) << Name(m);
    const ModuleMode after = Next(m, E::kStop)->mode;
    EXPECT_TRUE(after == kStopping || after == kStopped || after == kFault) << Name(m);
    if (m != kFault) {
      ASSERT_TRUE(Next(m, E::kFault)) << Name(m);
      EXPECT_EQ(Next(m, E::kFault)->mode, kFault);
    }
  }
  // Only a reset leads out of STOPPED and FAULT, and no reset ever leads into motion.
  for (const ModuleMode latched : {kStopped, kFault}) {
    for (int event = 0; event < kEventCount; ++event) {
      const auto e = static_cast<Event>(event);
      const auto next = Next(latched, e);
      if (next && next->mode != kStopped && next->mode != kFault) {
        EXPECT_TRUE(e == E::kReset || e == E::kResetUnreferenced);
        EXPECT_TRUE(next->mode == kReady || next->mode == kSafe);
      }
    }
  }
  for (const Row& row : StateTable()) {
    if (row.event == E::kReset || row.event == E::kResetUnreferenced || row.event == E::kHomed) {
      EXPECT_FALSE(Plays(row.transition.mode));
    }
    if (Plays(row.transition.mode) && !Plays(row.mode)) {
      EXPECT_TRUE(row.mode == kArmed || row.mode == kHeld) << Name(row.mode);
    }
  }
}

TEST(MainMotionStateTable, ReachesEveryMode) {
  std::set<ModuleMode> reached = {kOff};
  for (std::size_t before = 0; before != reached.size();) {
    before = reached.size();
    for (const Row& row : StateTable()) {
      if (reached.contains(row.mode)) {
        reached.insert(row.transition.mode);
      }
    }
  }
  EXPECT_EQ(reached.size(), static_cast<std::size_t>(kModeCount));
}

}  // namespace
}  // namespace lambdajet::main_motion
