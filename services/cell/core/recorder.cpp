#include "cell/core/recorder.hpp"

#include <algorithm>

namespace lambdajet::cell {
namespace {
constexpr double kTracePeriod_s = 0.1;
constexpr double kLongestCycle_s = 1.0;  // what is longer was a pause of the cell itself
}  // namespace

std::uint32_t Recorder::Counter::NewSince(const ModuleView& module) {
  const bool anew = module.session != session;
  const std::uint32_t before = anew ? module.loop_overruns : last;
  session = module.session;
  last = module.loop_overruns;
  return module.loop_overruns - std::min(before, module.loop_overruns);
}

void Recorder::Begin(std::int64_t started_ns) {
  *this = Recorder();
  started_ns_ = started_ns;
}

void Recorder::Cycle(const MachineView& machine, JobState state, std::int64_t now_ns) {
  const double dt_s = last_ns_ == 0 ? 0.0 : std::min(SecondsBetween(last_ns_, now_ns), kLongestCycle_s);
  last_ns_ = now_ns;
  if (!machine.drive || !machine.main_motion || (state != JobState::kRunning && state != JobState::kHeld)) {
    return;
  }
  const DriveView& drive = *machine.drive;
  gathered_.drive_overruns += drive_.NewSince(drive);
  gathered_.main_motion_overruns += main_motion_.NewSince(*machine.main_motion);
  gathered_.held_time_s += state == JobState::kHeld ? dt_s : 0.0;
  gathered_.cutting_time_s +=
      machine.main_motion->jet_on && drive.s_rate_mm_per_s > kMotion_mm_per_s ? dt_s : 0.0;
  if (now_ns >= next_trace_ns_ && Heard(drive, now_ns)) {
    next_trace_ns_ = After(std::max(now_ns - static_cast<std::int64_t>(kTracePeriod_s * 1e9), next_trace_ns_),
                           kTracePeriod_s);
    gathered_.trace.push_back({SecondsBetween(started_ns_, drive.heard_ns), drive.actuator_position_mm[0],
                               drive.actuator_position_mm[1], drive.actuator_velocity_mm_per_s[0],
                               drive.actuator_velocity_mm_per_s[1], drive.s_mm});
  }
}

void Append(JobRecord& record, const JobRecord& later) {
  record.cutting_time_s += later.cutting_time_s;
  record.held_time_s += later.held_time_s;
  record.drive_overruns += later.drive_overruns;
  record.main_motion_overruns += later.main_motion_overruns;
  record.events.insert(record.events.end(), later.events.begin(), later.events.end());
  record.trace.insert(record.trace.end(), later.trace.begin(), later.trace.end());
}

}  // namespace lambdajet::cell
