#include "tests/support/virtual_cell.hpp"

#include <algorithm>
#include <chrono>

#include "foundation/motion/plan_batches.hpp"

namespace lambdajet::tests {
namespace {

constexpr std::uint64_t kCellSession = 77;
constexpr std::uint64_t kTrajectorySession = 78;
constexpr double kKeptAhead_s = 2.0;
constexpr std::int64_t kStreamEvery = 4;  // control periods

std::int64_t ToNs(double s) { return static_cast<std::int64_t>(1e9 * s); }

}  // namespace

// Lets a test see each set-point on its way to the servo.
class VirtualCell::SpyHardware final : public drive::DriveHardware {
 public:
  SpyHardware(drive::DriveHardware& real, const VirtualCell& cell) : real_(real), cell_(cell) {}
  drive::DriveReadings ReadState(std::int64_t now_ns) override { return real_.ReadState(now_ns); }
  void WriteSetpoint(const drive::Setpoint& setpoint) override {
    if (cell_.on_setpoint) {
      cell_.on_setpoint(setpoint);
    }
    real_.WriteSetpoint(setpoint);
  }
  void SetEnabled(bool enabled) override { real_.SetEnabled(enabled); }
  void BeginHoming() override { real_.BeginHoming(); }

 private:
  drive::DriveHardware& real_;
  const VirtualCell& cell_;
};

VirtualCell::VirtualCell(const MachineDescription& machine, const simulated_plant::PlantTruth& truth,
                         const CellOptions& options)
    : options_(options),
      random_(options.seed),
      drive_plant_(std::make_unique<simulated_plant::DrivePlant>(truth, truth.seed * 1000003 + options.seed)),
      main_motion_plant_(std::make_unique<simulated_plant::MainMotionPlant>(
          truth, truth.seed * 1000003 + options.seed + 500009, drive_plant_->sheet())),
      spy_(std::make_unique<SpyHardware>(*drive_plant_, *this)),
      drive_(std::make_unique<drive::DriveCore>(options.drive, *spy_)),
      main_motion_(std::make_unique<main_motion::MainMotionCore>(options.main_motion, *main_motion_plant_)),
      period_ns_(ToNs(options.drive.period_s)) {
  AdoptMachine(machine);
}

VirtualCell::~VirtualCell() = default;

void VirtualCell::AdoptMachine(const MachineDescription& machine) {
  drive_->AdoptMachine(machine);
  main_motion_->AdoptMachine(machine);
}

CellRun VirtualCell::Run(const Plan& plan) {
  const auto wall_start = std::chrono::steady_clock::now();
  Begin(plan);
  StepUntil([this] { return Finished(); }, options_.time_limit_s);
  CellRun run = Take();
  run.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - wall_start).count();
  return run;
}

void VirtualCell::Begin(const Plan& plan) {
  plan_ = plan;
  run_ = {};
  recording_ = false;
  Home();
  Load();
  Step(0.02);
  Send(Verb::kArm, kTargetDrive | kTargetMainMotion);
  StepUntil([this] { return drive().mode == ModuleMode::kArmed && main_motion().mode == ModuleMode::kArmed; },
            60.0);
  Step(0.01);
  start_ns_ = now_ns_ + ToNs(0.05);
  recording_ = true;
  Send(Verb::kStart, kTargetDrive | kTargetMainMotion, 0.0, start_ns_);
}

void VirtualCell::Home() {
  Step(0.01);
  if (!drive().referenced || main_motion().mode == ModuleMode::kSafe) {
    Send(Verb::kHome, kTargetDrive | kTargetMainMotion);
    StepUntil(
        [this] { return drive().mode == ModuleMode::kReady && main_motion().mode == ModuleMode::kReady; },
        10.0);
  }
}

void VirtualCell::Load() { Send(Verb::kLoad, kTargetDrive | kTargetMainMotion); }

