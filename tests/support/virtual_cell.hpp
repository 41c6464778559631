// Runs both module cores with both simulated plants on one virtual clock: the machine without wires and without waiting.
//
// Model: one step is one control period; cores and plants are the shipped ones, the link between them is a list of
// packets with delay, jitter, loss and duplication drawn from a seed. A stand-in for the trajectory service feeds the plan
// by the modules' own back-pressure (next_segment, next_event, next_gate), a stand-in for the cell sends the commands.
// The same machine, plan, truth and options give the same run, bit by bit.
// Units: mm, s; common time in ns. Threads: one. Cost: see the ratio to real time that virtual_cell_test prints.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <random>
#include <vector>

#include "drive/core/drive_core.hpp"
#include "foundation/machine/machine_description.hpp"
#include "foundation/motion/plan.hpp"
#include "main_motion/core/main_motion_core.hpp"
#include "simulated_plant/core/drive_plant.hpp"
#include "simulated_plant/core/main_motion_plant.hpp"

namespace lambdajet::tests {

struct LinkQuality {
  std::int64_t delay_ns = 200'000;
  std::int64_t jitter_ns = 100'000;  // uniform, on top
  double loss = 0.0;
  double duplicate = 0.0;  // the copy comes later by up to 20 ms
};

struct CellOptions {
  std::uint64_t seed = 1;  // of the plants' noise and of the link
  LinkQuality link;
  drive::DriveConfig drive;
  main_motion::MainMotionConfig main_motion;
  double time_limit_s = 1800.0;  // of virtual time, per run
  int state_every = 10;          // control periods between recorded drive states
};

// What one run left behind. Samples every millisecond from START (or the first motion) to the end.
struct CellRun {
  bool complete = false;
  double duration_s = 0.0;  // virtual time from START to COMPLETE
  double wall_s = 0.0;
  double jet_lag_time_s = 0.0;
  std::vector<simulated_plant::SheetSample> drive_truth;  // X_DW
  std::vector<simulated_plant::JetSample> jet_truth;      // p_DJ
  std::vector<simulated_plant::JetSwitch> switches;
  std::vector<Measurement> measurements;
  std::vector<ProcessRecord> process_records;
  std::vector<DriveState> drive_states;
  std::vector<ModeChange> drive_changes;
  std::vector<ModeChange> main_motion_changes;
};

class VirtualCell {
 public:
  VirtualCell(const MachineDescription& machine, const simulated_plant::PlantTruth& truth,
              const CellOptions& options);
  ~VirtualCell();

  // Homes both modules if they are not, loads, streams, arms, starts, and waits for the end.
  CellRun Run(const Plan& plan);

  // Another description for what follows, as an activated identification would give.
  void AdoptMachine(const MachineDescription& machine);

  // Piece by piece, for tests of trouble. A Begin is Run without the waiting.
  void Begin(const Plan& plan);
  bool Finished() const;  // COMPLETE, STOPPED or FAULT
  CellRun Take();         // what has been recorded since Begin
  void Step();            // one control period of both modules
  void Step(double seconds);
  void Pause(double seconds);  // the whole host stands still
  bool StepUntil(const std::function<bool()>& condition, double limit_s);
  void Send(Verb verb, std::uint32_t target, double value = 0.0, std::int64_t start_at_ns = 0);
  void SendTo(const ModuleCommand& command);

  void set_link(const LinkQuality& quality) { options_.link = quality; }
  void set_drive_running(bool running) { drive_running_ = running; }  // false: silent, as if killed
  void set_main_motion_running(bool running) { main_motion_running_ = running; }
  void set_clock_offset(double offset_s) { clock_offset_s_ = offset_s; }  // as the drive measures it
  void set_streaming(bool streaming) { streaming_ = streaming; }
  std::function<void(const drive::Setpoint&)> on_setpoint;  // each one written

  std::int64_t now_ns() const { return now_ns_; }
  const DriveState& drive() const { return drive_->state(); }
  const MainMotionState& main_motion() const { return main_motion_->state(); }
  drive::DriveCore& drive_core() { return *drive_; }
  main_motion::MainMotionCore& main_motion_core() { return *main_motion_; }
  std::size_t switches_seen() const { return run_.switches.size(); }
  const std::vector<simulated_plant::JetSwitch>& switches() const { return run_.switches; }
  simulated_plant::DrivePlant& drive_plant() { return *drive_plant_; }
  simulated_plant::MainMotionPlant& main_motion_plant() { return *main_motion_plant_; }

 private:
  class SpyHardware;
  template <typename T>
  struct Wire {
    struct Packet {
      std::int64_t due_ns;
      T sample;
    };
    std::vector<Packet> flying;
    std::vector<T> arrived;
  };
  template <typename T>
  void Post(Wire<T>& wire, const T& sample);
  template <typename T>
  void Deliver(Wire<T>& wire);
  void StepDrive();
  void StepMainMotion();
  void Stream();
  void StreamSegments();
  void StreamProcess();
  void Record();
  void Load();
  void Home();

  CellOptions options_;
  std::mt19937_64 random_;
  std::unique_ptr<simulated_plant::DrivePlant> drive_plant_;
  std::unique_ptr<simulated_plant::MainMotionPlant> main_motion_plant_;
  std::unique_ptr<SpyHardware> spy_;
  std::unique_ptr<drive::DriveCore> drive_;
  std::unique_ptr<main_motion::MainMotionCore> main_motion_;

  std::int64_t now_ns_ = 1'000'000'000;
  std::int64_t period_ns_ = 1'000'000;
  std::uint64_t cycle_ = 0;
  bool drive_running_ = true;
  bool main_motion_running_ = true;
  bool streaming_ = true;
  double clock_offset_s_ = 0.0;
  bool recording_ = false;

  Plan plan_;
  CellRun run_;
  std::int64_t start_ns_ = 0;
  std::uint64_t command_sequence_ = 0;
  std::uint64_t segment_sequence_ = 0;
  std::uint64_t process_sequence_ = 0;

  Wire<DriveState> to_main_motion_;
  Wire<MainMotionState> to_drive_;
  Wire<DriveState> to_trajectory_;
  Wire<MainMotionState> to_trajectory_main_;
  Wire<SegmentBatch> segments_to_drive_;
  Wire<SegmentBatch> segments_to_main_;
  Wire<ProcessBatch> process_to_drive_;
  Wire<ProcessBatch> process_to_main_;
  Wire<ModuleCommand> commands_to_drive_;
  Wire<ModuleCommand> commands_to_main_;
};

}  // namespace lambdajet::tests
