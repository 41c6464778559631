#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "platform/machine_file/machine_file.hpp"
#include "tests/support/bus_cell.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/eventually.hpp"
#include "tests/support/hand_made_plan.hpp"
#include "tests/support/private_domain.hpp"
#include "tests/support/temporary_folder.hpp"

namespace lambdajet::tests {
namespace {

// A shared machine wakes a loop late by up to 17 ms: that many late cycles are no reason to stop a test's cut.
constexpr const char* kOverruns = "--watch.overruns_allowed=90";
constexpr double kDriveDeadline_s = 0.05;  // main motion's, on a shared machine
constexpr double kPeerDeadline_s = 0.05;   // the drive's

class TwoNodes : public testing::Test {
 protected:
  void SetUp() override {
    machine_ = *ReadMachineFile(test::SourceDir() + "/deploy/config/machine.yaml");
    StartDrive();
    StartMainMotion();
    cell_ = std::make_unique<BusCell>(domain_.number(), machine_);
    ASSERT_TRUE(drive_->WaitUntilReady()) << drive_->err();
    ASSERT_TRUE(main_motion_->WaitUntilReady()) << main_motion_->err();
    ASSERT_TRUE(test::Eventually([&] {
      return cell_->drive().mode == ModuleMode::kSafe && cell_->main_motion().mode == ModuleMode::kSafe;
    })) << drive_->err()
        << main_motion_->err();
    EXPECT_EQ(cell_->drive().reason, ModuleReason::kRestarted);
    cell_->PublishDescription();
  }

  void StartDrive() { drive_ = Start("drive", "--link.peer_deadline_s=" + std::to_string(kPeerDeadline_s)); }
  void StartMainMotion() {
    main_motion_ = Start("main_motion", "--link.drive_deadline_s=" + std::to_string(kDriveDeadline_s));
  }

  std::unique_ptr<test::ChildProcess> Start(const std::string& name, const std::string& deadline) {
    test::ChildOptions options;
    options.program = name;
    options.arguments = {"--config=" + test::SourceDir() + "/deploy/config/loopback.yaml",
                         "--bus.domain=" + std::to_string(domain_.number()),
                         "--plant=" + test::SourceDir() + "/deploy/plants/shipped.yaml", kOverruns, deadline};
    options.announce_file = folder_.path() + "/" + name + ".json";
    return std::make_unique<test::ChildProcess>(options);
  }

  // Two circles of 40 mm at 100 mm/s, or many rounds, with a picture at the end.
  Plan Circles(int rounds) {
    HandMadePlan plan(machine_);
    plan.From(300, 300);
    for (int hole = 0; hole < 2; ++hole) {
      plan.LineTo(340 + 60 * hole, 300, 250);
      plan.Gate(GateKind::kPierce, 0.3);
      const double s_mm = plan.s_mm();
      for (int i = 0; i < rounds; ++i) {
        plan.CircleAround(320 + 60 * hole, 300, 100);
      }
      // In the middle of the last round, at full feed: the deviation costs most there.
      const double off_mm = 0.5 * (plan.s_mm() - s_mm) / rounds;
      plan.EventAt(ProcessAction::kAbrasiveOff, plan.s_mm() - off_mm);
      plan.EventAt(ProcessAction::kJetOff, plan.s_mm() - off_mm);
    }
    plan.LineTo(280, 300, 250);
    plan.Gate(GateKind::kMeasure, 13);
    plan.LineTo(300, 300, 250);
    return plan.Finish(static_cast<std::uint64_t>(4200 + rounds));
  }

  std::string Logs() { return "\n--- drive\n" + drive_->err() + "\n--- main_motion\n" + main_motion_->err(); }

