#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "simulated_plant/core/nominal_plant.hpp"
#include "tests/laws/trajectory_cases.hpp"
#include "tests/support/demo_machine.hpp"
#include "tests/support/figure.hpp"
#include "tests/support/hand_made_plan.hpp"
#include "tests/support/virtual_cell.hpp"
#include "trajectory/core/feed/plan_program.hpp"

namespace lambdajet::tests {
namespace {

constexpr std::uint32_t kBoth = kTargetDrive | kTargetMainMotion;

class Dice {
 public:
  explicit Dice(std::uint64_t seed) : engine_(seed) {}
  double Between(double low, double high) {
    return low + (high - low) * std::uniform_real_distribution<double>(0.0, 1.0)(engine_);
  }
  int Below(int n) { return std::uniform_int_distribution<int>(0, n - 1)(engine_); }

 private:
  std::mt19937_64 engine_;
};

Plan TwoCircles(const MachineDescription& machine, double speed_mm_per_s = 100.0) {
  HandMadePlan plan(machine);
  plan.From(300, 300);
  for (int i = 0; i < 2; ++i) {
    plan.LineTo(360 + 90 * i, 300, 250);
    plan.Gate(GateKind::kPierce, 0.3);
    plan.CircleAround(330 + 90 * i, 300, speed_mm_per_s);
    plan.Event(ProcessAction::kAbrasiveOff);
    plan.Event(ProcessAction::kJetOff);
  }
  plan.LineTo(300, 300, 250);
  return plan.Finish(77);
}

// How far a set-point lies from the plan's curve q(tau): the least over the whole plan, by bisection with a bound on how far
// the curve gets from an interval's middle. A search from where the last one was found is not enough: at a corner crossed at
// rest it stays on the wrong leg.
class CurveDistance {
 public:
  explicit CurveDistance(const Plan& plan) : plan_(plan) {}

  double operator()(const std::array<double, kActuatorCount>& q) {
    double best = 1e9;
    for (std::size_t k = 0; k < plan_.segments.size() && best > kSurelyOn_mm; ++k) {
      const std::size_t i = (last_ + k) % plan_.segments.size();
      const double half = 0.5 * plan_.segments[i].duration_s;
      const double before = best;
      Bisect(plan_.segments[i], q, half, half, best);
      last_ = best < before && best <= kSurelyOn_mm ? i : last_;
    }
    return best;
  }

 private:
  static constexpr double kSurelyOn_mm = 2e-10;
  static constexpr double kNearEnough = 0.99;  // the answer may be this much above the least

  static double Reach(const Polynomial& p, double t, double half) {
    const double fourth = 120 * p.c[5] * t + 24 * p.c[4], fifth = 120 * p.c[5];
    return half * (std::abs(p.first(t)) +
                   half * (std::abs(p.second(t)) / 2 +
                           half * (std::abs(p.third(t)) / 6 +
                                   half * (std::abs(fourth) / 24 + half * std::abs(fifth) / 120))));
  }

  static void Bisect(const Segment& s, const std::array<double, kActuatorCount>& q, double t, double half,
                     double& best) {
    const double distance = std::hypot(s.q_mm[0].value(t) - q[0], s.q_mm[1].value(t) - q[1]);
    best = std::min(best, distance);
    const double reach = std::hypot(Reach(s.q_mm[0], t, half), Reach(s.q_mm[1], t, half));
    if (best > kSurelyOn_mm && distance - reach < kNearEnough * best) {
      Bisect(s, q, t - 0.5 * half, 0.5 * half, best);
      Bisect(s, q, t + 0.5 * half, 0.5 * half, best);
    }
  }

