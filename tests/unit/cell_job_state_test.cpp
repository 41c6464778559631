#include <gtest/gtest.h>

#include <set>

#include "cell/core/job_state.hpp"

namespace lambdajet::cell {
namespace {

template <typename Visit>
void ForEachPair(Visit&& visit) {
  for (std::uint32_t state = 1; state <= kJobStateCount; ++state) {
    for (std::uint32_t happening = 0; happening < kHappeningCount; ++happening) {
      visit(static_cast<JobState>(state), static_cast<Happening>(happening));
    }
  }
}

TEST(JobStateTable, NeverLeavesAnEnd) {
  ForEachPair([](JobState state, Happening happening) {
    if (HasEnded(state)) {
      EXPECT_EQ(Next(state, happening), std::nullopt) << Name(state) << " " << Name(happening);
    }
  });
}

TEST(JobStateTable, ReachesEveryStateFromSubmission) {
  std::set<JobState> reached = {JobState::kAdmitting};
  for (std::uint32_t round = 0; round < kJobStateCount; ++round) {
    ForEachPair([&](JobState state, Happening happening) {
      const auto next = Next(state, happening);
      if (reached.contains(state) && next) {
        reached.insert(*next);
      }
    });
  }
  EXPECT_EQ(reached.size(), kJobStateCount);
}

TEST(JobStateTable, LetsEveryJobThatHasNotEndedEnd) {
  for (std::uint32_t first = 1; first <= kJobStateCount; ++first) {
    std::set<JobState> reached = {static_cast<JobState>(first)};
    for (std::uint32_t round = 0; round < kJobStateCount; ++round) {
      ForEachPair([&](JobState state, Happening happening) {
        const auto next = Next(state, happening);
        if (reached.contains(state) && next) {
          reached.insert(*next);
        }
      });
    }
    EXPECT_TRUE(std::any_of(reached.begin(), reached.end(), HasEnded)) << Name(static_cast<JobState>(first));
  }
}

TEST(JobStateTable, MovesTheMachineOnlyThroughStarting) {
  ForEachPair([](JobState state, Happening happening) {
    const auto next = Next(state, happening);
    const bool begins = next == JobState::kRunning && !HoldsMachine(state);
    EXPECT_TRUE(!begins || state == JobState::kInterrupted) << Name(state) << " " << Name(happening);
  });
}

TEST(JobStateTable, GivesUpOnlyWhatDoesNotHoldTheMachine) {
  ForEachPair([](JobState state, Happening happening) {
    if (happening == Happening::kCancelled && Next(state, happening)) {
      EXPECT_FALSE(HoldsMachine(state)) << Name(state);
    }
  });
}

}  // namespace
}  // namespace lambdajet::cell
