// Every wrong program of the corpus is refused with its reason, line and column; none is read to its end.
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "tests/laws/trajectory_cases.hpp"
#include "trajectory/core/feed/plan_program.hpp"

namespace lambdajet::trajectory {
namespace {

std::string Folder() {
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
};

std::vector<Expectation> Expectations() {
  std::vector<Expectation> list;
  std::istringstream table(Content(Folder() + "expected.csv"));
  std::string row;
  std::getline(table, row);
  while (std::getline(table, row)) {
    std::istringstream cells(row);
    Expectation e;
    char comma = 0;
    std::getline(cells, e.program, ',');
    std::getline(cells, e.reason, ',');
    cells >> e.line >> comma >> e.column;
    list.push_back(e);
  }
  return list;
}

TEST(WrongPrograms, AreRefusedWithReasonLineAndColumn) {
  const MachineDescription machine = DemoLikeMachine();
  const std::vector<Expectation> expectations = Expectations();
  EXPECT_GE(expectations.size(), 150u);
  for (const Expectation& e : expectations) {
    SCOPED_TRACE(e.program);
    const Admission admission = AdmitPartProgram(Content(Folder() + e.program + ".ngc"), machine, {});
    ASSERT_FALSE(admission.faults.empty());
    const ProgramFault& fault = admission.faults.front();
    EXPECT_EQ(fault.reason, e.reason);
    EXPECT_EQ(fault.line, e.line);
    EXPECT_EQ(fault.column, e.column);
    EXPECT_FALSE(fault.message.empty());
    EXPECT_TRUE(PlanPartProgram(Content(Folder() + e.program + ".ngc"), machine, {}).plan.segments.empty());
  }
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