  const Plan& plan_;
  std::size_t last_ = 0;
};

TEST(PathLaw, DistanceFromTheCurveIsSeenWhereverItIs) {
  const Plan plan = TwoCircles(DemoMachine());
  CurveDistance distance(plan);
  Dice dice(7);
  for (int k = 0; k < 400; ++k) {
    const Segment& s =
        plan.segments[static_cast<std::size_t>(dice.Below(static_cast<int>(plan.segments.size())))];
    // Cubed: as often as not near a segment's end, where corners are crossed at rest.
    const double t = s.duration_s * std::pow(dice.Between(0.0, 1.0), 3);
    std::array<double, kActuatorCount> q{s.q_mm[0].value(t), s.q_mm[1].value(t)};
    ASSERT_LE(distance(q), 2e-10);
    const double vx = s.q_mm[0].first(t), vy = s.q_mm[1].first(t), v = std::hypot(vx, vy);
    if (v > 1.0) {
      q = {q[0] - 2e-9 * vy / v, q[1] + 2e-9 * vx / v};
      ASSERT_NEAR(distance(q), 2e-9, 3e-10);
    }
  }
}

// A person's restless hand on hold, resume, override and retrace.
void Meddle(VirtualCell& cell, Dice& dice) {
  switch (dice.Below(8)) {
    case 0:
    case 1:
      cell.Send(Verb::kHold, kBoth);
      break;
    case 2:
      cell.Send(Verb::kOverride, kBoth, std::max(0.0, dice.Between(-0.05, 1.2)));
      break;
    case 3:
      cell.Send(Verb::kRetrace, kBoth, dice.Between(0.5, 30.0));
      break;
    default:
      cell.Send(Verb::kResume, kBoth);
      break;
  }
}

TEST(PathLaw, ContourKeepsItsShapeUnderHoldsOverridesAndRetraces) {
  const MachineDescription machine = DemoMachine();
  const Plan plan = TwoCircles(machine);
  CurveDistance distance(plan);
  double worst_of_all_mm = 0.0;
  for (std::uint64_t seed = 1; seed <= 32; ++seed) {
    Dice dice(seed);
    CellOptions options;
    options.seed = seed;
    VirtualCell cell(machine, simulated_plant::NominalPlant(machine), options);
    cell.Begin(plan);
    double worst_mm = 0.0;
    double worst_acceleration = 0.0;
    std::optional<drive::Setpoint> last, before;
    std::int64_t written_until = 0;
    std::uint64_t checked = 0;
    std::vector<drive::Setpoint> queue;
    cell.on_setpoint = [&](const drive::Setpoint& s) {
      // What is written later for the same instant takes the place of what was written first.
      while (!queue.empty() && queue.back().execute_at_ns >= s.execute_at_ns) {
        queue.pop_back();
      }
      queue.push_back(s);
    };
    const auto drain = [&] {
      std::size_t played = 0;
      for (; played < queue.size() && queue[played].execute_at_ns <= cell.now_ns(); ++played) {
        const drive::Setpoint& s = queue[played];
        EXPECT_GT(s.execute_at_ns, written_until);
        written_until = s.execute_at_ns;
        if (++checked % 7 == 0) {
          worst_mm = std::max(worst_mm, distance(s.position_mm));
        }
        if (last && before && s.execute_at_ns - last->execute_at_ns == 1'000'000) {
          for (std::size_t i = 0; i < 2; ++i) {
            worst_acceleration = std::max(
                worst_acceleration,
                std::abs(s.position_mm[i] - 2 * last->position_mm[i] + before->position_mm[i]) * 1e6);
          }
        }
        before = last;
        last = s;
      }
      queue.erase(queue.begin(), queue.begin() + static_cast<std::ptrdiff_t>(played));
    };
    for (int i = 0; i < 60000 && !cell.Finished(); ++i) {
      if (i % 400 == 399) {
        Meddle(cell, dice);
      }
      if (i % 4000 == 3999) {
        cell.Send(Verb::kResume, kBoth);
      }
      cell.Step();
      drain();
    }
    const ModuleMode ended = cell.drive().mode;
    EXPECT_TRUE(ended == ModuleMode::kComplete || ended == ModuleMode::kRunning ||
                ended == ModuleMode::kHeld || ended == ModuleMode::kHolding || ended == ModuleMode::kResuming)
        << Name(ended) << " " << Name(cell.drive().reason);
    EXPECT_GT(checked, 5000u);
    EXPECT_LE(worst_mm, 1e-9) << "seed " << seed;
    worst_of_all_mm = std::max(worst_of_all_mm, worst_mm);
    EXPECT_LE(worst_acceleration, machine.actuators[0].acceleration_mm_per_s2) << "seed " << seed;
    EXPECT_EQ(cell.drive_core().setpoints_late(), 0u);
  }
  std::printf(
      "contour under random holds, overrides and retraces, 32 seeds: at most %.1e mm beside the curve\n",
      worst_of_all_mm);
  PrintFigure("replay.beside_curve_mm", worst_of_all_mm);
}

// RETRACE or RESUME at the instant of HELD, valves slow and drawn, also while a pierce is just beginning: the path runs
// backwards only when no water flows, and it does run backwards.
TEST(ReplayLaw, NoWaterFlowsWhileThePathRunsBackwards) {
  int backed_up = 0;
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    SCOPED_TRACE(seed);
    Dice dice(seed);
    MachineDescription machine = DemoMachine();
    machine.process.jet_on_delay_s = dice.Between(0.01, 0.12);
    machine.process.jet_off_delay_s = dice.Between(0.01, 0.12);
    simulated_plant::PlantTruth truth = simulated_plant::NominalPlant(machine);
    truth.jet_valve.on_delay_s *= dice.Between(0.8, 1.2);
    truth.jet_valve.off_delay_s *= dice.Between(0.8, 1.2);
    CellOptions options;
    options.seed = seed;
    // States are lost; the peer is not.
    options.drive.peer_deadline_s = options.main_motion.drive_deadline_s = 0.1;
    options.link = {
        .delay_ns = 1000 * dice.Below(3000), .jitter_ns = 1'000'000, .loss = dice.Between(0.0, 0.2)};
    VirtualCell cell(machine, truth, options);
    cell.Begin(TwoCircles(machine, 40.0));
    if (dice.Below(2) == 0) {
      ASSERT_TRUE(cell.StepUntil([&] { return cell.drive().gate_waiting == 1; }, 20.0));
      cell.Step(dice.Between(0.0, 0.5));
    } else {
      ASSERT_TRUE(cell.StepUntil([&] { return cell.drive().gate_passed == 1; }, 20.0));
      cell.Step(dice.Between(0.2, 3.0));
    }
    cell.Send(Verb::kHold, kBoth);
    ASSERT_TRUE(cell.StepUntil([&] { return cell.drive().mode == ModuleMode::kHeld; }, 5.0));
    cell.Step(1e-3 * dice.Below(6));
    const bool retrace = dice.Below(2) == 0;
    cell.Send(retrace ? Verb::kRetrace : Verb::kResume, kBoth, 5.0);
    for (int i = 0; i < 2000; ++i) {
      cell.Step();
      const bool backwards = cell.drive().s_rate_mm_per_s < -1e-6;
      backed_up += backwards ? 1 : 0;
      EXPECT_FALSE(backwards && cell.main_motion_plant().jet_on()) << "water at s " << cell.drive().s_mm;
    }
    if (!retrace) {
      ASSERT_TRUE(cell.StepUntil([&] { return cell.drive().mode == ModuleMode::kRunning; }, 10.0))
          << Name(cell.drive().mode) << " " << Name(cell.drive().reason);
    }
  }
  EXPECT_GT(backed_up, 5000);
}

// Held anywhere, backed up, sent on again, some times a run: every millimetre between pierce and jet-off is cut after all,
// and never while the path runs backwards.
TEST(ReplayLaw, WhatIsRetracedIsCutAfterAll) {
  const MachineDescription machine = DemoMachine();
  const Plan plan = TwoCircles(machine);
  constexpr double kBin_mm = 0.5;
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    SCOPED_TRACE(seed);
    Dice dice(seed);
    CellOptions options;
    options.seed = seed;
    VirtualCell cell(machine, simulated_plant::NominalPlant(machine), options);
    cell.Begin(plan);
    std::vector<bool> cut(static_cast<std::size_t>(plan.length_mm / kBin_mm) + 2);
    const auto step = [&] {
      cell.Step();
      const DriveState& drive = cell.drive();
      if (cell.main_motion_plant().jet_on()) {
        ASSERT_GE(drive.s_rate_mm_per_s, -1e-6) << "water while backing up at s " << drive.s_mm;
        cut[static_cast<std::size_t>(drive.s_mm / kBin_mm)] = true;
      }
    };
    const auto until = [&](const auto& condition, double limit_s) {
      for (int i = 0;
           i < static_cast<int>(1000 * limit_s) && !condition() && !testing::Test::HasFatalFailure(); ++i) {
        step();
      }
      return condition();
    };
    int retraced = 0;
    for (int k = 0; k < 4; ++k) {
      const double hold_at_mm = dice.Between(0.2, 0.95) * plan.length_mm;
      if (cell.drive().s_mm >= hold_at_mm ||
          !until([&] { return cell.drive().s_mm >= hold_at_mm || cell.Finished(); }, 60.0) ||
          cell.Finished()) {
        continue;
      }
      cell.Send(Verb::kHold, kBoth);
      ASSERT_TRUE(until(
          [&] { return cell.drive().mode == ModuleMode::kHeld && !cell.main_motion_plant().jet_on(); }, 5.0));
      const double held_mm = cell.drive().s_mm, back_mm = dice.Between(0.5, 40.0);
      cell.Send(Verb::kRetrace, kBoth, back_mm);
      ASSERT_TRUE(until([&] { return cell.drive().mode == ModuleMode::kHolding; }, 1.0));
      ASSERT_TRUE(until([&] { return cell.drive().mode == ModuleMode::kHeld; }, 20.0));
      EXPECT_LE(cell.drive().s_mm, held_mm + 1e-6);
      EXPECT_GE(cell.drive().s_mm, held_mm - back_mm - 0.5);
      retraced += cell.drive().s_mm < held_mm - 0.4 ? 1 : 0;
      cell.Send(Verb::kResume, kBoth);
      ASSERT_TRUE(until([&] { return cell.drive().mode == ModuleMode::kRunning || cell.Finished(); }, 20.0))
          << Name(cell.drive().mode) << " " << Name(cell.drive().reason);
    }
    EXPECT_GT(retraced, 0);
    ASSERT_TRUE(until([&] { return cell.Finished(); }, 60.0));
    EXPECT_EQ(cell.drive().mode, ModuleMode::kComplete);
    for (std::size_t g = 0; g < plan.gates.size(); ++g) {
      for (double s = plan.gates[g].s_mm + kBin_mm; s < plan.events[2 * g + 1].s_mm - 2 * kBin_mm;
           s += kBin_mm) {
        ASSERT_TRUE(cut[static_cast<std::size_t>(s / kBin_mm)]) << "left uncut at s " << s;
      }
    }
  }
}

