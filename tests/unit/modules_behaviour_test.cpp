#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <new>
#include <vector>

#include "simulated_plant/core/nominal_plant.hpp"
#include "simulated_plant/core/true_mechanism.hpp"
#include "tests/support/demo_machine.hpp"
#include "tests/support/hand_made_plan.hpp"
#include "tests/support/virtual_cell.hpp"
#include "trajectory/core/feed/plan_program.hpp"

namespace {
std::atomic<std::uint64_t> allocations = 0;
}

void* operator new(std::size_t size) {
  allocations.fetch_add(1, std::memory_order_relaxed);
  if (void* memory = std::malloc(size)) {
    return memory;
  }
  std::abort();
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

namespace lambdajet::tests {
namespace {

constexpr std::uint32_t kBoth = kTargetDrive | kTargetMainMotion;

Plan Circle(const MachineDescription& machine, double speed_mm_per_s = 40.0, std::uint64_t id = 5) {
  HandMadePlan plan(machine);
  plan.From(300, 300);
  plan.LineTo(340, 300, 250);
  plan.Gate(GateKind::kPierce, 0.3);
  plan.CircleAround(310, 300, speed_mm_per_s);
  plan.Event(ProcessAction::kAbrasiveOff);
  plan.Event(ProcessAction::kJetOff);
  plan.LineTo(300, 300, 250);
  return plan.Finish(id);
}

class Modules : public testing::Test {
 protected:
  explicit Modules(const CellOptions& options = {})
      : machine_(DemoMachine()), cell_(machine_, simulated_plant::NominalPlant(machine_), options) {}

  void Cut() {
    cell_.Begin(Circle(machine_));
    ASSERT_TRUE(cell_.StepUntil(
        [&] { return cell_.main_motion().jet_on && cell_.drive().s_rate_mm_per_s > 39.0; }, 20.0));
  }
  bool Drive(ModuleMode mode, double within_s = 5.0) {
    return cell_.StepUntil([&] { return cell_.drive().mode == mode; }, within_s);
  }
  CommandReceipt Told(Verb verb, double value = 0.0, std::int64_t start_at_ns = 0) {
    cell_.Send(verb, kBoth, value, start_at_ns);
    cell_.Step(0.01);
    return cell_.drive().command;
  }

  MachineDescription machine_;
  VirtualCell cell_;
};

TEST_F(Modules, StartSafeAndRefuseMotionUntilReferenced) {
  cell_.Step(0.05);
  EXPECT_EQ(cell_.drive().mode, ModuleMode::kSafe);
  EXPECT_EQ(cell_.drive().reason, ModuleReason::kRestarted);
  EXPECT_EQ(cell_.main_motion().mode, ModuleMode::kSafe);
  for (const Verb verb : {Verb::kArm, Verb::kStart, Verb::kHold, Verb::kResume, Verb::kRetrace}) {
    EXPECT_EQ(Told(verb, 1.0).answer, CommandAnswer::kRefused) << Name(verb);
    EXPECT_EQ(cell_.drive().mode, ModuleMode::kSafe);
  }
  EXPECT_EQ(Told(Verb::kArm).reason, ModuleReason::kNotReferenced);
  EXPECT_EQ(Told(Verb::kJog, 1.0).reason, ModuleReason::kWrongMode);
  EXPECT_EQ(Told(Verb::kHome).answer, CommandAnswer::kDone);
  EXPECT_EQ(cell_.drive().mode, ModuleMode::kInitialising);
  ASSERT_TRUE(Drive(ModuleMode::kReady));
  EXPECT_TRUE(cell_.drive().referenced);
}

TEST_F(Modules, HoldAndResumePierceAgainWithAnOverlap) {
  Cut();
  Told(Verb::kHold);
  ASSERT_TRUE(Drive(ModuleMode::kHeld));
  const double held_mm = cell_.drive().s_mm;
  cell_.Step(0.2);
  EXPECT_FALSE(cell_.main_motion().jet_on) << "a standing jet spoils the contour";
  EXPECT_EQ(cell_.drive().s_mm, held_mm);
  Told(Verb::kResume);
  ASSERT_TRUE(Drive(ModuleMode::kResuming));
  EXPECT_NEAR(cell_.drive().s_mm, held_mm - 1.0, 0.15) << "backed up by the overlap";
  ASSERT_TRUE(Drive(ModuleMode::kRunning));
  EXPECT_TRUE(cell_.main_motion().jet_on);
  ASSERT_TRUE(Drive(ModuleMode::kComplete, 20.0));
  EXPECT_EQ(cell_.switches_seen(), 4u);
}

// Between two of its states the drive stands and goes on: main motion never sees it HELD.
TEST_F(Modules, AResumeAskedForWhileStillHoldingPiercesAgainAndGoesOn) {
  Cut();
  Told(Verb::kHold);
  ASSERT_TRUE(Drive(ModuleMode::kHolding));
  EXPECT_EQ(Told(Verb::kResume).answer, CommandAnswer::kDone);
  ASSERT_TRUE(Drive(ModuleMode::kResuming));
  ASSERT_TRUE(cell_.StepUntil([&] { return !cell_.main_motion().jet_on; }, 1.0))
      << "a standing jet spoils the contour";
  ASSERT_TRUE(Drive(ModuleMode::kRunning));
  EXPECT_TRUE(cell_.main_motion().jet_on);
  ASSERT_TRUE(Drive(ModuleMode::kComplete, 20.0));
}

// Main motion falls silent just when the drive stands, having backed up for a RESUME.
class SilentAtStandstill : public Modules {
 protected:
  void HoldAndResumeIntoSilence() {
    Cut();
    Told(Verb::kHold);
    ASSERT_TRUE(Drive(ModuleMode::kHeld));
    EXPECT_EQ(Told(Verb::kResume).answer, CommandAnswer::kDone);
    ASSERT_TRUE(Drive(ModuleMode::kHolding)) << "backing up";
    cell_.set_main_motion_running(false);
    ASSERT_TRUE(Drive(ModuleMode::kHeld));
    cell_.Step(0.05);
    EXPECT_EQ(cell_.drive().mode, ModuleMode::kHeld);
  }
};

TEST_F(SilentAtStandstill, TheResumeWaitsForThePeer) {
  HoldAndResumeIntoSilence();
  cell_.set_main_motion_running(true);
  EXPECT_TRUE(Drive(ModuleMode::kComplete, 20.0));
}

TEST_F(SilentAtStandstill, AHoldTakesTheResumeBack) {
  HoldAndResumeIntoSilence();
  Told(Verb::kHold);
  cell_.set_main_motion_running(true);
  cell_.Step(1.0);
  EXPECT_EQ(cell_.drive().mode, ModuleMode::kHeld);
}

TEST_F(Modules, OverrideChangesTheRateAndIsRefusedOutsideItsRange) {
  Cut();
  EXPECT_EQ(Told(Verb::kOverride, 0.5).answer, CommandAnswer::kDone);
  ASSERT_TRUE(cell_.StepUntil([&] { return cell_.drive().tau_rate == 0.5; }, 2.0));
  EXPECT_NEAR(cell_.drive().s_rate_mm_per_s, 20.0, 1.0);
  EXPECT_EQ(Told(Verb::kOverride, 1.2).answer, CommandAnswer::kDone);
  ASSERT_TRUE(cell_.StepUntil([&] { return cell_.drive().tau_rate == 1.2; }, 2.0));
  for (const double bad : {-0.1, 1.3, std::nan("")}) {
    EXPECT_EQ(Told(Verb::kOverride, bad).answer, CommandAnswer::kRefused);
  }
  EXPECT_EQ(cell_.drive().feed_override, 1.2);
  EXPECT_EQ(Told(Verb::kOverride, 0.0).answer, CommandAnswer::kDone);
  ASSERT_TRUE(cell_.StepUntil([&] { return cell_.drive().tau_rate == 0.0; }, 2.0));
}

TEST_F(Modules, RetraceGoesBackByTheDistance) {
  Cut();
  cell_.Step(1.0);
  Told(Verb::kHold);
  ASSERT_TRUE(Drive(ModuleMode::kHeld));
  const double held_mm = cell_.drive().s_mm;
  EXPECT_EQ(Told(Verb::kRetrace, 12.0).answer, CommandAnswer::kDone);
  ASSERT_TRUE(Drive(ModuleMode::kHolding));  // when the water is off
  ASSERT_TRUE(Drive(ModuleMode::kHeld));
  EXPECT_NEAR(cell_.drive().s_mm, held_mm - 12.0, 0.3);
  EXPECT_EQ(Told(Verb::kRetrace, -1.0).answer, CommandAnswer::kRefused);
}

TEST_F(Modules, StopIsLatchedAndResetMovesNothing) {
  Cut();
  EXPECT_EQ(Told(Verb::kStop).answer, CommandAnswer::kDone);
  ASSERT_TRUE(Drive(ModuleMode::kStopped));
  cell_.Step(0.2);
  EXPECT_EQ(cell_.main_motion().mode, ModuleMode::kStopped);
  EXPECT_FALSE(cell_.main_motion().jet_on);
  for (const Verb verb : {Verb::kStart, Verb::kResume, Verb::kArm, Verb::kHome, Verb::kLoad}) {
    EXPECT_EQ(Told(verb).answer, CommandAnswer::kRefused) << Name(verb);
  }
  const auto stood = cell_.drive().actuator_position_mm;
  EXPECT_EQ(Told(Verb::kReset).answer, CommandAnswer::kDone);
  EXPECT_EQ(cell_.drive().mode, ModuleMode::kReady);
  cell_.Step(1.0);
  EXPECT_NEAR(cell_.drive().actuator_position_mm[0], stood[0], 1e-3);
  EXPECT_NEAR(cell_.drive().actuator_position_mm[1], stood[1], 1e-3);
}

TEST_F(Modules, APlanThatWasStoppedGoesOnWhereItStood) {
  Cut();
  Told(Verb::kStop);
  ASSERT_TRUE(Drive(ModuleMode::kStopped));
  const double stopped_mm = cell_.drive().s_mm;
  Told(Verb::kReset);
  EXPECT_EQ(Told(Verb::kArm).answer, CommandAnswer::kDone);
  ASSERT_TRUE(cell_.StepUntil(
      [&] {
        return cell_.drive().mode == ModuleMode::kArmed && cell_.main_motion().mode == ModuleMode::kArmed;
      },
      10.0));
  cell_.Step(0.01);  // the drive, too, must have heard that main motion is armed
  EXPECT_EQ(Told(Verb::kStart, 0.0, cell_.now_ns() + 50'000'000).answer, CommandAnswer::kDone)
      << Name(cell_.drive().command.reason) << " main motion " << Name(cell_.main_motion().mode);
  ASSERT_TRUE(Drive(ModuleMode::kResuming));
  EXPECT_NEAR(cell_.drive().s_mm, stopped_mm, 0.05);
  ASSERT_TRUE(Drive(ModuleMode::kRunning));
  EXPECT_TRUE(cell_.main_motion().jet_on) << "pierced again";
  EXPECT_TRUE(Drive(ModuleMode::kComplete, 20.0));
}

TEST_F(Modules, LostMainMotionHoldsThenStops) {
  Cut();
  const std::int64_t lost_ns = cell_.now_ns();
  cell_.set_main_motion_running(false);
  ASSERT_TRUE(Drive(ModuleMode::kHolding));
  EXPECT_EQ(cell_.drive().reason, ModuleReason::kPeerLost);
  EXPECT_LE(cell_.now_ns() - lost_ns, 26'000'000);
  EXPECT_GE(cell_.now_ns() - lost_ns, 16'000'000);
  ASSERT_TRUE(Drive(ModuleMode::kHeld));
  EXPECT_EQ(Told(Verb::kResume).reason, ModuleReason::kPeerLost);
  ASSERT_TRUE(Drive(ModuleMode::kStopped));
  EXPECT_EQ(cell_.drive().reason, ModuleReason::kPeerLost);
  EXPECT_NEAR(1e-9 * static_cast<double>(cell_.now_ns() - lost_ns), 2.0, 0.1);
}

TEST_F(Modules, AShortSilenceOfTheDriveTakesTheJetOffAndHoldsThePath) {
  Cut();
  cell_.set_link({.delay_ns = 25'000'000, .jitter_ns = 0});  // late news is no news
  ASSERT_TRUE(Drive(ModuleMode::kHeld));
  cell_.Step(0.1);
  EXPECT_FALSE(cell_.main_motion().jet_on);
  cell_.set_link({});
  cell_.Step(0.2);
  EXPECT_EQ(cell_.drive().mode, ModuleMode::kHeld) << "a person decides";
  EXPECT_EQ(Told(Verb::kResume).answer, CommandAnswer::kDone);
  EXPECT_TRUE(Drive(ModuleMode::kComplete, 30.0));
  EXPECT_EQ(cell_.switches_seen(), 4u);
}

TEST_F(Modules, RefuseToCutWithClocksApart) {
  cell_.set_clock_offset(0.0010);
  cell_.Begin(Circle(machine_));
  EXPECT_NE(cell_.drive().mode, ModuleMode::kArmed);
  EXPECT_EQ(Told(Verb::kArm).reason, ModuleReason::kClockOffset);
  cell_.set_clock_offset(0.00005);
  cell_.Step(0.01);
  EXPECT_EQ(Told(Verb::kArm).answer, CommandAnswer::kDone);
}

TEST_F(Modules, RefuseStaleCommandsWrongPlansAndLeftWriters) {
  cell_.Begin(Circle(machine_));
  ASSERT_TRUE(cell_.StepUntil([&] { return cell_.drive().mode == ModuleMode::kComplete; }, 30.0));
  EXPECT_EQ(Told(Verb::kLoad).answer, CommandAnswer::kDone);
  ModuleCommand other;
  other.header = {901, 1, cell_.now_ns()};
  other.target = kBoth;
  other.verb = Verb::kArm;
  other.plan = 999;
  cell_.SendTo(other);
  cell_.Step(0.01);
  EXPECT_EQ(cell_.drive().command.reason, ModuleReason::kWrongPlan);
  EXPECT_EQ(cell_.main_motion().command.reason, ModuleReason::kWrongPlan);
  ModuleCommand old = other;
  old.header = {901, 2, cell_.now_ns() - 3'000'000'000};
  old.verb = Verb::kUnload;
  cell_.SendTo(old);
  cell_.Step(0.01);
  EXPECT_EQ(cell_.drive().command.reason, ModuleReason::kStaleCommand);
  EXPECT_NE(cell_.drive().plan, 0u);
  // The writer that was left speaks again: neither obeyed nor answered.
  cell_.Send(Verb::kUnload, kBoth);
  cell_.Step(0.01);
  EXPECT_EQ(cell_.drive().command.session, 901u);
  EXPECT_NE(cell_.drive().plan, 0u);
}

TEST_F(Modules, StartAtTheInstantTheyWereTold) {
  const Plan plan = Circle(machine_);
  std::int64_t first_motion_ns = 0;
  std::array<double, kActuatorCount> start{plan.segments[0].q_mm[0].c[0], plan.segments[0].q_mm[1].c[0]};
  cell_.Begin(plan);
  const std::int64_t begun_ns = cell_.now_ns();
  cell_.on_setpoint = [&](const drive::Setpoint& s) {
    if (first_motion_ns == 0 && std::abs(s.position_mm[0] - start[0]) > 1e-12) {
      first_motion_ns = s.execute_at_ns;
    }
  };
  cell_.Step(0.2);
  EXPECT_GE(first_motion_ns, begun_ns + 50'000'000);
  EXPECT_LE(first_motion_ns, begun_ns + 52'000'000);
}

TEST_F(Modules, TwoWritersAreAFault) {
  Cut();
  // A second main motion speaks, then the first again.
  MainMotionState second = cell_.main_motion();
  second.header.session = 4711;
  drive::DriveCore& core = cell_.drive_core();
  const auto say = [&](const MainMotionState& state) {
    core.Step(cell_.now_ns() + 100'000,
              {.commands = {}, .peer = {&state, 1}, .segments = {}, .process = {}, .link = {}});
  };
  second.header.time_ns = cell_.now_ns();
  say(second);
  cell_.Step(0.02);
  EXPECT_EQ(cell_.drive().mode, ModuleMode::kFault);
  EXPECT_EQ(cell_.drive().reason, ModuleReason::kTwoWriters);
}

TEST_F(Modules, FollowingErrorTrips) {
  Cut();
  cell_.drive_plant().Inject({simulated_plant::FaultKind::kStall, 0, 0.0, 10.0, 0.0});
  ASSERT_TRUE(Drive(ModuleMode::kFault, 2.0));
  EXPECT_EQ(cell_.drive().reason, ModuleReason::kFollowingError);
  cell_.Step(0.2);
  EXPECT_FALSE(cell_.main_motion().jet_on);
  EXPECT_EQ(cell_.main_motion().reason, ModuleReason::kPeerStopped);
}

TEST_F(Modules, LostPressureTakesTheJetOffAndHoldsTheDrive) {
  Cut();
  cell_.main_motion_plant().Inject({simulated_plant::FaultKind::kPressureLoss, 0, 0.0, 10.0, 0.0});
  ASSERT_TRUE(Drive(ModuleMode::kHeld, 5.0));
  EXPECT_EQ(cell_.drive().reason, ModuleReason::kPeerStopped);
  EXPECT_EQ(cell_.main_motion().mode, ModuleMode::kFault);
  EXPECT_EQ(cell_.main_motion().reason, ModuleReason::kPressureLost);
  EXPECT_FALSE(cell_.main_motion().jet_on);
}

// The valve is told to close and does not: the machine says so itself, and takes the pressure off.
TEST_F(Modules, AJetThatNeverClosesHasAReasonOfItsOwn) {
  Cut();
  cell_.main_motion_plant().Inject({simulated_plant::FaultKind::kValveDelay, 0, 0.0, 60.0, 50.0});
  Told(Verb::kHold);
  ASSERT_TRUE(Drive(ModuleMode::kHeld));
  ASSERT_TRUE(cell_.StepUntil([&] { return cell_.drive().reason == ModuleReason::kJetNotClosed; }, 1.5));
  EXPECT_EQ(cell_.drive().mode, ModuleMode::kHeld);
  EXPECT_EQ(cell_.main_motion().mode, ModuleMode::kFault);
  EXPECT_EQ(cell_.main_motion().reason, ModuleReason::kJetNotClosed);
  EXPECT_TRUE(cell_.main_motion().jet_on);
  EXPECT_EQ(Told(Verb::kResume).answer, CommandAnswer::kRefused);
  ASSERT_TRUE(cell_.StepUntil([&] { return cell_.main_motion().pump_pressure_mpa < 40.0; }, 3.0));
  ASSERT_TRUE(Drive(ModuleMode::kStopped));
  EXPECT_EQ(cell_.drive().reason, ModuleReason::kJetNotClosed);
}

TEST_F(Modules, TheFlowOfAbrasiveChangesAtItsPlaceOnThePath) {
  HandMadePlan plan(machine_);
  plan.From(200, 300);
  plan.LineTo(210, 300, 250);
  plan.Gate(GateKind::kPierce, 0.05);
  plan.LineTo(400, 300, 100);
  const double fast_mm = plan.s_mm() - 90.0, none_mm = plan.s_mm() - 30.0;
  plan.EventAt(ProcessAction::kAbrasiveFlow, fast_mm, 520.0);
  plan.EventAt(ProcessAction::kAbrasiveFlow, none_mm, 0.0);
  plan.Event(ProcessAction::kAbrasiveOff);
  plan.Event(ProcessAction::kJetOff);
  cell_.Begin(plan.Finish(21));
  const auto flows = [&](double g_per_min, double s_mm) {
    return cell_.StepUntil(
               [&] {
                 return cell_.main_motion().abrasive_on &&
                        cell_.main_motion().abrasive_g_per_min == g_per_min;
               },
               20.0) &&
           std::abs(cell_.drive().s_mm - s_mm) < 0.5;
  };
  EXPECT_TRUE(flows(machine_.process.abrasive_flow_g_per_min, 10.0))
      << "a plan begins with the machine's own";
  EXPECT_TRUE(flows(520.0, fast_mm)) << cell_.drive().s_mm;
  EXPECT_TRUE(flows(0.0, none_mm)) << cell_.drive().s_mm;
  ASSERT_TRUE(Drive(ModuleMode::kComplete, 20.0));
  const CellRun run = cell_.Take();
  ASSERT_EQ(run.process_records.size(), 4u);
  for (std::size_t i = 0; i < 2; ++i) {
    const ProcessRecord& record = run.process_records[i];
    EXPECT_EQ(record.action, ProcessAction::kAbrasiveFlow);
    EXPECT_EQ(record.argument, i == 0 ? 520.0 : 0.0);
    EXPECT_EQ(record.s_wanted_mm, i == 0 ? fast_mm : none_mm);
    EXPECT_LE(std::abs(record.deviation_mm), 0.1);
  }
}

// After a hold behind a change of flow the cut goes on with the flow of its place.
TEST_F(Modules, AResumeRestoresTheFlowOfAbrasive) {
  HandMadePlan plan(machine_);
  plan.From(200, 300);
  plan.LineTo(210, 300, 250);
  plan.Gate(GateKind::kPierce, 0.05);
  plan.EventAt(ProcessAction::kAbrasiveFlow, plan.s_mm() + 20.0, 520.0);
  plan.EventAt(ProcessAction::kAbrasiveFlow, plan.s_mm() + 80.5, 600.0);
  plan.LineTo(400, 300, 100);
  cell_.Begin(plan.Finish(22));
  ASSERT_TRUE(cell_.StepUntil([&] { return cell_.main_motion().abrasive_g_per_min == 600.0; }, 20.0));
  Told(Verb::kHold);
  ASSERT_TRUE(Drive(ModuleMode::kHeld));
  Told(Verb::kRetrace, 40.0);
  ASSERT_TRUE(Drive(ModuleMode::kHolding));
  ASSERT_TRUE(Drive(ModuleMode::kHeld));
  ASSERT_LT(cell_.drive().s_mm, 80.0);
  Told(Verb::kResume);
  ASSERT_TRUE(Drive(ModuleMode::kRunning, 10.0));
  EXPECT_EQ(cell_.main_motion().abrasive_g_per_min, 520.0);
  EXPECT_TRUE(cell_.StepUntil([&] { return cell_.main_motion().abrasive_g_per_min == 600.0; }, 5.0));
}

// From the file to the machine: read, planned, played.
TEST_F(Modules, AProgramSetsTheFlowAndWaits) {
  const std::string text =
      "G0 X200 Y300\nM67 E0 Q410\nM66 P0 L3 Q5\nM3 P0.2\nF3000\nG1 X240\nM67 E0 Q520\nG1 X260 Y310\nM68 E0 "
      "Q300\nM66 P1 "
      "L4 Q3\nG1 X280\nM5\nM2\n";
  const trajectory::PlannedProgram planned = trajectory::PlanPartProgram(text, machine_, {});
  ASSERT_TRUE(planned.faults.empty()) << planned.faults[0].message;
  const Plan& plan = planned.plan;
  ASSERT_EQ(plan.gates.size(), 4u);
  EXPECT_EQ(plan.gates[0].kind, GateKind::kInput);
  EXPECT_EQ(plan.gates[0].condition, InputCondition::Of(ProcessInput::kPumpAtPressure, InputEvent::kHigh));
  EXPECT_EQ(plan.gates[3].condition, InputCondition::Of(ProcessInput::kAbrasivePresent, InputEvent::kLow));
  EXPECT_EQ(plan.gates[3].argument, 3.0);
  cell_.Begin(plan);
  ASSERT_TRUE(cell_.StepUntil([&] { return cell_.drive().gate_waiting == 4; }, 20.0));
  EXPECT_NEAR(cell_.drive().s_mm, plan.gates[3].s_mm, 1e-6);
  cell_.Step(0.3);
  EXPECT_EQ(cell_.main_motion().abrasive_g_per_min, 300.0);
  cell_.main_motion_plant().Inject({simulated_plant::FaultKind::kHopperEmpty, 0, 0.0, 1.0, 0.0});
  ASSERT_TRUE(Drive(ModuleMode::kComplete, 10.0));
  std::vector<std::pair<double, double>> flows;
  for (const ProcessRecord& record : cell_.Take().process_records) {
    if (record.action == ProcessAction::kAbrasiveFlow) {
      flows.emplace_back(record.s_wanted_mm, record.argument);
      EXPECT_LE(std::abs(record.deviation_mm), 0.1);
    }
  }
  ASSERT_EQ(flows.size(), 3u);
  EXPECT_EQ(flows[0], std::make_pair(0.0, 410.0));
  EXPECT_NEAR(flows[1].first, 40.0, 0.1);
  EXPECT_EQ(flows[1].second, 520.0);
  EXPECT_EQ(flows[2], std::make_pair(plan.gates[3].s_mm, 300.0));

  // A program that is taken up behind a setting begins with it.
  trajectory::PlanOptions options;
  options.start_from_s_mm = 50.0;
  const trajectory::PlannedProgram rest = trajectory::PlanPartProgram(text, machine_, options);
  ASSERT_TRUE(rest.faults.empty());
  ASSERT_FALSE(rest.plan.events.empty());
  EXPECT_EQ(rest.plan.events.front().action, ProcessAction::kAbrasiveFlow);
  EXPECT_EQ(rest.plan.events.front().argument, 520.0);
}

Plan Waiting(const MachineDescription& machine, InputEvent event, double seconds,
             ProcessInput input = ProcessInput::kAbrasivePresent) {
  HandMadePlan plan(machine);
  plan.From(300, 300);
  plan.LineTo(340, 300, 250);
  plan.Gate(GateKind::kInput, seconds, InputCondition::Of(input, event));
  plan.LineTo(380, 300, 250);
  return plan.Finish(23);
}

TEST_F(Modules, TheDriveStandsUntilTheInputComes) {
  constexpr auto kEmpty = simulated_plant::FaultKind::kHopperEmpty;
  struct Case {
    InputEvent event;
    double from_s, for_s;  // the hopper is empty
    double wait_s;
  };
  // High and low take what is so already; a rise and a fall wait for the change.
  for (const Case& c : {Case{InputEvent::kHigh, 0.0, 0.0, 0.0}, Case{InputEvent::kHigh, 0.0, 0.7, 0.7},
                        Case{InputEvent::kLow, 0.0, 0.7, 0.0}, Case{InputEvent::kLow, 0.4, 5.0, 0.4},
                        Case{InputEvent::kRise, 0.3, 0.5, 0.8}, Case{InputEvent::kFall, 0.3, 0.5, 0.3}}) {
    VirtualCell cell(machine_, simulated_plant::NominalPlant(machine_), {});
    cell.Begin(Waiting(machine_, c.event, 5.0));
    ASSERT_TRUE(cell.StepUntil([&] { return cell.drive().s_mm > 39.0; }, 20.0));
    cell.main_motion_plant().Inject({kEmpty, 0, c.from_s, c.for_s, 0.0});
    const std::int64_t asked_ns = cell.now_ns();
    ASSERT_TRUE(cell.StepUntil([&] { return cell.drive().gate_passed == 1; }, 10.0));
    EXPECT_NEAR(1e-9 * static_cast<double>(cell.now_ns() - asked_ns), c.wait_s, 0.15)
        << static_cast<int>(c.event);
    EXPECT_TRUE(cell.StepUntil([&] { return cell.drive().mode == ModuleMode::kComplete; }, 5.0));
  }
}

TEST_F(Modules, AnInputThatDoesNotComeHoldsTheMachineWithItsReason) {
  cell_.Begin(Waiting(machine_, InputEvent::kLow, 0.5, ProcessInput::kPumpAtPressure));
  ASSERT_TRUE(Drive(ModuleMode::kHeld, 20.0));
  EXPECT_EQ(cell_.drive().reason, ModuleReason::kInputTimeout);
  EXPECT_EQ(cell_.drive().gate_passed, 0u);
  cell_.Step(0.2);
  EXPECT_EQ(cell_.main_motion().mode, ModuleMode::kHeld);
  EXPECT_EQ(cell_.main_motion().reason, ModuleReason::kInputTimeout);
  EXPECT_EQ(Name(ModuleReason::kInputTimeout), "INPUT_TIMEOUT");
  // Going on waits again, for the whole time.
  Told(Verb::kResume);
  ASSERT_TRUE(Drive(ModuleMode::kRunning));
  const std::int64_t again_ns = cell_.now_ns();
  ASSERT_TRUE(Drive(ModuleMode::kHeld));
  EXPECT_GE(cell_.now_ns() - again_ns, 450'000'000);
  EXPECT_EQ(cell_.drive().reason, ModuleReason::kInputTimeout);
  cell_.main_motion_plant().Inject({simulated_plant::FaultKind::kPressureLoss, 0, 0.0, 10.0, 0.0});
  Told(Verb::kResume);
  EXPECT_TRUE(Drive(ModuleMode::kComplete));
}

TEST_F(Modules, DwellsAndStopsOpenByThemselvesAndByThePerson) {
  HandMadePlan plan(machine_);
  plan.From(300, 300);
  plan.LineTo(340, 300, 250);
  plan.Gate(GateKind::kDwell, 0.5);
  plan.LineTo(380, 300, 250);
  plan.Gate(GateKind::kStop, 0.0);
  plan.LineTo(400, 300, 250);
  cell_.Begin(plan.Finish(8));
  ASSERT_TRUE(cell_.StepUntil([&] { return cell_.drive().gate_waiting == 1; }, 5.0));
  const std::int64_t waiting_ns = cell_.now_ns();
  ASSERT_TRUE(cell_.StepUntil([&] { return cell_.drive().gate_waiting == 0; }, 5.0));
  EXPECT_NEAR(1e-9 * static_cast<double>(cell_.now_ns() - waiting_ns), 0.5, 0.01);
  ASSERT_TRUE(cell_.StepUntil([&] { return cell_.drive().gate_waiting == 2; }, 5.0));
  cell_.Step(3.0);
  EXPECT_EQ(cell_.drive().gate_waiting, 2u);
  EXPECT_EQ(Told(Verb::kResume).answer, CommandAnswer::kDone);
  EXPECT_TRUE(Drive(ModuleMode::kComplete));
}

TEST_F(Modules, TrackingTakesAPictureEveryTenMilliseconds) {
  HandMadePlan plan(machine_);
  plan.From(270, 300);
  plan.EventAt(ProcessAction::kCameraTrackOn, 5.0, 13);
  plan.LineTo(290, 300, 20);
  plan.EventAt(ProcessAction::kCameraTrackOff, 15.0);
  const CellRun run = cell_.Run(plan.Finish(9));
  ASSERT_TRUE(run.complete);
  ASSERT_GT(run.measurements.size(), 40u);
  for (std::size_t i = 0; i < run.measurements.size(); ++i) {
    const Measurement& m = run.measurements[i];
    EXPECT_TRUE(m.seen);
    EXPECT_EQ(m.mark, 13);
    EXPECT_EQ(m.gate, 0u);
    // The camera sees the mark where the sliders of that instant put it.
    const auto p_DE =
        simulated_plant::TruePoint(simulated_plant::NominalPlant(machine_), m.actuator_position_mm);
    ASSERT_TRUE(p_DE);
    const Eigen::Vector2d p_C = *p_DE + machine_.X_EW() * Eigen::Vector2d(400, 300) -
                                machine_.X_DJ().translation_mm() - machine_.p_JC_mm();
    // The sheet still rings at first: 0.4 mm from the start, falling by a factor e in a third of a second.
    const double ringing_mm = 0.02 + 0.4 * std::exp(-0.03 * static_cast<double>(i));
    EXPECT_NEAR(m.x_C_mm, p_C.x(), ringing_mm);
    EXPECT_NEAR(m.y_C_mm, p_C.y(), ringing_mm);
    if (i > 0) {
      EXPECT_NEAR(1e-6 * static_cast<double>(m.exposure_ns - run.measurements[i - 1].exposure_ns), 10.0,
                  0.01);
    }
  }
}

TEST_F(Modules, ValvesAreLearntAndEventsLandWhereTheyShould) {
  HandMadePlan plan(machine_);
  plan.From(200, 300);
  double x = 200;
  for (int i = 0; i < 20; ++i) {
    plan.LineTo(x += 5, 300, 250);
    plan.Gate(GateKind::kPierce, 0.05);
    plan.LineTo(x += 20, 300, 100);
    plan.EventAt(ProcessAction::kAbrasiveOff, plan.s_mm() - 9.0);
    plan.EventAt(ProcessAction::kJetOff, plan.s_mm() - 8.0);
  }
  VirtualCell cell(machine_, simulated_plant::RandomPlant(machine_, 4), {});
  const CellRun run = cell.Run(plan.Finish(10));
  ASSERT_TRUE(run.complete);
  ASSERT_EQ(run.process_records.size(), 40u);
  std::vector<double> deviations;
  for (const ProcessRecord& record : run.process_records) {
    deviations.push_back(std::abs(record.deviation_mm));
    EXPECT_NEAR(record.s_rate_mm_per_s, 100.0, 1.0);
  }
  std::sort(deviations.begin() + 2, deviations.end());
  std::printf("event deviation at 100 mm/s on a virtual clock: first %.4f, then median %.4f, worst %.4f mm\n",
              deviations[0], deviations[21], deviations[39]);
  EXPECT_LE(deviations[21], 0.02);
  EXPECT_LE(deviations[39], 0.1);
}

TEST_F(Modules, TheLoopsAllocateNothingAfterStart) {
  Cut();
  // Steps of the cores alone: the virtual link around them is a test's, and allocates.
  drive::DriveCore& drive = cell_.drive_core();
  main_motion::MainMotionCore& main_motion = cell_.main_motion_core();
  std::int64_t now_ns = cell_.now_ns();
  LinkFigures link;
  link.round_trip_s = 1e-4;
  MainMotionState peer = cell_.main_motion();
  DriveState state = cell_.drive();
  const double s_before = state.s_mm;
  const std::uint64_t before = allocations.load();
  for (int i = 0; i < 800; ++i) {
    now_ns += 1'000'000;
    drive.Step(now_ns, {.commands = {}, .peer = {&peer, 1}, .segments = {}, .process = {}, .link = link});
    state = drive.state();
    main_motion.Step(now_ns,
                     {.commands = {}, .peer = {&state, 1}, .segments = {}, .process = {}, .link = link});
    peer = main_motion.state();
  }
  EXPECT_EQ(allocations.load() - before, 0u);
  EXPECT_GT(drive.state().s_mm, s_before + 5.0) << "the loops were at work";
}

}  // namespace
}  // namespace lambdajet::tests