bool VirtualCell::Finished() const {
  const auto over = [](ModuleMode mode) {
    return mode == ModuleMode::kComplete || mode == ModuleMode::kStopped || mode == ModuleMode::kFault;
  };
  return over(drive().mode) && over(main_motion().mode);
}

CellRun VirtualCell::Take() {
  Step(0.1);  // effects and pictures under way
  run_.complete = drive().mode == ModuleMode::kComplete && main_motion().mode == ModuleMode::kComplete;
  run_.jet_lag_time_s = main_motion_plant_->lag_time_s();
  for (const ModeChange& change : run_.drive_changes) {
    if (change.to == ModuleMode::kComplete) {
      run_.duration_s = 1e-9 * static_cast<double>(change.time_ns - start_ns_);
    }
  }
  recording_ = false;
  return std::move(run_);
}

void VirtualCell::Step(double seconds) {
  const auto cycles = static_cast<std::int64_t>(seconds * 1e9 / static_cast<double>(period_ns_));
  for (std::int64_t i = 0; i < cycles; ++i) {
    Step();
  }
}

void VirtualCell::Pause(double seconds) { now_ns_ += ToNs(seconds) / period_ns_ * period_ns_; }

bool VirtualCell::StepUntil(const std::function<bool()>& condition, double limit_s) {
  const std::int64_t end_ns = now_ns_ + ToNs(limit_s);
  while (!condition()) {
    if (now_ns_ >= end_ns) {
      return false;
    }
    Step();
  }
  return true;
}

void VirtualCell::Send(Verb verb, std::uint32_t target, double value, std::int64_t start_at_ns) {
  ModuleCommand command;
  command.header = {kCellSession, ++command_sequence_, now_ns_};
  command.target = target;
  command.verb = verb;
  command.plan = plan_.id;
  command.segment_count = static_cast<std::uint32_t>(plan_.segments.size());
  command.gate_total = static_cast<std::uint32_t>(plan_.gates.size());
  command.event_total = static_cast<std::uint32_t>(plan_.events.size());
  command.duration_s = plan_.duration_s;
  command.elastic_lag_s2 = plan_.elastic_lag_s2;
  command.value = value;
  command.start_at_ns = start_at_ns;
  SendTo(command);
}

// Commands travel on a reliable channel: they are delayed, not lost.
void VirtualCell::SendTo(const ModuleCommand& command) {
  commands_to_drive_.flying.push_back({now_ns_ + options_.link.delay_ns, command});
  commands_to_main_.flying.push_back({now_ns_ + options_.link.delay_ns, command});
}

template <typename T>
void VirtualCell::Post(Wire<T>& wire, const T& sample) {
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  const LinkQuality& link = options_.link;
  if (link.loss > 0.0 && uniform(random_) < link.loss) {
    return;
  }
  const auto delay_ns =
      link.delay_ns + static_cast<std::int64_t>(static_cast<double>(link.jitter_ns) * uniform(random_));
  wire.flying.push_back({now_ns_ + delay_ns, sample});
  if (link.duplicate > 0.0 && uniform(random_) < link.duplicate) {
    wire.flying.push_back({now_ns_ + delay_ns + static_cast<std::int64_t>(2e7 * uniform(random_)), sample});
  }
}

template <typename T>
void VirtualCell::Deliver(Wire<T>& wire) {
  wire.arrived.clear();
  std::stable_sort(wire.flying.begin(), wire.flying.end(),
                   [](const auto& a, const auto& b) { return a.due_ns < b.due_ns; });
  std::size_t due = 0;
  while (due < wire.flying.size() && wire.flying[due].due_ns <= now_ns_) {
    wire.arrived.push_back(wire.flying[due++].sample);
  }
  wire.flying.erase(wire.flying.begin(), wire.flying.begin() + static_cast<std::ptrdiff_t>(due));
}

void VirtualCell::Step() {
  now_ns_ += period_ns_;
  ++cycle_;
  StepDrive();
  StepMainMotion();
  Stream();
  Record();
}