  test::PrivateDomain domain_;
  test::TemporaryFolder folder_;
  MachineDescription machine_;
  std::unique_ptr<test::ChildProcess> drive_;
  std::unique_ptr<test::ChildProcess> main_motion_;
  std::unique_ptr<BusCell> cell_;
};

TEST_F(TwoNodes, PlayAPlanToItsEnd) {
  ASSERT_TRUE(cell_->Begin(Circles(1))) << Logs();
  double oldest_s = 0.0;
  ASSERT_TRUE(test::Eventually(
      [&] {
        oldest_s = std::max(oldest_s, cell_->main_motion().peer_age_s);
        return cell_->drive().mode == ModuleMode::kComplete &&
               cell_->main_motion().mode == ModuleMode::kComplete;
      },
      std::chrono::seconds(60)))
      << Logs();
  ASSERT_TRUE(
      test::Eventually([&] { return cell_->records().size() == 4 && cell_->measurements().size() == 1; }));
  EXPECT_TRUE(cell_->measurements()[0].seen);
  ASSERT_TRUE(test::Eventually([&] { return cell_->switches().size() == 4; }));
  EXPECT_GT(cell_->sheet_samples(), 5000u);
  std::printf("oldest drive sample that main motion has lived with: %.1f ms; late cycles %u and %u\n",
              1e3 * oldest_s, cell_->drive().loop_overruns, cell_->main_motion().loop_overruns);
  std::vector<double> deviations;
  for (const ProcessRecord& record : cell_->records()) {
    deviations.push_back(std::abs(record.deviation_mm));
    std::printf("event %u: off its place by %.4f mm at %.1f mm/s, drive sample %.1f ms old\n", record.event,
                record.deviation_mm, record.s_rate_mm_per_s, 1e3 * record.peer_age_s);
  }
  EXPECT_LT(*std::max_element(deviations.begin(), deviations.end()), 1.0);
}

TEST_F(TwoNodes, JetGoesOffWhenTheDriveIsKilled) {
  ASSERT_TRUE(cell_->Begin(Circles(20))) << Logs();
  ASSERT_TRUE(test::Eventually([&] {
    return cell_->main_motion().jet_on && cell_->drive().s_rate_mm_per_s > 90.0;
  })) << Logs();
  const std::int64_t killed_ns = cell_->now_ns();
  drive_->Signal(SIGKILL);
  ASSERT_TRUE(test::Eventually([&] { return cell_->switches().size() == 2; })) << Logs();
  const double off_s = 1e-9 * static_cast<double>(cell_->switches()[1].time_ns - killed_ns);
  EXPECT_FALSE(cell_->switches()[1].on);
  std::printf("drive killed: no water at the sheet %.1f ms later (deadline %.0f ms, valve %.0f ms)\n",
              1e3 * off_s, 1e3 * kDriveDeadline_s, 1e3 * machine_.process.jet_off_delay_s);
  EXPECT_LT(off_s, kDriveDeadline_s + machine_.process.jet_off_delay_s + 0.05);
  EXPECT_TRUE(test::Eventually([&] { return cell_->main_motion().reason == ModuleReason::kPeerLost; }));

  // It comes back SAFE, moves nothing, and main motion stops for good.
  StartDrive();
  ASSERT_TRUE(drive_->WaitUntilReady()) << drive_->err();
  EXPECT_TRUE(test::Eventually([&] {
    return cell_->drive().mode == ModuleMode::kSafe && cell_->drive().reason == ModuleReason::kRestarted &&
           cell_->main_motion().mode == ModuleMode::kStopped;
  })) << Logs();
  EXPECT_FALSE(cell_->drive().referenced);
}

TEST_F(TwoNodes, DriveHoldsOnThePathWhenMainMotionIsKilled) {
  ASSERT_TRUE(cell_->Begin(Circles(20))) << Logs();
  ASSERT_TRUE(test::Eventually([&] {
    return cell_->main_motion().jet_on && cell_->drive().s_rate_mm_per_s > 90.0;
  })) << Logs();
  const std::int64_t killed_ns = cell_->now_ns();
  main_motion_->Signal(SIGKILL);
  ASSERT_TRUE(test::Eventually([&] { return cell_->drive().mode == ModuleMode::kHolding; })) << Logs();
  const double hold_s = 1e-9 * static_cast<double>(cell_->now_ns() - killed_ns);
  ASSERT_TRUE(test::Eventually([&] { return cell_->drive().mode == ModuleMode::kHeld; })) << Logs();
  const double held_s = 1e-9 * static_cast<double>(cell_->now_ns() - killed_ns);
  std::printf("main motion killed: drive holds after %.1f ms (deadline %.0f ms), stands after %.0f ms\n",
              1e3 * hold_s, 1e3 * kPeerDeadline_s, 1e3 * held_s);
  EXPECT_EQ(cell_->drive().reason, ModuleReason::kPeerLost);
  EXPECT_LT(hold_s, kPeerDeadline_s + 0.05);
  EXPECT_TRUE(test::Eventually([&] { return cell_->drive().mode == ModuleMode::kStopped; })) << Logs();

  StartMainMotion();
  ASSERT_TRUE(main_motion_->WaitUntilReady()) << main_motion_->err();
  EXPECT_TRUE(test::Eventually(
      [&] { return cell_->main_motion().mode == ModuleMode::kSafe && !cell_->main_motion().jet_on; }));
}

}  // namespace
}  // namespace lambdajet::tests
