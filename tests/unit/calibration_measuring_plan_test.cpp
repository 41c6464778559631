// Examples of measuring programs: every look shows its mark, the machine's time is kept, the choice is a good one.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <sstream>

#include "calibration/core/identification.hpp"
#include "calibration/core/measuring_plan.hpp"
#include "tests/support/simulated_looks.hpp"

namespace lambdajet::calibration {
namespace {

// With a settling time as machines have it.
MachineDescription SettlingMachine() {
  MachineDescription machine = support::PaperSizedMachine();
  machine.process.measuring_settle_time_s = 0.5;
  return machine;
}
using testing::HasSubstr;

TEST(MeasuringPlan, PutsEveryMarkInTheMiddleOfThePicture) {
  const MachineDescription machine = SettlingMachine();
  const auto plan = PlanMeasuringRun(machine);
  ASSERT_EQ(plan.reason, PlanReason::kPlanned) << plan.explanation;
  std::istringstream lines(plan.program);
  std::string line;
  Eigen::Vector2d jet_W(0.0, 0.0);
  int looks = 0;
  int centred = 0;
  while (std::getline(lines, line)) {
    double x = 0.0, y = 0.0;
    int mark = 0;
    if (std::sscanf(line.c_str(), "G0 X%lf Y%lf", &x, &y) == 2) {
      jet_W = {x, y};
    } else if (std::sscanf(line.c_str(), "M101 P%d", &mark) == 1 && mark < kFirstHole) {
      Measurement look;
      look.mark = mark;
      look.actuator_position_mm = *ReadingsForJet(machine, machine.parameters, jet_W);
      // The shaken mark is followed from the edge of its circle.
      EXPECT_LT(PredictLook(machine, machine.parameters, look).p_C_mm.norm(), 4.001) << line;
      centred += PredictLook(machine, machine.parameters, look).p_C_mm.norm() < 1e-3;
      ++looks;
    }
  }
  EXPECT_EQ(looks, static_cast<int>(plan.marks.size()) + 1);  // the shaken mark too
  EXPECT_EQ(centred, looks - 1);
  EXPECT_EQ(plan.pierces_W_mm.size(), 3u);
  EXPECT_LE(plan.machine_time_s, 40.0);
  EXPECT_GE(looks, 12);
  EXPECT_LT(plan.expected_mm, 0.05 * plan.expected_before_mm);
  EXPECT_THAT(plan.program, HasSubstr("M101 P1003\n"));
  EXPECT_THAT(plan.program, HasSubstr("M101 P"));
  EXPECT_THAT(plan.program, HasSubstr("M102\n"));
}

TEST(MeasuringPlan, PiercesClearOfMarksAndInsideTheSheet) {
  const MachineDescription machine = SettlingMachine();
  const auto plan = PlanMeasuringRun(machine);
  for (const Eigen::Vector2d& p : plan.pierces_W_mm) {
    EXPECT_GT(p.x(), 0.0);
    EXPECT_LT(p.x(), machine.sheet_width_mm);
    EXPECT_LT(p.y(), machine.sheet_height_mm);
    for (const SheetMark& mark : machine.marks) {
      EXPECT_GE((p - Eigen::Vector2d(mark.x_W_mm, mark.y_W_mm)).norm(), 8.0);
    }
  }
}

TEST(MeasuringPlan, FewerLooksWhenTheMachinesTimeIsShort) {
  MeasuringPlanOptions options;
  options.longest_time_s = 34.0;
  const auto plan = PlanMeasuringRun(SettlingMachine(), options);
  EXPECT_EQ(plan.reason, PlanReason::kPlanned);
  EXPECT_LT(plan.marks.size(), 16u);
  EXPECT_LE(plan.machine_time_s, 34.0);
}

TEST(MeasuringPlan, IsRefusedWithoutMarksOrRoomToPierce) {
  MachineDescription machine = SettlingMachine();
  MeasuringPlanOptions options;
  options.scrap_W_mm = Eigen::Vector2d(5000.0, 0.0);
  EXPECT_EQ(PlanMeasuringRun(machine, options).reason, PlanReason::kNoPlaceToPierce);
  machine.marks.resize(3);
  EXPECT_EQ(PlanMeasuringRun(machine).reason, PlanReason::kMarksOutOfReach);
  machine.marks.resize(1);
  EXPECT_EQ(PlanVerification(machine).reason, PlanReason::kMarksOutOfReach);
}

TEST(VerificationPlan, TakesMarksFarApart) {
  const MachineDescription machine = SettlingMachine();
  const auto plan = PlanVerification(machine, 2);
  ASSERT_EQ(plan.marks.size(), 2u);
  const auto a = *MarkPlace(machine, plan.marks[0]);
  const auto b = *MarkPlace(machine, plan.marks[1]);
  EXPECT_GT((a - b).norm(), 400.0);
  EXPECT_THAT(plan.program, HasSubstr("M100 P"));
  EXPECT_THAT(plan.program, testing::Not(HasSubstr("M3")));
}

}  // namespace
}  // namespace lambdajet::calibration
