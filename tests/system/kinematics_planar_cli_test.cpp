// The lambda's half of `lambdajet kinematics` as a person runs it: tables in, tables and pictures out, exit codes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <pty.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/child_process.hpp"
#include "tests/support/temporary_folder.hpp"

namespace lambdajet {
namespace {

using testing::HasSubstr;

class PlanarCli : public testing::Test {
 protected:
  int Run(std::vector<std::string> words) {
    words.insert(words.begin(), "kinematics");
    test::ChildOptions options;
    options.program = "lambdajet";
    options.arguments = std::move(words);
    test::ChildProcess program(options);
    const int code = program.WaitForExit().value_or(-1);
    out_ = program.out();
    err_ = program.err();
    return code;
  }
  std::string Machine() const { return test::SourceDir() + "/deploy/config/machine.yaml"; }
  std::string Write(const std::string& name, const std::string& text) {
    std::ofstream(folder_.File(name)) << text;
    return folder_.File(name);
  }
  std::string Read(const std::string& name) const {
    std::ostringstream text;
    text << std::ifstream(folder_.File(name)).rdbuf();
    return text.str();
  }
  // The numbers of one column of a table that was written.
  std::vector<std::string> Column(const std::string& text, const std::string& name) const {
    std::istringstream lines(text);
    std::string line, cell;
    std::getline(lines, line);
    std::istringstream header(line);
    int at = 0;
    while (std::getline(header, cell, ',') && cell != name) {
      ++at;
    }
    std::vector<std::string> column;
    while (std::getline(lines, line)) {
      std::istringstream cells(line);
      for (int i = 0; i <= at; ++i) {
        std::getline(cells, cell, ',');
      }
      column.push_back(cell);
    }
    return column;
  }