// The planner's word about time, against what the modules' cores take on the simulated machine, gates and all.
class Prediction {
 public:
  explicit Prediction(const char* figure) : figure_(figure) {}

  void Check(const std::string& name, const std::string& text, const trajectory::PlanOptions& options) {
    SCOPED_TRACE(name);
    const trajectory::PlannedProgram planned = trajectory::PlanPartProgram(text, machine_, options);
    ASSERT_TRUE(planned.faults.empty())
        << planned.faults[0].line << " " << planned.faults[0].reason << " " << planned.faults[0].message;
    CellOptions cell_options;
    cell_options.seed = ++count_;
    VirtualCell cell(machine_, simulated_plant::NominalPlant(machine_), cell_options);
    const CellRun run = cell.Run(planned.plan);
    ASSERT_TRUE(run.complete) << Name(cell.drive().reason) << " " << Name(cell.main_motion().reason);
    const double predicted_s = planned.plan.duration_s + planned.gate_time_s;
    const double off = run.duration_s / predicted_s - 1.0;
    std::printf("%s%s: predicted %.3f s, simulated %.3f s, %+.3f %%, %u pierces of %zu gates\n", name.c_str(),
                options.compensate ? ", compensated" : "", predicted_s, run.duration_s, 100 * off,
                planned.pierce_count, planned.plan.gates.size());
    EXPECT_LE(std::abs(off), 0.01);
    worst_ = std::max(worst_, std::abs(off));
  }

