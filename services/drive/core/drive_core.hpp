// Is the drive module's mind: one cyclic step that plays a plan on the path clock, obeys, watches and reports.
//
// Model: the path clock is the master axis of the two modules. Feed hold, override, resume and retrace change d tau/dt by
// jerk-limited moves; gates stop the path until main motion reports them passed (a dwell after its own time, a stop by
// RESUME); a buffer that would run short holds on the path and continues by itself when refilled; a silent peer holds on
// the path (stop category 2) and, if it stays away, stops and takes the power off (category 1, latched). The state machine
// is state_table.hpp. After a start the module is SAFE: HOME references it. A plan stopped half-way keeps its place: after
// RESET, ARM goes back to it and START continues as a resume does.
// Frames and units: actuator coordinates in mm; s; common time in ns.
// Threads: one, the control loop; inputs are handed over with the step. Cost: bounded; no allocation after construction.
// Errors: refusals are answers in the state (command receipt); nothing is thrown.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "drive/core/drive_hardware.hpp"
#include "drive/core/play_out.hpp"
#include "drive/core/segment_buffer.hpp"
#include "drive/core/state_table.hpp"
#include "foundation/machine/machine_description.hpp"
#include "foundation/motion/command_receiver.hpp"
#include "foundation/motion/link_samples.hpp"
#include "foundation/motion/loop_watch.hpp"
#include "foundation/motion/ring.hpp"
#include "foundation/motion/sequence_guard.hpp"
#include "foundation/motion/silence_watch.hpp"

namespace lambdajet::drive {

struct DriveConfig {
  std::uint64_t session = 1;
  double period_s = 0.001;
  double setpoint_lead_s = 0.05;      // how far ahead of time set-points go to the servo
  double peer_deadline_s = 0.02;      // main-motion state, while a plan is running
  double peer_patience_s = 2.0;       // then the hold becomes a stop
  double starvation_reserve_s = 0.1;  // program time kept beyond the stopping distance
  double refill_s = 0.8;              // program time that ends a starvation hold
  double clock_offset_limit_s = 0.0002;
  bool hold_on_clock_offset = false;  // while cutting: finish (false) or hold
  double following_error_limit_mm = 0.5;
  std::uint32_t following_error_cycles = 5;
  int overruns_allowed = 5;  // in overrun_window cycles
  std::uint32_t overrun_window = 100;
  double resume_overlap_mm = 1.0;  // a cut that was held is taken up this much earlier
  double retrace_rate = 0.5;
  double command_age_limit_s = 2.0;
  double positioning_share = 0.3;  // of the actuators' speed, for the move to a plan's start
  // Of their acceleration. Gentle: nothing takes the sheet's swing out of this move, and on levers that hardly damp it
  // a hasty one still swings when the first contour is cut.
  double positioning_acceleration_share = 0.03;
  double rate_acceleration_per_s = 5.0;  // bounds of the path clock; the actuators' limits may narrow them
  double rate_jerk_per_s2 = 60.0;
  SegmentBuffer::Limits buffer;
};

// What listeners handed over since the last step.
struct DriveInputs {
  std::span<const ModuleCommand> commands;
  std::span<const MainMotionState> peer;
  std::span<const SegmentBatch> segments;
  std::span<const ProcessBatch> process;
  LinkFigures link;
};

class DriveCore {
 public:
  DriveCore(const DriveConfig& config, DriveHardware& hardware);

  // Limits and version; taken over when the module does not move. Without one ARM is refused.
  void AdoptMachine(const MachineDescription& machine);
  void Step(std::int64_t now_ns, const DriveInputs& inputs);

  const DriveState& state() const { return state_; }
  // The next change of mode that nobody has asked for yet.
  std::optional<ModeChange> TakeModeChange();
  std::uint32_t machine_version() const { return limits_.version; }
  std::uint32_t rejected_segments() const { return rejected_segments_; }
  std::uint32_t setpoints_late() const { return readings_.setpoints_late; }