  test::TemporaryFolder folder_;
  std::string out_, err_;
};

// All that a person sees of the command on a terminal of their own.
std::string OnTerminal(const std::vector<std::string>& words) {
  const std::string program = test::BinDir() + "/lambdajet";
  std::vector<char*> arguments = {const_cast<char*>(program.c_str())};
  for (const std::string& word : words) {
    arguments.push_back(const_cast<char*>(word.c_str()));
  }
  arguments.push_back(nullptr);
  int terminal = -1;
  const pid_t child = forkpty(&terminal, nullptr, nullptr, nullptr);
  if (child == 0) {
    execv(program.c_str(), arguments.data());
    _exit(127);
  }
  std::string seen;
  char bytes[4096];
  for (ssize_t count = 0; (count = read(terminal, bytes, sizeof bytes)) > 0;) {
    seen.append(bytes, static_cast<std::size_t>(count));
  }
  close(terminal);
  int status = 0;
  EXPECT_EQ(waitpid(child, &status, 0), child);
  EXPECT_EQ(WIFEXITED(status) ? WEXITSTATUS(status) : -1, 0) << seen;
  return seen;
}

// The percents of a bar and of what it says is done, in their order.
std::vector<int> Percents(const std::string& seen, const std::string& what) {
  std::vector<int> percents;
  const std::regex bar(R"(\[#*\.*\] +(\d+) % )" + what);
  for (std::sregex_iterator found(seen.begin(), seen.end(), bar), none; found != none; ++found) {
    percents.push_back(std::stoi((*found)[1]));
  }
  return percents;
}

// It grows, in steps that can be seen; what stands there last is where the work ended.
void ExpectGrowingBar(const std::string& seen, const std::string& what) {
  const std::vector<int> percents = Percents(seen, what);
  ASSERT_GE(percents.size(), 5u) << seen;
  EXPECT_TRUE(std::ranges::is_sorted(percents)) << seen;
  EXPECT_EQ(percents.back(), 100) << seen;
}

TEST_F(PlanarCli, InverseAndForwardUndoEachOtherRowByRow) {
  const std::string poses = Write("poses.csv", "x_D_mm,y_D_mm\n500,700\n0,1234\n-100,400\n0,3\n");
  ASSERT_EQ(Run({"inverse", "--machine", Machine(), "--in", poses, "--out", folder_.File("sliders.csv")}), 0)
      << err_;
  const std::string sliders = Read("sliders.csv");
  EXPECT_THAT(Column(sliders, "reason"),
              testing::ElementsAre("SOLVED", "OUT_OF_REACH", "SOLVED", "SINGULAR"));
  EXPECT_NEAR(std::stod(Column(sliders, "actuator_2_mm")[0]), 618.8780654087, 1e-9);
  EXPECT_NEAR(std::stod(Column(sliders, "excess_mm")[1]), 34.0, 1e-9);
  Write("back.csv", "actuator_1_mm,actuator_2_mm\n" + Column(sliders, "actuator_1_mm")[2] + "," +
                        Column(sliders, "actuator_2_mm")[2] + "\n");
  ASSERT_EQ(Run({"forward", "--machine", Machine(), "--in", folder_.File("back.csv")}), 0) << err_;
  EXPECT_NEAR(std::stod(Column(out_, "x_D_mm")[0]), -100.0, 1e-9);
  EXPECT_NEAR(std::stod(Column(out_, "y_D_mm")[0]), 400.0, 1e-9);
}

TEST_F(PlanarCli, AnotherWorkingModeIsAskedForByName) {
  const std::string poses = Write("poses.csv", "x_D_mm,y_D_mm\n500,700\n");
  ASSERT_EQ(Run({"inverse", "--machine", Machine(), "--mode=--", "--in", poses}), 0) << err_;
  EXPECT_NEAR(std::stod(Column(out_, "actuator_1_mm")[0]), 1474.6794344809, 1e-9);
  EXPECT_EQ(Run({"inverse", "--machine", Machine(), "--mode", "5", "--in", poses}), 2);
  EXPECT_THAT(err_, HasSubstr("BAD_MODE"));
}

TEST_F(PlanarCli, TabulatesJacobiansAndSingularities) {
  const std::string poses = Write("poses.csv", "x_D_mm,y_D_mm\n500,700\n");
  ASSERT_EQ(Run({"jacobian", "--machine", Machine(), "--in", poses}), 0) << err_;
  EXPECT_NEAR(std::stod(Column(out_, "q1_by_y")[0]), 0.7181848465, 1e-10);
  EXPECT_NEAR(std::stod(Column(out_, "determinant")[0]), -0.647767557825, 1e-12);
  ASSERT_EQ(Run({"singularity", "--machine", Machine(), "--in", poses, "--json"}), 0) << err_;
  EXPECT_THAT(out_, HasSubstr("\"type\":\"REGULAR\""));
}

TEST_F(PlanarCli, TracesTheWorkspaceAndSaysWhatBinds) {
  ASSERT_EQ(Run({"workspace", "--machine", Machine(), "--out", folder_.File("workspace.csv")}), 0) << err_;
  EXPECT_GT(Column(Read("workspace.csv"), "x_D_mm").size(), 100u);
  EXPECT_THAT(err_, HasSubstr("bottom: the tool comes to the line of the sliders"));
}

TEST_F(PlanarCli, SweepsTheSheetAndRefusesAContact) {
  const std::string path = Write("path.csv", "x_D_mm,y_D_mm\n100,500\n600,500\n");
  EXPECT_EQ(Run({"sweep", "--machine", Machine(), "--in", path, "--body-mm", "900", "0", "1000", "2000"}), 4);
  EXPECT_THAT(out_, HasSubstr("x_D 400"));
  EXPECT_EQ(Run({"sweep", "--machine", Machine(), "--in", path, "--body-mm", "1900", "0", "2000", "2000"}), 0)
      << err_;
}

TEST_F(PlanarCli, OptimisesAndWritesAMachineFileThatReads) {
  const std::string better = folder_.File("better.yaml");
  ASSERT_EQ(Run({"optimise", "--machine", Machine(), "--zone-mm", "0", "300", "800", "900", "--evaluations",
                 "200", "--out", better}),
            0)
      << err_;
  const std::string poses = Write("poses.csv", "x_D_mm,y_D_mm\n400,600\n");
  ASSERT_EQ(Run({"inverse", "--machine", better, "--in", poses}), 0) << err_;
  EXPECT_EQ(Column(out_, "reason")[0], "SOLVED");
  EXPECT_EQ(Run({"optimise", "--machine", Machine(), "--zone-mm", "-9000", "300", "9000", "900",
                 "--evaluations", "50"}),
            4);
  EXPECT_THAT(err_, HasSubstr("OUT_OF_REACH"));
}

TEST_F(PlanarCli, ShowsABarOnATerminalWhileWorkIsLong) {
  const std::vector<std::string> optimise = {"optimise",    "--machine", Machine(),       "--zone-mm",
                                             "0",           "300",       "800",           "900",
                                             "--objective", "rectangle", "--evaluations", "250"};
  std::vector<std::string> words = optimise;
  words.insert(words.begin(), "kinematics");
  ExpectGrowingBar(OnTerminal(words), "trying geometries");
  words.insert(words.begin(), "--quiet");
  EXPECT_TRUE(Percents(OnTerminal(words), "trying geometries").empty());
  ASSERT_EQ(Run(optimise), 0) << err_;
  EXPECT_THAT(out_, testing::Not(HasSubstr("trying geometries")));
  EXPECT_THAT(err_, testing::Not(HasSubstr("\x1b["))) << "a bar is for terminals";
  EXPECT_THAT(err_, HasSubstr("% trying geometries"));

  const std::string die = test::SourceDir() + "/deploy/parts/pilger_die/die.yaml";
  ExpectGrowingBar(OnTerminal({"trajectory", "pilger", die}), "planning passes");
}

TEST_F(PlanarCli, DrawsPicturesInBothFormats) {
  for (const std::string suffix : {"svg", "png"}) {
    for (const std::string picture : {"workspace", "determinant", "pose"}) {
      const std::string file = picture + "." + suffix;
      std::vector<std::string> words = {"draw", picture, "--machine", Machine(), "--out", folder_.File(file)};
      if (picture == "pose") {
        words.insert(words.end(), {"--at-mm", "500", "700"});
      }
      ASSERT_EQ(Run(words), 0) << err_;
      const std::string bytes = Read(file);
      EXPECT_GT(bytes.size(), 3000u) << file;
      EXPECT_THAT(bytes.substr(0, 200), suffix == "svg" ? HasSubstr("<svg") : HasSubstr("PNG")) << file;
    }
  }
  EXPECT_EQ(
      Run({"draw", "pose", "--machine", Machine(), "--at-mm", "0", "5000", "--out", folder_.File("no.svg")}),
      4);
  EXPECT_THAT(err_, HasSubstr("OUT_OF_REACH"));
}

TEST_F(PlanarCli, RefusesTablesAndMachinesThatAreNone) {
  EXPECT_EQ(Run({"inverse"}), 2);
  EXPECT_NE(Run({"inverse", "--machine", folder_.File("none.yaml"), "--in", folder_.File("none.csv")}), 0);
  EXPECT_THAT(err_, HasSubstr("NO_SUCH_FILE"));
  const std::string poses = Write("poses.csv", "x_D_mm,y_D_mm\n500,nan\n");
  EXPECT_NE(Run({"inverse", "--machine", Machine(), "--in", poses}), 0);
  EXPECT_THAT(err_, HasSubstr("CSV_"));
  const std::string columns = Write("columns.csv", "x_D_mm,z_mm\n500,1\n");
  EXPECT_NE(Run({"inverse", "--machine", Machine(), "--in", columns}), 0);
  EXPECT_THAT(err_, HasSubstr("y_D_mm"));
}

}  // namespace
}  // namespace lambdajet
