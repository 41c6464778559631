#include "cell/core/job_state.hpp"

#include <array>

namespace lambdajet::cell {
namespace {

struct Row {
  JobState from;
  Happening happening;
  JobState to;
};

constexpr Row kTable[] = {
    {JobState::kAdmitting, Happening::kAdmitted, JobState::kReady},
    {JobState::kAdmitting, Happening::kRefused, JobState::kRefused},
    {JobState::kAdmitting, Happening::kCancelled, JobState::kCancelled},
    {JobState::kAdmitting, Happening::kFailed, JobState::kFailed},
    {JobState::kAdmitting, Happening::kNoted, JobState::kAdmitting},
    {JobState::kReady, Happening::kStartAsked, JobState::kStarting},
    {JobState::kReady, Happening::kCancelled, JobState::kCancelled},
    {JobState::kStarting, Happening::kMoves, JobState::kRunning},
    {JobState::kStarting, Happening::kStartFailed, JobState::kReady},
    {JobState::kStarting, Happening::kRefused, JobState::kRefused},
    {JobState::kStarting, Happening::kInterrupted, JobState::kInterrupted},
    {JobState::kStarting, Happening::kCompleted, JobState::kCompleted},
    {JobState::kStarting, Happening::kFailed, JobState::kFailed},
    {JobState::kStarting, Happening::kNoted, JobState::kStarting},
    {JobState::kRunning, Happening::kStands, JobState::kHeld},
    {JobState::kRunning, Happening::kInterrupted, JobState::kInterrupted},
    {JobState::kRunning, Happening::kCompleted, JobState::kCompleted},
    {JobState::kRunning, Happening::kNoted, JobState::kRunning},
    {JobState::kHeld, Happening::kMoves, JobState::kRunning},
    {JobState::kHeld, Happening::kInterrupted, JobState::kInterrupted},
    {JobState::kHeld, Happening::kCompleted, JobState::kCompleted},
    {JobState::kHeld, Happening::kNoted, JobState::kHeld},
    {JobState::kInterrupted, Happening::kStartAsked, JobState::kStarting},
    {JobState::kInterrupted, Happening::kMoves, JobState::kRunning},  // the drive was only out of hearing
    {JobState::kInterrupted, Happening::kStands, JobState::kHeld},
    {JobState::kInterrupted, Happening::kCompleted, JobState::kCompleted},
    {JobState::kInterrupted, Happening::kCancelled, JobState::kCancelled},
    {JobState::kInterrupted, Happening::kNoted, JobState::kInterrupted},
};

constexpr std::array<std::string_view, kJobStateCount + 1> kStates = {
    "UNSPECIFIED", "ADMITTING",   "REFUSED",   "READY",     "STARTING", "RUNNING",
    "HELD",        "INTERRUPTED", "COMPLETED", "CANCELLED", "FAILED"};
constexpr std::array<std::string_view, kHappeningCount> kHappenings = {
    "ADMITTED",    "REFUSED",   "START_ASKED", "START_FAILED", "MOVES", "STANDS",
    "INTERRUPTED", "COMPLETED", "CANCELLED",   "FAILED",       "NOTED"};

}  // namespace

std::string_view Name(JobState state) {
  const auto index = static_cast<std::uint32_t>(state);
  return index <= kJobStateCount ? kStates[index] : kStates[0];
}

std::string_view Name(Happening happening) { return kHappenings[static_cast<std::uint32_t>(happening)]; }

std::optional<JobState> Next(JobState state, Happening happening) {
  for (const Row& row : kTable) {
    if (row.from == state && row.happening == happening) {
      return row.to;
    }
  }
  return std::nullopt;
}

bool HasEnded(JobState state) {
  return state == JobState::kRefused || state == JobState::kCompleted || state == JobState::kCancelled ||
         state == JobState::kFailed;
}

bool HoldsMachine(JobState state) {
  return state == JobState::kStarting || state == JobState::kRunning || state == JobState::kHeld;
}

}  // namespace lambdajet::cell
