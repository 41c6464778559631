// Every wrong program of the corpus is refused with its reason, line and column; none is read to its end. Column 0 is that of
// a whole program, of which no word is wrong: it says nothing, or it does not end.
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "tests/laws/trajectory_cases.hpp"
#include "tests/support/figure.hpp"
#include "trajectory/core/feed/plan_program.hpp"
#include "trajectory/core/part_program/gcode_reader.hpp"

namespace lambdajet::trajectory {
namespace {

std::string WrongPrograms() {
  return std::string(std::getenv("LAMBDAJET_SOURCE_DIR")) + "/tests/wire/wrong_programs/";
}

std::string Content(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  EXPECT_TRUE(file.good()) << path;
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

struct Expectation {
  std::string program, reason;
  unsigned line = 0, column = 0;
  std::string
      read_for;  // machine: admitted and planned; sheet, six: read only, with kerf, in two or six axes
};

std::vector<Expectation> Expectations() {
  std::vector<Expectation> list;
  std::istringstream table(Content(WrongPrograms() + "expected.csv"));
  std::string row;
  std::getline(table, row);
  while (std::getline(table, row)) {
    std::istringstream cells(row);
    Expectation e;
    char comma = 0;
    std::getline(cells, e.program, ',');
    std::getline(cells, e.reason, ',');
    cells >> e.line >> comma >> e.column >> comma >> e.read_for;
    list.push_back(e);
  }
  return list;
}

std::vector<ProgramFault> FaultsOf(const Expectation& e, const std::string& text) {
  if (e.read_for == "machine") {
    EXPECT_TRUE(PlanPartProgram(text, DemoLikeMachine(), {}).plan.segments.empty());
    return AdmitPartProgram(text, DemoLikeMachine(), {}).faults;
  }
  GcodeOptions options;
  options.kerf_width_mm = 0.8;
  options.axes = e.read_for == "six" ? kSixAxes : kPlanarAxes;
  return ReadGcode(text, options).faults;
}

TEST(WrongPrograms, AreRefusedWithReasonLineAndColumn) {
  const std::vector<Expectation> expectations = Expectations();
  EXPECT_GE(expectations.size(), 300u);
  for (const Expectation& e : expectations) {
    SCOPED_TRACE(e.program);
    const std::vector<ProgramFault> faults = FaultsOf(e, Content(WrongPrograms() + e.program + ".ngc"));
    EXPECT_FALSE(faults.empty());
    if (faults.empty()) {
      continue;
    }
    EXPECT_EQ(faults.front().reason, e.reason);
    EXPECT_EQ(faults.front().line, e.line);
    EXPECT_EQ(faults.front().column, e.column);
    EXPECT_EQ(e.column == 0, e.reason == "PROGRAM_EMPTY" || e.reason == "PROGRAM_END_MISSING");
    EXPECT_FALSE(faults.front().message.empty());
  }
  tests::PrintFigure("wrong.gcode", static_cast<double>(expectations.size()));
}

// "4 FEED_MISSING" a fault, in the order told.
std::vector<std::string> Told(const std::string& text, std::uint8_t axes = kPlanarAxes) {
  GcodeOptions options;
  options.kerf_width_mm = 0.8;
  options.axes = axes;
  std::vector<std::string> told;
  for (const ProgramFault& f : ReadGcode(text, options).faults) {
    told.push_back(std::to_string(f.line) + " " + std::string(f.reason));
  }
  return told;
}

using Causes = std::vector<std::string>;

TEST(WrongPrograms, TellTheCauseAndNotWhatFollowsFromIt) {
  // The place after a line that was not obeyed.
  EXPECT_EQ(Told("G0 X0 Y0\nF600\nG1 X10 Y0 E3.5.1\nG2 X20 Y10 I10\nG3 X10 Y20 I-10\nM2\n"),
            (Causes{"3 BAD_CHARACTER"}));
  EXPECT_EQ(Told("F600\nG91\nG1 X10*\nG90\nG2 X20 Y10 I10\nM2\n"), (Causes{"3 BAD_CHARACTER"}));
  EXPECT_EQ(Told("F600\nG0 X10\nG51 X2\nG2 X20 Y10 I10\nM2\n"), (Causes{"3 UNKNOWN_G_CODE"}));
  EXPECT_EQ(Told("F600\nG52\nG2 X20 Y20 I10 J10\nG2 X20 Y20 I10\nM2\n"), (Causes{"2 G52_AXIS_MISSING"}));
  // The word of motion.
  EXPECT_EQ(Told("F600\nG33 X1 K2\nX2 K2\nX3 K2\nM2\n"), (Causes{"2 UNKNOWN_G_CODE"}));
  EXPECT_EQ(Told("F600\nG81 X1 Y1 R2\nX2\nX3 Y1\nG80\nM2\n"), (Causes{"2 CYCLE_AXIS_NOT_DRIVEN"}));
  EXPECT_EQ(Told("X1\nX2\nY3\nM2\n"), (Causes{"1 MOTION_MODE_MISSING"}));
  EXPECT_EQ(Told("F600\nG2 X1\nX2\nX3\nM2\n"), (Causes{"2 ARC_CENTER_MISSING"}));
  // Feed.
  EXPECT_EQ(Told("G1 X1\nX2\nG2 X4 I1\nM2\n"), (Causes{"1 FEED_MISSING"}));
  EXPECT_EQ(Told("F0\nG1 X1\nX2\nM2\n"), (Causes{"1 FEED_NOT_POSITIVE"}));
  EXPECT_EQ(Told("G0 X1 F600 U2\nG1 X1\nM2\n"), (Causes{"1 AXIS_NOT_DRIVEN"}));
  // The jet.
  EXPECT_EQ(Told("F600\nM3\nG1 X1\nG0 X2\nX3\nM3\nG1 X4\nM5\nG0 X5\nM2\n"),
            (Causes{"4 TRAVERSE_WITH_JET_ON"}));
  EXPECT_EQ(Told("F600\nM3\nG1 X1\nM5 M105\nG0 X2\nM3\nG1 X4\nM5\nM2\n"), (Causes{"4 UNKNOWN_M_CODE"}));
  EXPECT_EQ(Told("F600\nM3\nG1 X1\nM106\nG0 X2\nM3\nG1 X4\nM5\nM2\n"), (Causes{"4 UNKNOWN_M_CODE"}));
  EXPECT_EQ(Told("F600\nM3\nG1 X1\nM5 )\nG0 X2\nM3\nG1 X4\nM5\nM2\n"), (Causes{"4 COMMENT_NOT_OPEN"}));
  // Kerf, plane, tools, turns.
  EXPECT_EQ(Told("F600\nG10 L1 P7 R1.2.3\nG41 D7\nG1 X9\nG40\nG1 X0\nM2\n"), (Causes{"2 BAD_CHARACTER"}));
  EXPECT_EQ(Told("F600\nG41\nG1 X9\nG40 Q1\nG41\nG1 X10 Y9\nG40\nG1 X0\nM2\n"),
            (Causes{"4 WORD_WITHOUT_USE"}));
  EXPECT_EQ(Told("F600\nG41\nG1 X9\nG40 W1\nG92 X0\nG1 X0\nM2\n"), (Causes{"4 AXIS_NOT_DRIVEN"}));
  EXPECT_EQ(Told("F600\nG18 U1\nG2 X2 J1\nG2 X2 K1\nM2\n", kSixAxes),
            (Causes{"2 AXIS_NOT_DRIVEN", "3 ARC_WORD_NOT_OF_PLANE"}));
  EXPECT_EQ(Told("F600\nG18 G7\nG2 X2 K1\nG2 X4 K1\nG17\nG2 X6 J1\nM2\n"),
            (Causes{"2 UNKNOWN_G_CODE", "6 ARC_RADIUS_DIFFERS"}));
  EXPECT_EQ(Told("S0 M3\nM3\nM4\nM5\nM2\n", kSixAxes), (Causes{"1 SPINDLE_SPEED_NOT_POSITIVE"}));
  EXPECT_EQ(Told("F600\nG5 X1 Y1 I1 J1 P2\nX2 P1 Q1\nG5 X3 P1 Q1\nM2\n"),
            (Causes{"2 SPLINE_CONTROL_MISSING"}));
  EXPECT_EQ(Told("F600\nG81 X1 Z-3.4.5 R2\nX2\nX3 Y1\nG80\nM2\n", kSixAxes), (Causes{"2 BAD_CHARACTER"}));
  EXPECT_EQ(Told("T1.5\nM6\nM3\nM5\nM2\n"), (Causes{"1 TOOL_NUMBER_OUT_OF_RANGE"}));
  EXPECT_EQ(Told("G41\nF600\nG1 X9\nM3\nT2 M6\nG40 G0 X0\nM2\n"), (Causes{"5 NOT_WITH_KERF_ON"}));
  // The end, and what stands behind it.
  EXPECT_EQ(Told("G0 X1\nM30 Q4\nthe operator's notes\n"), (Causes{"2 WORD_WITHOUT_USE"}));
  EXPECT_EQ(Told("G0 X1\nM30 Q4.4.4\nthe operator's notes\n"), (Causes{"2 BAD_CHARACTER"}));
  // Parameters.
  EXPECT_EQ(Told("#1=4a\n#<b>=2\nG0 X#1\nX#<c>\nM2\n"), (Causes{"1 BAD_NUMBER"}));
}

TEST(WrongPrograms, TellEveryFaultThatStandsForItself) {
  EXPECT_EQ(Told("F600\nG1 X10 Q1\nG2 X20 Y10 I11\nM2\n"),
            (Causes{"2 WORD_WITHOUT_USE", "3 ARC_RADIUS_DIFFERS"}));
  EXPECT_EQ(Told("G0 X0 Y0\nF600\nG1 X10 Y0 E3.5.1\nG1 X0 Y0\nG2 X20 Y10 I9\nM2\n"),
            (Causes{"3 BAD_CHARACTER", "5 ARC_RADIUS_DIFFERS"}));
  EXPECT_EQ(Told("F600\nG2 X10 I4\nG3 X20 I4\nG2 X30 I5\nM2\n"),
            (Causes{"2 ARC_RADIUS_DIFFERS", "3 ARC_RADIUS_DIFFERS"}));
  EXPECT_EQ(Told("F600\nM3\nG1 X1\nG0 X2\nM5\nM3\nG1 X3\nG0 X4\nM5\nM2\n"),
            (Causes{"4 TRAVERSE_WITH_JET_ON", "8 TRAVERSE_WITH_JET_ON"}));
  EXPECT_EQ(Told("G1 X1\nF0\nX2\nF600\nX3\nF-1\nM2\n"),
            (Causes{"1 FEED_MISSING", "2 FEED_NOT_POSITIVE", "6 FEED_NOT_POSITIVE"}));
  EXPECT_EQ(Told("G77\nM77 M78\nG0 X0\nG78 G79\nM2\n"),
            (Causes{"1 UNKNOWN_G_CODE", "2 UNKNOWN_M_CODE", "2 UNKNOWN_M_CODE", "4 UNKNOWN_G_CODE",
                    "4 UNKNOWN_G_CODE"}));
  EXPECT_EQ(Told("G0 X1 Q1 E2\nM2\n"), (Causes{"1 WORD_WITHOUT_USE", "1 WORD_WITHOUT_USE"}));
  EXPECT_EQ(Told("G77\nG0 X1\n"), (Causes{"1 UNKNOWN_G_CODE", "2 PROGRAM_END_MISSING"}));
  EXPECT_EQ(Told("G77\nF600\nG41\nG41\nG1 X9\nG40\nG1 X0\nM2\n"),
            (Causes{"1 UNKNOWN_G_CODE", "4 KERF_ALREADY_ON"}));
  EXPECT_EQ(Told("#<a>=1\nF600\nG77\nG1 X#<a>\nG2 X[#<a>+5] I1\nM2\n"),
            (Causes{"3 UNKNOWN_G_CODE", "5 ARC_RADIUS_DIFFERS"}));
}

TEST(WrongPrograms, StopAtTheLimitOfFaults) {
  std::string text;
  for (int i = 0; i < 1000; ++i) {
    text += "G77\n";
  }
  EXPECT_EQ(AdmitPartProgram(text, DemoLikeMachine(), {}).faults.size(), 100u);
}

// Ten million lines, nearly all of them wrong: refused at the limit, not read to the end.
TEST(WrongPrograms, DoNotCostMoreThanTheyMust) {
  std::string text;
  text.reserve(40'000'000);
  for (int i = 0; i < 10'000'000; ++i) {
    text += "G7\n";
  }
  EXPECT_EQ(AdmitPartProgram(text, DemoLikeMachine(), {}).faults.size(), 100u);
}

}  // namespace
}  // namespace lambdajet::trajectory
