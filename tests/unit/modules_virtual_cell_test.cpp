#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <string>

#include "platform/machine_file/machine_file.hpp"
#include "simulated_plant/core/nominal_plant.hpp"
#include "tests/support/hand_made_plan.hpp"
#include "tests/support/virtual_cell.hpp"

namespace lambdajet::tests {
namespace {

MachineDescription DemoMachine() {
  const auto machine =
      ReadMachineFile(std::string(std::getenv("LAMBDAJET_SOURCE_DIR")) + "/deploy/config/machine.yaml");
  EXPECT_TRUE(machine.ok()) << machine.status().ToString();
  return *machine;
}

// Pierce, cut a circle of 60 mm, jet off, look at the hole and at a mark.
Plan CircleWithPictures(const MachineDescription& machine) {
  HandMadePlan plan(machine);
  plan.From(300, 300);
  plan.LineTo(460, 300, 250);
  plan.Gate(GateKind::kPierce, 0.6);
  plan.CircleAround(400, 300, 100);
  plan.Event(ProcessAction::kAbrasiveOff);
  plan.Event(ProcessAction::kJetOff);
  plan.LineTo(280, 300, 250);
  plan.Gate(GateKind::kMeasure, 13);  // mark 13 at (400, 300) lies under the camera, 120 mm beside the jet
  plan.LineTo(340, 300, 250);
  plan.Gate(GateKind::kMeasure, 1001);
  plan.LineTo(560, 300, 250);
  return plan.Finish(42);
}

TEST(VirtualCell, PlaysAPlanToItsEndFasterThanTime) {
  const MachineDescription machine = DemoMachine();
  VirtualCell cell(machine, simulated_plant::NominalPlant(machine), {});
  const CellRun run = cell.Run(CircleWithPictures(machine));
  ASSERT_TRUE(run.complete) << Name(cell.drive().mode) << " " << Name(cell.drive().reason) << " / "
                            << Name(cell.main_motion().mode) << " " << Name(cell.main_motion().reason)
                            << " gate " << cell.drive().gate_waiting << " s " << cell.drive().s_mm;
  std::printf("virtual %.1f s in %.2f s: %.0f times real time\n", run.duration_s, run.wall_s,
              run.duration_s / run.wall_s);
  ASSERT_EQ(run.switches.size(), 2u);
  EXPECT_TRUE(run.switches[0].on);
  EXPECT_FALSE(run.switches[1].on);
  ASSERT_EQ(run.process_records.size(), 2u);
  ASSERT_EQ(run.measurements.size(), 2u);
  for (const Measurement& m : run.measurements) {
    std::printf("mark %d seen %d at %.4f %.4f\n", m.mark, m.seen, m.x_C_mm, m.y_C_mm);
    EXPECT_TRUE(m.seen);
    EXPECT_NEAR(m.x_C_mm, 0.0, 0.02);
    EXPECT_NEAR(m.y_C_mm, 0.0, 0.02);
  }
}

}  // namespace
}  // namespace lambdajet::tests
