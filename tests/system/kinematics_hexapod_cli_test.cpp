// The hexapod's half of `lambdajet kinematics` as a person runs it: tables in, tables and pictures out, exit codes.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

namespace {

class HexapodCli : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / ("lambdajet_hexapod_cli_" + std::to_string(getpid()));
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::string File(const std::string& name) const { return (folder_ / name).string(); }
  void Write(const std::string& name, const std::string& text) const { std::ofstream(File(name)) << text; }
  std::string Read(const std::string& name) const {
    std::ostringstream text;
    text << std::ifstream(File(name)).rdbuf();
    return text.str();
  }
  int Run(const std::string& words) const {
    const std::string command = std::string(std::getenv("LAMBDAJET_BIN_DIR")) + "/lambdajet kinematics " +
                                words + " >" + File("stdout") + " 2>" + File("stderr");
    return WEXITSTATUS(std::system(command.c_str()));
  }
  std::string Machine() const {
    return " --mechanism hexapod --machine " + std::string(std::getenv("LAMBDAJET_SOURCE_DIR")) +
           "/deploy/config/hexapod.yaml";
  }

 private:
  std::filesystem::path folder_;
};

std::vector<std::vector<std::string>> Cells(const std::string& text) {
  std::vector<std::vector<std::string>> rows;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    rows.emplace_back();
    std::istringstream cells(line);
    for (std::string cell; std::getline(cells, cell, ',');) {
      rows.back().push_back(cell);
    }
  }
  return rows;
}

constexpr char kPoses[] =
    "x_mm,y_mm,z_mm,psi_rad,theta_rad,gamma_rad\n"
    "0,0,950,0,0,0\n"
    "60,-40,980,0.1,0.15,-0.1\n"
    "0,0,5000,0,0,0\n";

TEST_F(HexapodCli, InverseAndForwardComeBackToTheSamePoses) {
  Write("poses.csv", kPoses);
  ASSERT_EQ(Run("inverse" + Machine() + " --in " + File("poses.csv") + " --out " + File("struts.csv")), 0)
      << Read("stderr");
  const auto struts = Cells(Read("struts.csv"));
  ASSERT_EQ(struts.size(), 4u);
  EXPECT_EQ(struts[0][0], "strut_1_mm");
  EXPECT_EQ(struts[1][6], "SOLVED");
  EXPECT_EQ(struts[3][6], "ACTUATOR_LIMIT");
  EXPECT_EQ(struts[3][7], "STRUT_MAX");
  ASSERT_EQ(Run("forward" + Machine() + " --in " + File("struts.csv") + " --out " + File("again.csv")), 0)
      << Read("stderr");
  const auto poses = Cells(kPoses);
  const auto again = Cells(Read("again.csv"));
  ASSERT_EQ(again.size(), 4u);
  for (std::size_t i = 1; i < 3; ++i) {
    EXPECT_EQ(again[i][8], "SOLVED");
    for (std::size_t c = 0; c < 6; ++c) {
      EXPECT_NEAR(std::stod(again[i][c]), std::stod(poses[i][c]), 1e-9);
    }
  }
}

TEST_F(HexapodCli, EveryVerbAnswers) {
  Write("poses.csv", kPoses);
  ASSERT_EQ(Run("singularity" + Machine() + " --in " + File("poses.csv")), 0) << Read("stderr");
  EXPECT_GT(std::stod(Cells(Read("stdout"))[1][0]), 0.5);
  ASSERT_EQ(Run("jacobian" + Machine() + " --in " + File("poses.csv")), 0);
  EXPECT_EQ(Cells(Read("stdout"))[1].size(), 36u + 6u * 17u + 1u);
  ASSERT_EQ(Run("workspace" + Machine() + " --z-mm 950 --step-mm 20 --tilt-rad 0.1"), 0) << Read("stderr");
  EXPECT_GT(Cells(Read("stdout")).size(), 10u);
  ASSERT_EQ(Run("service-area --sweep tilt_rad --from 0 --to 0.5 --points 3"), 0);
  EXPECT_EQ(Cells(Read("stdout")).size(), 4u);
}

TEST_F(HexapodCli, RefusesWithTheExitCodeThatFits) {
  EXPECT_EQ(Run("inverse --mechanism dodecapod --machine x.yaml"), 2);
  EXPECT_EQ(Run("service-area --set nothing=1"), 4);
  EXPECT_EQ(Run("service-area --set strut_max_mm=1"), 4);
  EXPECT_EQ(Run("inverse" + Machine() + " --in " + File("missing.csv")), 2);
  Write("poses.csv", "x_mm,y_mm\n1,2\n");
  EXPECT_EQ(Run("inverse" + Machine() + " --in " + File("poses.csv")), 2);
  Write("poses.csv", "x_mm,y_mm,z_mm,psi_rad,theta_rad,gamma_rad\n0,0,nan,0,0,0\n");
  EXPECT_EQ(Run("inverse" + Machine() + " --in " + File("poses.csv")), 2);
  EXPECT_EQ(Run("draw sweeps --out " + File("sweeps.gif")), 2);
}

TEST_F(HexapodCli, DrawsPicturesThatAreOnes) {
  const std::string machine = Machine().substr(std::string(" --mechanism hexapod").size());
  for (const std::string& words :
       {"draw hexapod" + machine, std::string("draw service-area"), std::string("draw sweeps")}) {
    ASSERT_EQ(Run(words + " --out " + File("picture.png")), 0) << Read("stderr");
    EXPECT_EQ(Read("picture.png").substr(1, 3), "PNG");
    EXPECT_GT(Read("picture.png").size(), 20000u);
    ASSERT_EQ(Run(words + " --out " + File("picture.svg")), 0) << Read("stderr");
    EXPECT_NE(Read("picture.svg").find("<svg"), std::string::npos);
    EXPECT_NE(Read("picture.svg").find("</svg>"), std::string::npos);
  }
}

}  // namespace