void VirtualCell::StepDrive() {
  Deliver(to_drive_);
  Deliver(commands_to_drive_);
  Deliver(segments_to_drive_);
  Deliver(process_to_drive_);
  if (!drive_running_) {
    return;
  }
  LinkFigures link;
  link.round_trip_s = 2e-9 * static_cast<double>(options_.link.delay_ns + options_.link.jitter_ns);
  link.clock_offset_s = clock_offset_s_;
  drive_->Step(now_ns_, {.commands = commands_to_drive_.arrived,
                         .peer = to_drive_.arrived,
                         .segments = segments_to_drive_.arrived,
                         .process = process_to_drive_.arrived,
                         .link = link});
  if (cycle_ % 2 == 0) {
    Post(to_main_motion_, drive_->state());
    Post(to_trajectory_, drive_->state());
  }
}

void VirtualCell::StepMainMotion() {
  Deliver(to_main_motion_);
  Deliver(commands_to_main_);
  Deliver(segments_to_main_);
  Deliver(process_to_main_);
  if (!main_motion_running_) {
    return;
  }
  main_motion_->Step(now_ns_, {.commands = commands_to_main_.arrived,
                               .peer = to_main_motion_.arrived,
                               .segments = segments_to_main_.arrived,
                               .process = process_to_main_.arrived,
                               .link = {}});
  if (cycle_ % 4 == 0) {
    Post(to_drive_, main_motion_->state());
    Post(to_trajectory_main_, main_motion_->state());
  }
}

void VirtualCell::Stream() {
  Deliver(to_trajectory_);
  Deliver(to_trajectory_main_);
  if (!streaming_ || cycle_ % kStreamEvery != 0) {
    return;
  }
  StreamSegments();
  StreamProcess();
}

void VirtualCell::StreamSegments() {
  const DriveState& wish = drive_->state();
  if (wish.plan != plan_.id || plan_.id == 0 || wish.buffered_s >= kKeptAhead_s) {
    return;
  }
  SegmentBatch batch;
  FillBatch(plan_, {wish.next_segment, kSegmentsPerBatch}, batch);
  if (batch.count > 0) {
    batch.header = {kTrajectorySession, ++segment_sequence_, now_ns_};
    Post(segments_to_drive_, batch);
    Post(segments_to_main_, batch);
  }
}

void VirtualCell::StreamProcess() {
  const MainMotionState& wish = main_motion_->state();
  const bool all = wish.next_event >= plan_.events.size() && wish.next_gate > plan_.gates.size();
  if (wish.plan != plan_.id || plan_.id == 0 || all) {
    return;
  }
  ProcessBatch batch;
  batch.header = {kTrajectorySession, ++process_sequence_, now_ns_};
  FillBatch(plan_, ProcessRange{{wish.next_gate, kEventsPerBatch}, {wish.next_event, kEventsPerBatch}},
            batch);
  Post(process_to_drive_, batch);
  Post(process_to_main_, batch);
}

void VirtualCell::Record() {
  while (const auto sample = drive_plant_->TakeSheetSample()) {
    if (recording_) {
      run_.drive_truth.push_back(*sample);
    }
  }
  while (const auto sample = main_motion_plant_->TakeJetSample()) {
    if (recording_) {
      run_.jet_truth.push_back(*sample);
    }
  }
  while (const auto change = main_motion_plant_->TakeJetSwitch()) {
    run_.switches.push_back(*change);
  }
  while (const auto measurement = main_motion_->TakeMeasurement()) {
    run_.measurements.push_back(*measurement);
  }
  while (const auto record = main_motion_->TakeProcessRecord()) {
    run_.process_records.push_back(*record);
  }
  while (const auto change = drive_->TakeModeChange()) {
    run_.drive_changes.push_back(*change);
  }
  while (const auto change = main_motion_->TakeModeChange()) {
    run_.main_motion_changes.push_back(*change);
  }
  if (recording_ && cycle_ % static_cast<std::uint64_t>(options_.state_every) == 0) {
    run_.drive_states.push_back(drive_->state());
  }
}

}  // namespace lambdajet::tests