  ~Prediction() {
    std::printf("%s: %llu programs, at most %.3f %% off\n", figure_, static_cast<unsigned long long>(count_),
                100 * worst_);
    PrintFigure(figure_, worst_);
    PrintFigure((std::string(figure_) + "_programs").c_str(), static_cast<double>(count_));
  }

  std::uint64_t count() const { return count_; }

 private:
  const char* figure_;
  MachineDescription machine_ = DemoMachine();
  std::uint64_t count_ = 0;
  double worst_ = 0.0;
};

// Every part that is shipped for the sheet's mechanism, in both notations; tilted_holes is a hexapod's.
TEST(PredictionLaw, ShippedPartsTakeTheTimePredicted) {
  Prediction prediction("prediction.shipped_off");
  std::vector<std::filesystem::path> programs;
  const std::string folder = std::string(std::getenv("LAMBDAJET_SOURCE_DIR")) + "/deploy/parts";
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    const std::string kind = entry.path().extension();
    if ((kind == ".ngc" || kind == ".cldata") && entry.path().stem() != "tilted_holes") {
      programs.push_back(entry.path());
    }
  }
  std::sort(programs.begin(), programs.end());
  for (const auto& path : programs) {
    std::ifstream file(path);
    const std::string text((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
    for (const bool compensate : {false, true}) {
      trajectory::PlanOptions options;
      options.compensate = compensate;
      prediction.Check(path.filename(), text, options);
    }
  }
  EXPECT_GE(programs.size(), 8u);
}

// Random programs with pierces of drawn length, dwells between the cuts and within them, every other one compensated.
std::string RandomProgramWithDwells(unsigned seed) {
  std::string text = trajectory::RandomProgram(seed).Make();
  Dice dice(seed);
  for (std::size_t at = text.find("M5\n"); at != std::string::npos; at = text.find("M5\n", at + 12)) {
    const std::string dwell = "G4 P" + std::to_string(0.001 * (1 + dice.Below(700))) + "\n";
    text.insert(dice.Below(2) == 0 ? at : at + 3, dwell);
  }
  for (std::size_t at = text.find("M3 P0.3"); at != std::string::npos; at = text.find("M3 P0.3", at)) {
    text.replace(at, 7, "M3 P" + std::to_string(dice.Between(0.05, 1.5)));
  }
  return text;
}

TEST(PredictionLaw, RandomProgramsTakeTheTimePredicted) {
  const char* wanted = std::getenv("LAMBDAJET_PREDICTED_PROGRAMS");
  const int count = wanted == nullptr ? 16 : std::atoi(wanted);
  Prediction prediction("prediction.random_off");
  for (int seed = 1; seed <= count; ++seed) {
    trajectory::PlanOptions options;
    options.compensate = seed % 2 == 0;
    prediction.Check("seed " + std::to_string(seed), RandomProgramWithDwells(static_cast<unsigned>(seed)),
                     options);
  }
  EXPECT_EQ(prediction.count(), static_cast<std::uint64_t>(count));
}

TEST(JetLaw, IsNeverOnLongerThanTheDeadlineWithoutTheDrive) {
  const MachineDescription machine = DemoMachine();
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    Dice dice(seed);
    CellOptions options;
    options.seed = seed;
    VirtualCell cell(machine, simulated_plant::RandomPlant(machine, seed), options);
    cell.Begin(TwoCircles(machine, 40.0));
    ASSERT_TRUE(cell.StepUntil([&] { return cell.main_motion().jet_on; }, 20.0));
    cell.Step(dice.Between(0.05, 3.0));
    const bool silent_drive = dice.Below(2) == 0;
    if (silent_drive) {
      cell.set_drive_running(false);
    } else {
      cell.set_link({.loss = 1.0});
    }
    const std::int64_t lost_ns = cell.now_ns();
    cell.Step(0.3);
    EXPECT_FALSE(cell.main_motion().jet_on);
    EXPECT_FALSE(cell.main_motion_plant().jet_on());
    for (const auto& change : cell.switches()) {
      if (change.time_ns > lost_ns && !change.on) {
        const double off_s = 1e-9 * static_cast<double>(change.time_ns - lost_ns);
        EXPECT_LE(off_s,
                  options.main_motion.drive_deadline_s + 1.5 * machine.process.jet_off_delay_s + 0.004);
      }
      EXPECT_FALSE(change.time_ns > lost_ns && change.on) << "water came on without a drive";
    }
    EXPECT_LT(cell.main_motion().pump_pressure_mpa, options.main_motion.pump_pressure_mpa);
    // The link alone is back: nothing goes on by itself.
    cell.set_drive_running(true);
    cell.set_link({});
    cell.Step(1.0);
    EXPECT_FALSE(cell.main_motion_plant().jet_on());
    EXPECT_NE(cell.drive().mode, ModuleMode::kRunning);
  }
}

