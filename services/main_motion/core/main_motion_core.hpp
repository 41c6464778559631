// Is the main-motion module's mind: follows the drive's path length and makes the jet do its part, each thing at its own instant.
//
// Model: the module has no clock of its own for the path. From each drive state it predicts when the path reaches the
// next process events and schedules the outputs early by the valves' delays (learnt from the module's own sensor),
// moving them as the prediction moves. At a pierce gate it acts only while the drive says that it stands there: stand-off,
// pressure, jet, pierce time, abrasive; at a measuring gate it lets the machine settle and takes a picture; at an input's
// gate it watches the input, and holds where that does not come in time. On a hold the
// jet is taken off at standstill, and HELD is said only when no water flows or can still come; a resume pierces again. If the drive falls silent, abrasive and jet go off at once and
// the pump to idle. State machine: state_table.hpp.
// Frames and units: mm, s, MPa, g/min; common time in ns; pictures in C.
// Threads: one, the control loop. Cost: bounded; no allocation after construction. Errors: refusals are answers in the state.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "foundation/machine/machine_description.hpp"
#include "foundation/motion/command_receiver.hpp"
#include "foundation/motion/link_samples.hpp"
#include "foundation/motion/loop_watch.hpp"
#include "foundation/motion/ring.hpp"
#include "foundation/motion/sequence_guard.hpp"
#include "foundation/motion/silence_watch.hpp"
#include "main_motion/core/drive_track.hpp"
#include "main_motion/core/main_motion_hardware.hpp"
#include "main_motion/core/state_table.hpp"

namespace lambdajet::main_motion {

struct MainMotionConfig {
  std::uint64_t session = 2;
  double period_s = 0.001;
  double drive_deadline_s = 0.01;  // while a plan is running
  double output_horizon_s = 0.02;  // outputs are scheduled this much ahead of the instant of command
  double pump_pressure_mpa = 380.0;
  double pressure_ready_ratio = 0.9;  // of it: the jet may come on
  double pressure_lost_ratio = 0.75;  // of it, for pressure_patience_s: the jet goes off
  double pressure_patience_s = 0.05;
  double stand_off_mm = 3.0;
  double stand_off_tolerance_mm = 0.1;
  double gate_timeout_s = 30.0;
  double water_off_timeout_s = 1.0;  // what was told to close has closed by then
  double camera_interval_s = 0.01;
  double command_age_limit_s = 2.0;
  double valve_learning = 0.1;  // least share of a newly seen delay that is believed
  int overruns_allowed = 5;
  std::uint32_t overrun_window = 100;
};

struct MainMotionInputs {
  std::span<const ModuleCommand> commands;
  std::span<const DriveState> peer;
  std::span<const SegmentBatch> segments;
  std::span<const ProcessBatch> process;
  LinkFigures link;
};

class MainMotionCore {
 public:
  MainMotionCore(const MainMotionConfig& config, MainMotionHardware& hardware);

  // Process delays; taken over outside a plan.
  void AdoptMachine(const MachineDescription& machine);
  void Step(std::int64_t now_ns, const MainMotionInputs& inputs);

  const MainMotionState& state() const { return state_; }
  std::optional<ModeChange> TakeModeChange();
  std::optional<Measurement> TakeMeasurement();
  std::optional<ProcessRecord> TakeProcessRecord();
  std::uint32_t machine_version() const { return machine_version_; }

 private:
  // How far a process event is.
  enum class Progress : std::uint8_t { kWaiting, kScheduled, kFired };
  // One water-on sequence: of a pierce gate, or of a resume.
  enum class PiercePhase : std::uint8_t { kNone, kPressure, kJet, kPiercing, kThrough };
  struct Awaited {  // a command on its way to its effect
    bool pending = false;
    bool on = false;
    bool of_event = false;
    std::uint32_t event = 0;
    std::int64_t command_ns = 0;
    double peer_age_s = 0.0;
  };
  struct PendingRecord {
    std::uint32_t event = 0;
    std::int64_t effect_ns = 0;
    double peer_age_s = 0.0;
  };
  struct PendingPicture {
    std::uint32_t request = 0;
    std::uint32_t gate = 0;
    std::int32_t mark = 0;
  };

  void TakeInputs(const MainMotionInputs& inputs);
  void TakePeer(const DriveState& peer);
  ModuleReason Obey(const ModuleCommand& command);
  ModuleReason ObeyLoad(const ModuleCommand& command);
  ModuleReason ObeyArm(const ModuleCommand& command);
  void TakeProcess(const ProcessBatch& batch);

  void WatchLoop();
  void WatchHardware();
  void WatchPressure();
  void WatchPeer();
  void FollowDrive();
  void WatchArming();

