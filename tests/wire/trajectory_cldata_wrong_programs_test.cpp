// Every wrong CLDATA program of the corpus is refused with its reason, line and column; none is planned.
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string>

#include "tests/laws/trajectory_cases.hpp"
#include "tests/support/figure.hpp"
#include "trajectory/core/feed/plan_program.hpp"
#include "trajectory/core/part_program/cldata_reader.hpp"

namespace lambdajet::trajectory {
namespace {

std::string Content(const std::string& name) {
  std::ifstream file(std::string(std::getenv("LAMBDAJET_SOURCE_DIR")) + "/tests/wire/wrong_cldata/" + name,
                     std::ios::binary);
  EXPECT_TRUE(file.good()) << name;
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

TEST(WrongCldata, IsRefusedWithReasonLineAndColumn) {
  const MachineDescription machine = DemoLikeMachine();
  std::istringstream table(Content("expected.csv"));
  std::string row;
  std::getline(table, row);
  int count = 0;
  while (std::getline(table, row)) {
    std::istringstream cells(row);
    std::string name, reason;
    unsigned line = 0, column = 0;
    char comma = 0;
    std::getline(cells, name, ',');
    std::getline(cells, reason, ',');
    cells >> line >> comma >> column;
    SCOPED_TRACE(name);
    const std::string text = Content(name + ".cldata");
    // Programs that do not begin as CLDATA does must be told apart by whoever calls; they are wrong as CLDATA here.
    // Those of a machine with six axes are read for it.
    const bool six = name.starts_with("six_");
    const std::vector<ProgramFault> faults = six ? ReadCldata(text, {.axes = kSixAxes}).faults
                                             : LooksLikeCldata(text)
                                                 ? AdmitPartProgram(text, machine, {}).faults
                                                 : ReadCldata(text).faults;
    EXPECT_FALSE(faults.empty());
    if (faults.empty()) {
      continue;
    }
    EXPECT_EQ(faults.front().reason, reason);
    EXPECT_EQ(faults.front().line, line);
    EXPECT_EQ(faults.front().column, column);
    EXPECT_FALSE(faults.front().message.empty());
    EXPECT_TRUE(PlanPartProgram(text, machine, {}).plan.segments.empty());
    ++count;
  }
  EXPECT_GE(count, 110);
  tests::PrintFigure("wrong.cldata", count);
}

// What goes on over lines and is refused, or only describes, leaves no lines behind that read as statements.
TEST(WrongCldata, OneCauseIsToldOnce) {
  for (const char* name : {"catia_arc_whole", "unknown_word_goes_on", "fault_goes_on"}) {
    SCOPED_TRACE(name);
    EXPECT_EQ(ReadCldata(Content(std::string(name) + ".cldata")).faults.size(), 1u);
  }
}

TEST(WrongCldata, StopsAtTheLimitOfFaults) {
  std::string text = "PARTNO/'X'\n";
  for (int i = 0; i < 1000; ++i) {
    text += "GOTOO/1,2,3\n";
  }
  EXPECT_EQ(ReadCldata(text).faults.size(), 100u);
}

// The same part as G-code and as CLDATA gives the same plan.
TEST(RightCldata, IsCutLikeGcode) {
  const MachineDescription machine = DemoLikeMachine();
  const auto gcode = PlanPartProgram(
      "G21 G90\nG0 X400 Y300\nM3\nG1 X440 F3000\nG3 X460 Y320 I0 J20\nG1 Y360\nM5\nM2\n", machine, {});
  const auto cldata = PlanPartProgram(
      "PARTNO/'P'\nUNITS/MM\nFROM/400,300,5\nSPINDL/ON\nFEDRAT/3000,MMPM\nGOTO/440,300,5\nCIRCLE/"
      "440,320,5,0,0,1,20\n"
      "GOTO/460,320,5\nGOTO/460,360,5\nSPINDL/OFF\nFINI\n",
      machine, {});
  ASSERT_TRUE(gcode.faults.empty()) << gcode.faults[0].message;
  ASSERT_TRUE(cldata.faults.empty()) << cldata.faults[0].message;
  EXPECT_EQ(gcode.plan.segments.size(), cldata.plan.segments.size());
  EXPECT_NEAR(gcode.plan.duration_s, cldata.plan.duration_s, 1e-12);
  EXPECT_NEAR(gcode.cutting_length_mm, cldata.cutting_length_mm, 1e-9);
}

}  // namespace
}  // namespace lambdajet::trajectory