TEST(JetLaw, CutsNothingWhereThePlanDoesNot) {
  // Water only between a pierce and its jet-off, whatever holds come between: never while the path runs without it.
  const MachineDescription machine = DemoMachine();
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    Dice dice(seed);
    VirtualCell cell(machine, simulated_plant::NominalPlant(machine), {});
    const Plan plan = TwoCircles(machine);
    cell.Begin(plan);
    const double slack_mm = 0.5;
    for (int i = 0; i < 60000 && !cell.Finished(); ++i) {
      if (i % 500 == 499) {
        Meddle(cell, dice);
      }
      if (i % 2500 == 2499) {
        cell.Send(Verb::kResume, kBoth);
      }
      cell.Step();
      const double s = cell.drive().s_mm;
      if (cell.main_motion_plant().jet_on()) {
        bool inside = false;
        for (std::size_t g = 0; g < plan.gates.size(); ++g) {
          inside =
              inside || (s >= plan.gates[g].s_mm - slack_mm && s <= plan.events[2 * g + 1].s_mm + slack_mm);
        }
        ASSERT_TRUE(inside) << "water at s " << s << ", seed " << seed;
      } else if (cell.drive().s_rate_mm_per_s > 5.0 && cell.drive().mode == ModuleMode::kRunning) {
        for (std::size_t g = 0; g < plan.gates.size(); ++g) {
          ASSERT_FALSE(s > plan.gates[g].s_mm + slack_mm && s < plan.events[2 * g + 1].s_mm - slack_mm)
              << "no water at s " << s << ", seed " << seed;
        }
      }
    }
  }
}