 private:
  struct Limits {
    std::uint32_t version = 0;
    bool known = false;
    std::array<ActuatorLimits, kActuatorCount> actuators{};
    double velocity_mm_per_s = 0.0;  // the weaker actuator's
    double acceleration_mm_per_s2 = 0.0;
    double jerk_mm_per_s3 = 0.0;
  };
  struct LoadedPlan {
    std::uint64_t id = 0;
    std::uint32_t segment_count = 0;
    double duration_s = 0.0;
    double tau_s = 0.0;  // where START begins: 0, or where a stop left it
    bool begun = false;
  };

  struct Backing {  // a way back along the path that waits for the water to be off
    Event event = Event::kRetrace;
    double distance_mm = 0.0;
    ModuleReason reason = ModuleReason::kNone;
  };

  // Inputs.
  void TakeInputs(const DriveInputs& inputs);
  void TakePeer(const MainMotionState& peer);
  ModuleReason Obey(const ModuleCommand& command);
  ModuleReason ObeyLoad(const ModuleCommand& command);
  ModuleReason ObeyArm(const ModuleCommand& command);
  ModuleReason ObeyStart(const ModuleCommand& command);
  ModuleReason ObeyResume();
  ModuleReason ObeyOverride(double value);
  ModuleReason ObeyRetrace(double distance_mm);
  void TakeSegments(const SegmentBatch& batch);
  void TakeGates(const ProcessBatch& batch);

  // Watches.
  void WatchLoop();
  void WatchHardware();
  void WatchPeer();
  void WatchClock();
  void WatchBuffer();
  void WatchGates();
  void WatchMotion();
  void WatchArming();
  void WatchRetrace();
  void WatchOverride();

  // Motion.
  bool Apply(Event event, ModuleReason reason);
  void Act(Action action);
  void GoOn(ModuleReason reason);
  void BeginRetrace(double distance_mm);
  void PlayAhead();
  bool WithinLimits(const Setpoint& setpoint) const;
  RateLimits RateLimitsNow() const;
  double AllowedRate() const;
  double AheadTau() const;  // program time the buffer bears: to its end, or to a closed gate
  bool WholePlanHeld() const;
  bool Moving() const;
  bool Standing() const;
  bool PeerFit() const;
  bool WaterIsOff() const;
  bool PeerReadyToResume() const;
  bool ClockFit() const;
  void Report();

  DriveConfig config_;
  DriveHardware& hardware_;
  std::int64_t period_ns_;
  SegmentBuffer buffer_;
  PlayOut play_;
  std::vector<Gate> gates_;
  DriveState state_;
  DriveReadings readings_;
  Limits limits_;
  std::optional<Limits> offered_limits_;
  LoadedPlan plan_;

  std::int64_t now_ns_ = 0;
  ModuleMode mode_ = ModuleMode::kOff;
  ModuleReason reason_ = ModuleReason::kNone;
  double override_ = 1.0;
  double rate_wanted_ = 1.0;
  std::uint32_t gate_passed_ = 0;
  std::uint32_t dwelling_gate_ = 0;
  std::int64_t dwell_since_ns_ = 0;
  bool stop_gate_released_ = false;
  bool arming_ = false;
  bool positioning_ = false;
  bool homing_ = false;
  bool resume_afterwards_ = false;
  std::optional<Backing> backing_;
  bool retracing_ = false;
  double retrace_to_s_mm_ = 0.0;
  bool ramping_up_ = false;
  bool cutting_at_hold_ = false;
  std::uint64_t mode_since_ = 0;      // sequence number of the last change of mode
  std::uint64_t resuming_since_ = 0;  // sequence number of the first RESUMING state
  std::int64_t start_at_ns_ = 0;

  MainMotionState peer_;
  SequenceGuard peer_guard_;
  SequenceGuard segment_guard_;
  SequenceGuard process_guard_;
  SilenceWatch peer_watch_;
  CommandReceiver commands_;
  LoopWatch loop_watch_;
  bool peer_lost_ = true;
  bool peer_restarted_ = false;
  std::int64_t peer_unfit_since_ns_ = 0;

  std::uint32_t following_cycles_ = 0;
  std::uint32_t rejected_segments_ = 0;
  Ring<ModeChange, 64> changes_;
};

}  // namespace lambdajet::drive
