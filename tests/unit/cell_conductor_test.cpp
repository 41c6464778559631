#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "cell/core/conductor.hpp"
#include "tests/support/cell_machine_model.hpp"

namespace lambdajet::cell {
namespace {

constexpr std::uint64_t kSession = kModelSession;
constexpr std::int64_t kStep_ns = 20'000'000;

class ConductorTest : public testing::Test {
 protected:
  ConductorTest() {
    job.order.job_id = "job-1";
    job.progress.state = JobState::kReady;
    job.progress.length_mm = 50.0;
  }

  // One cycle of the cell's loop; trajectory answers at once.
  void Cycle() {
    now_ns += kStep_ns;
    machine.Advance(now_ns);
    conductor.Step(machine.view, now_ns);
    Deliver();
  }

  void Deliver() {
    for (auto actions = conductor.TakeActions(); !actions.empty(); actions = conductor.TakeActions()) {
      Deliver(actions);
    }
  }

  void Deliver(const std::vector<Action>& actions) {
    for (const Action& action : actions) {
      if (const auto* command = std::get_if<CommandOut>(&action)) {
        commands.push_back(*command);
        machine.Obey(*command, now_ns);
      } else if (const auto* wanted = std::get_if<PlanWanted>(&action)) {
        planned_from.push_back(wanted->from);
        PlanOutcome outcome{wanted->job_id, plan, {}, "", ""};
        if (trajectory_lost) {
          outcome = {wanted->job_id, std::nullopt, {}, "TRAJECTORY_UNREACHABLE", "no answer"};
        }
        conductor.Take(outcome, now_ns);
      } else if (const auto* streaming = std::get_if<StreamingWanted>(&action)) {
        ++streaming_asked;
        if (streams) {
          EXPECT_EQ(machine.view.drive->plan, streaming->plan_id);
          machine.Fill();
        }
        conductor.Take(StreamingOutcome{streaming->job_id, streaming->plan_id, "", ""}, now_ns);
      } else {
        const News& told = std::get<News>(action);
        news.push_back(told);
        if (const auto next = Next(job.progress.state, told.happening)) {
          job.progress.state = *next;
          job.progress.s_mm = told.s_mm;
          job.progress.reason = told.reason;
          if (told.plan) {
            job.progress.plan_id = told.plan->plan_id;
          }
        } else {
          ADD_FAILURE() << Name(job.progress.state) << " does not know " << Name(told.happening);
        }
      }
    }
  }

  template <typename Condition>
  bool CycleUntil(Condition&& condition, int most = 20000) {
    for (int i = 0; i < most; ++i) {
      if (condition()) {
        return true;
      }
      Cycle();
    }
    return condition();
  }

  bool Reaches(JobState state) {
    return CycleUntil([&] { return job.progress.state == state; });
  }

  void MakeReady() {
    Cycle();
    ASSERT_FALSE(conductor.Reset(machine.view, now_ns));
    ASSERT_TRUE(CycleUntil([&] { return !conductor.busy(); }));
    ASSERT_FALSE(conductor.reset_trouble()) << conductor.reset_trouble()->message;
  }

  void Run() {
    MakeReady();
    ASSERT_FALSE(conductor.Start(job, 3.0, machine.view, now_ns));
    ASSERT_TRUE(Reaches(JobState::kRunning)) << job.progress.reason;
  }