TEST(LinkLaw, PlansSurviveLossDelayAndDuplication) {
  const MachineDescription machine = DemoMachine();
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    CellOptions options;
    options.seed = seed;
    options.link = {.delay_ns = 300'000, .jitter_ns = 3'000'000, .loss = 0.2, .duplicate = 0.2};
    options.main_motion.drive_deadline_s = 0.03;
    options.drive.peer_deadline_s = 0.06;
    options.drive.clock_offset_limit_s = 0.01;
    VirtualCell cell(machine, simulated_plant::NominalPlant(machine), options);
    const CellRun run = cell.Run(TwoCircles(machine));
    ASSERT_TRUE(run.complete) << Name(cell.drive().mode) << " " << Name(cell.drive().reason) << " / "
                              << Name(cell.main_motion().mode) << " " << Name(cell.main_motion().reason);
    EXPECT_EQ(run.process_records.size(), 4u) << "each event once";
    EXPECT_EQ(run.switches.size(), 4u);
    EXPECT_GT(cell.drive().dropped_samples, 0u);
    EXPECT_GT(cell.main_motion().dropped_samples, 0u);
    EXPECT_EQ(cell.drive_core().setpoints_late(), 0u);
  }
}

TEST(BufferLaw, AStarvingDriveHoldsBeforeTheEndAndGoesOnByItself) {
  const MachineDescription machine = DemoMachine();
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    Dice dice(seed);
    VirtualCell cell(machine, simulated_plant::NominalPlant(machine), {});
    const Plan plan = TwoCircles(machine, 30.0);
    cell.Begin(plan);
    ASSERT_TRUE(cell.StepUntil([&] { return cell.drive().s_rate_mm_per_s > 29.0; }, 20.0));
    cell.Step(dice.Between(0.0, 3.0));
    cell.set_streaming(false);
    ASSERT_TRUE(cell.StepUntil([&] { return cell.drive().mode == ModuleMode::kHeld; }, 20.0));
    EXPECT_EQ(cell.drive().reason, ModuleReason::kStarved);
    EXPECT_GT(cell.drive().buffered_s, 0.0);
    cell.Step(dice.Between(0.1, 4.0));
    EXPECT_EQ(cell.drive().mode, ModuleMode::kHeld);
    cell.set_streaming(true);
    ASSERT_TRUE(cell.StepUntil([&] { return cell.Finished(); }, 60.0));
    EXPECT_EQ(cell.drive().mode, ModuleMode::kComplete);
  }
}