  void RunGate();
  void RunPierceGate(const Gate& gate);
  void RunMeasureGate(const Gate& gate);
  void RunInputGate(const Gate& gate);
  bool Reads(ProcessInput input) const;
  void RunRestore();
  void BeginPierce(double pierce_time_s);
  bool AdvancePierce();  // true when through
  void PassGate(const Gate& gate);
  void RunEvents();
  void RunValveEvent(const ProcessEvent& event, std::int64_t due_ns);
  void RunCameraEvent(const ProcessEvent& event, std::int64_t due_ns);
  bool BehindClosedGate(const ProcessEvent& event) const;
  void RunCamera();
  void TakeEffects();
  void TakePictures();
  void SettleRecords();
  void SettlePictures();
  void LearnDelay(const OutputEffect& effect, std::int64_t command_ns);

  bool Apply(Event event, ModuleReason reason);
  void Act(Action action);
  void Command(Valve valve, bool on, std::int64_t at_ns, double flow_g_per_min = 0.0);
  void SetFlowAt(double s_mm);
  void TakeBack(Valve valve);
  void WaterOff();
  bool WaterGone() const;
  void RewindEvents(double s_mm);
  bool WaterWantedAt(double s_mm) const;
  double PierceTimeAt(double s_mm) const;
  bool DriveStandsAt(std::uint32_t gate) const;
  bool PlanComplete() const;
  bool Busy() const;
  void Report();
  double& delay_s(Valve valve, bool on) { return delay_s_[static_cast<std::size_t>(valve)][on ? 1 : 0]; }

  MainMotionConfig config_;
  MainMotionHardware& hardware_;
  std::int64_t period_ns_;
  MainMotionState state_;
  MainMotionReadings readings_;
  DriveTrack track_;

  bool machine_known_ = false;
  std::uint32_t machine_version_ = 0;
  ProcessModel process_;
  std::array<std::array<double, 2>, kValveCount> delay_s_{};  // [valve][off, on], as learnt
  std::array<std::array<double, 2>, kValveCount> nominal_s_{};
  std::array<std::array<int, 2>, kValveCount> delays_seen_{};

  std::uint64_t plan_ = 0;
  std::uint32_t gate_total_ = 0;
  std::uint32_t event_total_ = 0;
  std::vector<Gate> gates_;
  std::vector<ProcessEvent> events_;
  std::vector<Progress> progress_;
  std::uint32_t first_unfired_ = 0;
  std::uint32_t events_executed_ = 0;
  std::uint32_t gate_passed_ = 0;
  std::vector<std::array<double, kActuatorCount>> holes_;  // slider readings at each pierced hole

  std::int64_t now_ns_ = 0;
  ModuleMode mode_ = ModuleMode::kOff;
  ModuleReason reason_ = ModuleReason::kNone;
  bool homing_ = false;
  bool arming_ = false;
  bool restoring_ = false;
  bool closing_ = false;  // told to be off, and not yet known to be
  std::int64_t closing_since_ns_ = 0;

  PiercePhase pierce_ = PiercePhase::kNone;
  double pierce_time_s_ = 0.0;
  std::int64_t pierce_since_ns_ = 0;
  std::int64_t water_since_ns_ = 0;  // when the jet reached the sheet, as the sensor says
  bool abrasive_there_ = false;
  std::uint32_t gate_running_ = 0;
  std::int64_t gate_since_ns_ = 0;
  bool picture_asked_ = false;
  bool picture_taken_ = false;
  bool input_before_ = false;  // as it read one cycle ago

  bool tracking_ = false;
  std::int32_t tracked_mark_ = 0;
  std::int64_t next_exposure_ns_ = 0;
  std::uint32_t picture_requests_ = 0;
  std::array<PendingPicture, 64> asked_{};

  std::array<Awaited, kValveCount> awaited_{};
  std::array<bool, kValveCount> scheduled_{};
  std::array<std::int64_t, kValveCount> on_its_way_until_ns_{};  // water told to come on may come until then
  Ring<PendingRecord, 64> pending_records_;
  Ring<Measurement, 64> pending_pictures_;
  Ring<Measurement, 256> measurements_;
  Ring<ProcessRecord, 256> records_;
  Ring<ModeChange, 64> changes_;

  SequenceGuard peer_guard_;
  SequenceGuard process_guard_;
  SequenceGuard segment_guard_;
  SilenceWatch peer_watch_;
  CommandReceiver commands_;
  LoopWatch loop_watch_;
  bool peer_lost_ = true;
  std::int64_t pressure_low_since_ns_ = 0;
  std::uint64_t measurement_sequence_ = 0;
  std::uint64_t record_sequence_ = 0;
};

}  // namespace lambdajet::main_motion
