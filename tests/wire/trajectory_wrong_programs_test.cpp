// Every wrong program of the corpus is refused with its reason, line and column; none is read to its end.
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
    EXPECT_FALSE(faults.front().message.empty());
  }
  tests::PrintFigure("wrong.gcode", static_cast<double>(expectations.size()));
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
