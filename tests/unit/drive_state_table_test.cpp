#include <gtest/gtest.h>

#include <set>
#include <vector>

#include "drive/core/state_table.hpp"

// The table is written down here a second time on purpose: a row that is changed, lost or added by mistake is seen.
namespace lambdajet::drive {
namespace {

using enum ModuleMode;
using E = Event;
using A = Action;

const std::vector<Row> kExpected = {
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
    {kHeld, E::kHold, {kHeld, A::kRampDown}},
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
};

constexpr int kModeCount = static_cast<int>(kFault) + 1;
constexpr int kEventCount = static_cast<int>(E::kFault) + 1;

TEST(DriveStateTable, HasExactlyTheseRows) {
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

TEST(DriveStateTable, StopsFromEverywhereAndLatches) {
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

TEST(DriveStateTable, ReachesEveryMode) {
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
}  // namespace lambdajet::drive
