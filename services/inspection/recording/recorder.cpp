#include "inspection/recording/recorder.hpp"

#include <algorithm>

#include "foundation/contract/trouble.hpp"

namespace lambdajet::inspection {
namespace {

constexpr std::uint64_t kSamplesPerBatch = 10;

absl::Status NoRecording(std::uint64_t plan) {
  return Trouble(absl::StatusCode::kNotFound, "NO_RECORDING",
                 "no recording of plan " + std::to_string(plan) + "; begin one before the plan starts",
                 {{"plan_id", std::to_string(plan)}});
}

template <class Sample>
std::uint64_t Append(std::span<const Sample> from, std::vector<Sample>& to) {
  const std::size_t room = kMostSamples - std::min(kMostSamples, to.size());
  const std::size_t taken = std::min(room, from.size());
  to.insert(to.end(), from.begin(), from.begin() + static_cast<std::ptrdiff_t>(taken));
  return from.size() - taken;
}

}  // namespace

std::uint64_t Recorder::Stream::Lost(const BatchOrigin& origin) {
  const bool next = origin.session == session && origin.sequence_number > last;
  const std::uint64_t lost = next ? origin.sequence_number - last - 1 : 0;
  if (origin.session != session || next) {
    session = origin.session;
    last = origin.sequence_number;
  }
  return lost;
}

Recorder::Recording* Recorder::OpenFor(std::uint64_t plan) {
  const auto found = std::ranges::find_if(recordings_, [plan](const Recording& r) {
    return r.open && std::ranges::find(r.plans, plan) != r.plans.end();
  });
  return found == recordings_.end() ? nullptr : &*found;
}

Recorder::Recording* Recorder::Named(std::uint64_t plan) {
  const auto found = std::ranges::find(recordings_, plan, &Recording::plan);
  return found == recordings_.end() ? nullptr : &*found;
}

void Recorder::CountLost(std::uint64_t batches) {
  for (Recording& recording : recordings_) {
    if (recording.open && !recording.truth.sheet.empty()) {
      recording.missing += batches * kSamplesPerBatch;
    }
  }
}

void Recorder::Begin(std::uint64_t plan, std::span<const std::uint64_t> further_plans) {
  const std::lock_guard lock(mutex_);
  Recording* known = Named(plan);
  if (known != nullptr && known->open && !further_plans.empty()) {
    known->plans.insert(known->plans.end(), further_plans.begin(), further_plans.end());
    return;
  }
  std::erase_if(recordings_, [plan](const Recording& r) { return r.plan == plan; });
  if (recordings_.size() == kMostRecordings) {
    recordings_.pop_front();
  }
  Recording& recording = recordings_.emplace_back();
  recording.plan = plan;
  recording.plans.assign(further_plans.begin(), further_plans.end());
  recording.plans.push_back(plan);
}

absl::StatusOr<RecordingSize> Recorder::End(std::uint64_t plan) {
  const std::lock_guard lock(mutex_);
  Recording* recording = Named(plan);
  if (recording == nullptr) {
    return NoRecording(plan);
  }
  recording->open = false;
  return RecordingSize{recording->truth.sheet.size(), recording->missing};
}

void Recorder::TakeSheet(const BatchOrigin& origin, std::span<const SheetTruth> samples) {
  const std::lock_guard lock(mutex_);
  CountLost(sheet_.Lost(origin));
  if (Recording* recording = OpenFor(origin.plan)) {
    recording->missing += Append(samples, recording->truth.sheet);
  }
}

void Recorder::TakeJet(const BatchOrigin& origin, std::span<const JetTruth> samples,
                       std::span<const WaterSwitch> switches, bool jet_on_after, double lag_time_s) {
  const std::lock_guard lock(mutex_);
  CountLost(jet_.Lost(origin));
  Recording* recording = OpenFor(origin.plan);
  if (recording == nullptr) {
    return;
  }
  if (!recording->saw_jet) {
    recording->saw_jet = true;
    recording->truth.jet_on_at_start = switches.empty() ? jet_on_after : !switches.front().on;
  }
  recording->truth.lag_time_s = lag_time_s;
  recording->missing += Append(samples, recording->truth.jet);
  recording->missing += Append(switches, recording->truth.switches);
}

absl::StatusOr<Truth> Recorder::TruthOf(std::uint64_t plan) const {
  const std::lock_guard lock(mutex_);
  const auto found = std::ranges::find(recordings_, plan, &Recording::plan);
  if (found == recordings_.end()) {
    return NoRecording(plan);
  }
  return found->truth;
}

}  // namespace lambdajet::inspection