  MachineModel machine;
  Conductor conductor{kSession};
  Job job;
  PlanFacts plan{77, 100, 2, 10, 1.0, 0.0, 0.0, 50.0, 0.1, {}};
  std::int64_t now_ns = 1'000'000'000'000;
  std::vector<CommandOut> commands;
  std::vector<News> news;
  std::vector<std::optional<ResumeFrom>> planned_from;
  int streaming_asked = 0;
  bool streams = true;
  bool trajectory_lost = false;
};

TEST_F(ConductorTest, ResetHomesAndReferencesBothModules) {
  MakeReady();
  EXPECT_EQ(machine.view.drive->mode, ModuleMode::kReady);
  EXPECT_EQ(machine.view.main_motion->mode, ModuleMode::kReady);
  EXPECT_TRUE(StartVetoes(machine.view, now_ns).empty());
  EXPECT_TRUE(news.empty());
}

TEST_F(ConductorTest, RunsAJobFromStartToCompletionAndUnloads) {
  Run();
  ASSERT_TRUE(Reaches(JobState::kCompleted));
  EXPECT_EQ(job.progress.s_mm, 50.0);
  ASSERT_TRUE(CycleUntil([&] { return !conductor.busy(); }));
  EXPECT_EQ(machine.view.drive->plan, 0U);
}

TEST_F(ConductorTest, StartsBothAtOneInstantAheadOfNow) {
  Run();
  int starts = 0;
  for (const CommandOut& command : commands) {
    if (command.verb == Verb::kStart) {
      ++starts;
      EXPECT_EQ(command.targets, kBothTargets);
    }
  }
  EXPECT_EQ(starts, 1);
  EXPECT_GT(machine.start_at_ns, 0);
}

TEST_F(ConductorTest, RefusesToStartAMachineThatIsNotReferencedAndNamesIt) {
  Cycle();
  machine.view.drive->reason = ModuleReason::kNotReferenced;
  const auto refusal = conductor.Start(job, 3.0, machine.view, now_ns);
  ASSERT_TRUE(refusal);
  EXPECT_EQ(refusal->reason, "NOT_REFERENCED");
  EXPECT_NE(refusal->message.find("main_motion"), std::string::npos);
}

TEST_F(ConductorTest, NamesTheModuleThatRefusesToArm) {
  MakeReady();
  machine.refuse_arm = ModuleReason::kNoMachineDescription;
  ASSERT_FALSE(conductor.Start(job, 3.0, machine.view, now_ns));
  ASSERT_TRUE(CycleUntil([&] { return !news.empty() && !conductor.busy(); }));
  EXPECT_EQ(job.progress.state, JobState::kReady);
  EXPECT_EQ(job.progress.reason, "NO_MACHINE_DESCRIPTION");
  EXPECT_EQ(machine.view.drive->plan, 0U);
}

TEST_F(ConductorTest, SendsACommandAgainAndThenSaysWhoDidNotAnswer) {
  MakeReady();
  machine.drive_deaf = true;
  const std::size_t before = commands.size();
  ASSERT_FALSE(conductor.Start(job, 3.0, machine.view, now_ns));
  ASSERT_TRUE(CycleUntil([&] { return !conductor.busy(); }));
  EXPECT_EQ(job.progress.reason, "COMMAND_NOT_ANSWERED");
  EXPECT_NE(news.back().message.find("drive"), std::string::npos);
  std::map<Verb, int> sent;
  for (std::size_t i = before; i < commands.size(); ++i) {
    ++sent[commands[i].verb];
  }
  EXPECT_EQ(sent[Verb::kLoad], 3);
}

TEST_F(ConductorTest, GivesUpTheStartWhenTrajectoryIsLost) {
  MakeReady();
  trajectory_lost = true;
  ASSERT_FALSE(conductor.Start(job, 3.0, machine.view, now_ns));
  ASSERT_TRUE(CycleUntil([&] { return !conductor.busy(); }));
  EXPECT_EQ(job.progress.state, JobState::kReady);
  EXPECT_EQ(job.progress.reason, "TRAJECTORY_UNREACHABLE");
}

TEST_F(ConductorTest, HoldsAndResumes) {
  Run();
  ASSERT_FALSE(conductor.Hold(machine.view, now_ns));
  Deliver();
  ASSERT_TRUE(Reaches(JobState::kHeld));
  EXPECT_EQ(job.progress.reason, "COMMANDED");
  ASSERT_FALSE(conductor.Resume(machine.view, now_ns));
  Deliver();
  ASSERT_TRUE(Reaches(JobState::kCompleted));
}

TEST_F(ConductorTest, AsksForStreamingAgainWhileSegmentsAreMissing) {
  plan.segment_count = 1000;
  plan.duration_s = 100.0;
  machine.length_mm = 1e6;
  Run();
  const int before = streaming_asked;
  streams = false;
  CycleUntil([] { return false; }, 200);
  EXPECT_GE(streaming_asked, before + 3);
  EXPECT_LE(streaming_asked, before + 5);
}

TEST_F(ConductorTest, StarvationHoldsTheJobAndItGoesOnByItself) {
  Run();
  machine.view.drive->mode = ModuleMode::kHeld;
  machine.view.drive->reason = ModuleReason::kStarved;
  ASSERT_TRUE(Reaches(JobState::kHeld));
  EXPECT_EQ(job.progress.reason, "STARVED");
  machine.view.drive->mode = ModuleMode::kRunning;
  ASSERT_TRUE(Reaches(JobState::kCompleted));
}

TEST_F(ConductorTest, AHoldForALinkThatIsBackGoesOnByItselfAHoldOnCommandDoesNot) {
  Run();
  machine.view.drive->mode = ModuleMode::kHeld;
  machine.view.drive->reason = ModuleReason::kPeerLost;
  ASSERT_TRUE(Reaches(JobState::kHeld));
  ASSERT_TRUE(Reaches(JobState::kRunning));
  machine.view.drive->mode = ModuleMode::kHeld;
  machine.view.drive->reason = ModuleReason::kCommanded;
  ASSERT_TRUE(Reaches(JobState::kHeld));
  CycleUntil([] { return false; }, 500);
  EXPECT_EQ(job.progress.state, JobState::kHeld);
}

TEST_F(ConductorTest, ResumesAfterAMainMotionRestartFromWhatWasCutForCertain) {
  Run();
  ASSERT_TRUE(CycleUntil([&] { return machine.view.main_motion->s_mm >= 20.0; }));
  const double cut_mm = machine.view.main_motion->s_mm;
  machine.view.main_motion->session = 99;
  machine.view.main_motion->mode = ModuleMode::kSafe;
  machine.view.main_motion->plan = 0;
  machine.view.drive->mode = ModuleMode::kHeld;
  machine.view.drive->s_mm = cut_mm + 8.0;  // it stopped later than the jet
  ASSERT_TRUE(Reaches(JobState::kInterrupted));
  EXPECT_EQ(job.progress.reason, "RESTARTED");
  EXPECT_EQ(job.progress.s_mm, cut_mm);

  ASSERT_FALSE(conductor.Start(job, 5.0, machine.view, now_ns));
  ASSERT_TRUE(Reaches(JobState::kRunning)) << job.progress.reason;
  ASSERT_TRUE(planned_from.back());
  EXPECT_EQ(planned_from.back()->s_mm, cut_mm);
  EXPECT_EQ(planned_from.back()->overlap_mm, 5.0);
  ASSERT_TRUE(Reaches(JobState::kCompleted));
}

TEST_F(ConductorTest, FindsTheJobAgainWhenTheDriveWasOnlyOutOfHearing) {
  machine.length_mm = 500.0;
  Run();
  machine.drive_silent = true;
  ASSERT_TRUE(Reaches(JobState::kInterrupted));
  EXPECT_EQ(job.progress.reason, "DRIVE_LOST");
  machine.drive_silent = false;
  ASSERT_TRUE(Reaches(JobState::kCompleted));
}

// The host, or the disk under the journal, stands still for longer than a module may be silent, and nobody was silent.
TEST_F(ConductorTest, ACellThatStoodStillItselfHasLostNobody) {
  machine.length_mm = 500.0;
  Run();
  for (int pause = 0; pause < 5; ++pause) {
    now_ns += 3'000'000'000;
    conductor.Step(machine.view, now_ns);  // before anything new was heard
    Deliver();
    ASSERT_EQ(job.progress.state, JobState::kRunning) << job.progress.reason;
    Cycle();
  }
  now_ns += 3'000'000'000;
  machine.drive_silent = true;  // and one that falls silent meanwhile is missed soon after
  ASSERT_TRUE(CycleUntil([&] { return job.progress.state == JobState::kInterrupted; }, kSilentTurns + 1));
  EXPECT_EQ(job.progress.reason, "DRIVE_LOST");
}

TEST_F(ConductorTest, AStopEndsInAnInterruptionThatResumeCanTakeUp) {
  Run();
  conductor.Stop(now_ns);
  Deliver();
  ASSERT_TRUE(Reaches(JobState::kInterrupted));
  EXPECT_EQ(machine.view.drive->mode, ModuleMode::kStopped);
  EXPECT_EQ(machine.view.main_motion->mode, ModuleMode::kStopped);
  ASSERT_FALSE(conductor.Start(job, 3.0, machine.view, now_ns));
  ASSERT_TRUE(Reaches(JobState::kCompleted));
}

TEST_F(ConductorTest, ARestartedCellGoesOnFollowingARunningJob) {
  Run();
  Conductor restarted(kSession + 1);
  conductor = restarted;
  conductor.Reconcile(job, now_ns);
  ASSERT_TRUE(Reaches(JobState::kCompleted)) << job.progress.reason;
}

TEST_F(ConductorTest, ARestartedCellFindsAJobThatCompletedMeanwhile) {
  Run();
  while (machine.view.drive->mode != ModuleMode::kComplete) {
    machine.Advance(now_ns += kStep_ns);
  }
  conductor = Conductor(kSession + 1);
  conductor.Reconcile(job, now_ns);
  ASSERT_TRUE(Reaches(JobState::kCompleted));
}

TEST_F(ConductorTest, ARestartedCellDoesNotStartTwiceWhatNeverMoved) {
  MakeReady();
  job.progress.state = JobState::kStarting;
  conductor = Conductor(kSession + 1);
  conductor.Reconcile(job, now_ns);
  ASSERT_TRUE(Reaches(JobState::kReady));
  EXPECT_EQ(job.progress.reason, "CELL_RESTARTED");
}

TEST_F(ConductorTest, ARestartedCellThatHearsNobodyInterruptsTheJob) {
  machine.length_mm = 1e6;
  Run();
  machine.drive_silent = machine.main_motion_silent = true;
  CycleUntil([] { return false; }, 2);
  conductor = Conductor(kSession + 1);
  job.progress.state = JobState::kRunning;
  conductor.Reconcile(job, now_ns);
  ASSERT_TRUE(Reaches(JobState::kInterrupted));
  EXPECT_EQ(job.progress.reason, "DRIVE_LOST");
}

TEST_F(ConductorTest, OverrideReachesTheDrive) {
  machine.length_mm = 1e6;
  plan.length_mm = 1e6;
  Run();
  ASSERT_FALSE(conductor.Override(0.5, machine.view, now_ns));
  Deliver();
  ASSERT_TRUE(CycleUntil([&] { return !conductor.operator_command_pending(); }));
  EXPECT_FALSE(conductor.operator_trouble());
  EXPECT_EQ(machine.view.drive->feed_override, 0.5);
}

// Whatever the modules do, at every step: no wish or view makes the conductor tell what the job's table does not know
// (Deliver() fails then), and a job that ended stays ended.
class ConductorChaos : public ConductorTest, public testing::WithParamInterface<int> {};

TEST_P(ConductorChaos, NeverTellsWhatTheTableDoesNotKnow) {
  std::uint64_t state = static_cast<std::uint64_t>(GetParam()) * 0x9E3779B97F4A7C15ULL + 1;
  const auto draw = [&](std::uint64_t below) {
    state ^= state << 13U;
    state ^= state >> 7U;
    state ^= state << 17U;
    return state % below;
  };
  MakeReady();
  for (int i = 0; i < 3000 && !HasEnded(job.progress.state); ++i) {
    switch (draw(60)) {
      case 0:
        machine.drive_silent = !machine.drive_silent;
        break;
      case 1:
        machine.main_motion_silent = draw(2) == 0;
        break;
      case 2:
        machine.view.drive->mode = static_cast<ModuleMode>(draw(13));
        break;
      case 3:
        machine.view.main_motion->mode = static_cast<ModuleMode>(draw(13));
        break;
      case 4:
        machine.view.drive->session = draw(3);
        break;
      case 5:
        machine.view.main_motion->plan = draw(2) * 77;
        break;
      case 6:
        conductor.Stop(now_ns);
        break;
      case 7:
        conductor.Hold(machine.view, now_ns);
        break;
      case 8:
        conductor.Resume(machine.view, now_ns);
        break;
      case 9:
        trajectory_lost = draw(4) == 0;
        break;
      case 10:
        machine.drive_deaf = draw(4) == 0;
        break;
      case 11:
        conductor.Reset(machine.view, now_ns);
        break;
      case 12:
        if (HoldsMachine(job.progress.state)) {
          conductor = Conductor(kSession);
          conductor.Reconcile(job, now_ns);
        }
        break;
      default:
        if (job.progress.state == JobState::kReady || job.progress.state == JobState::kInterrupted) {
          conductor.Start(job, 3.0, machine.view, now_ns);
        }
        break;
    }
    Deliver();
    Cycle();
  }
}

INSTANTIATE_TEST_SUITE_P(Seeds, ConductorChaos, testing::Range(1, 41));

}  // namespace
}  // namespace lambdajet::cell