TEST(BufferLaw, NeverHoldsMoreThanItsLimit) {
  const MachineDescription machine = DemoMachine();
  VirtualCell cell(machine, simulated_plant::NominalPlant(machine), {});
  cell.Begin(TwoCircles(machine, 10.0));
  for (int i = 0; i < 5000; ++i) {
    cell.Step();
    ASSERT_LE(cell.drive().buffered_s, 4.1);
  }
}

TEST(ClockLaw, APauseOfTheWholeHostIsNoLostPeer) {
  const MachineDescription machine = DemoMachine();
  for (const double pause_s : {0.005, 0.015, 0.03, 0.045}) {
    CellOptions options;
    options.drive.overruns_allowed = 50;
    options.main_motion.overruns_allowed = 50;
    VirtualCell cell(machine, simulated_plant::NominalPlant(machine), options);
    cell.Begin(TwoCircles(machine));
    ASSERT_TRUE(cell.StepUntil(
        [&] { return cell.drive().s_rate_mm_per_s > 90.0 && cell.main_motion().jet_on; }, 20.0));
    cell.Pause(pause_s);
    cell.Step(0.1);
    EXPECT_EQ(cell.drive().mode, ModuleMode::kRunning) << pause_s << " " << Name(cell.drive().reason);
    EXPECT_TRUE(cell.main_motion().jet_on) << pause_s << " " << Name(cell.main_motion().reason);
    const CellRun run = cell.Take();
    // The servo had its set-points: the path did not notice.
    for (const DriveState& state : run.drive_states) {
      EXPECT_LE(std::abs(state.following_error_mm[0]), 0.15);
    }
  }
}

TEST(RepeatLaw, TheSameSeedGivesTheSameRunBitByBit) {
  const MachineDescription machine = DemoMachine();
  const auto run = [&] {
    CellOptions options;
    options.seed = 5;
    options.link.loss = 0.05;
    VirtualCell cell(machine, simulated_plant::RandomPlant(machine, 3), options);
    return cell.Run(TwoCircles(machine));
  };
  const CellRun a = run();
  const CellRun b = run();
  ASSERT_EQ(a.drive_truth.size(), b.drive_truth.size());
  for (std::size_t i = 0; i < a.drive_truth.size(); ++i) {
    ASSERT_EQ(a.drive_truth[i].X_DW.x_mm, b.drive_truth[i].X_DW.x_mm);
  }
  ASSERT_EQ(a.jet_truth.size(), b.jet_truth.size());
  ASSERT_EQ(a.process_records.size(), b.process_records.size());
  for (std::size_t i = 0; i < a.process_records.size(); ++i) {
    EXPECT_EQ(a.process_records[i].deviation_mm, b.process_records[i].deviation_mm);
  }
}

}  // namespace
}  // namespace lambdajet::tests
