// A few seconds of each load on real processes: no errors, and the reports are there. Says nothing about speed.
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "tests/support/child_process.hpp"
#include "tests/support/private_domain.hpp"
#include "tests/support/temporary_folder.hpp"

namespace lambdajet {
namespace {

using test::ChildProcess;

std::string Content(const std::string& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

class LoadSlice : public testing::Test {
 protected:
  test::ChildOptions Process(const std::string& name, std::vector<std::string> further = {}) {
    test::ChildOptions options;
    options.program = name;
    options.announce_file = folder.File(name + ".announce.json");
    options.arguments = {"--config=" + test::SourceDir() + "/deploy/config/loopback.yaml",
                         "--bus.domain=" + std::to_string(domain.number())};
    options.arguments.insert(options.arguments.end(), further.begin(), further.end());
    return options;
  }

  void RunLoad(const std::string& scenario, int port, const std::string& rate) {
    const std::string html = folder.File(scenario + ".html");
    const std::string json = folder.File(scenario + ".json");
    ChildProcess load({.program = "lambdajet_load",
                       .arguments = {scenario, "--address=127.0.0.1:" + std::to_string(port),
                                     "--rate=" + rate, "--duration=2", "--html=" + html, "--json=" + json},
                       .environment = {},
                       .announce_file = ""});
    const auto exit_code = load.WaitForExit(std::chrono::seconds(60));
    ASSERT_TRUE(exit_code.has_value());
    EXPECT_EQ(*exit_code, 0) << load.out() << load.err();
    const auto figures = nlohmann::json::parse(Content(json), nullptr, false);
    ASSERT_TRUE(figures.is_array());
    EXPECT_EQ(figures[0]["answered"], 2 * std::stoi(rate));
    EXPECT_TRUE(figures[0]["errors"].empty());
    EXPECT_NE(Content(html).find("<polyline"), std::string::npos);
    std::printf("%s", load.out().c_str());
  }

  test::TemporaryFolder folder;
  test::PrivateDomain domain;
};

TEST_F(LoadSlice, AMesThatPollsAndWatchersHaveNoErrors) {
  ChildProcess cell(Process("cell", {"--store=" + folder.File("cell.sqlite")}));
  const auto ready = cell.WaitUntilReady();
  ASSERT_TRUE(ready) << cell.err();
  RunLoad("mes", ready->rpc_port, "200");
}

TEST_F(LoadSlice, ACamSystemThatSolvesBatchesHasNoErrors) {
  ChildProcess calibration(
      Process("calibration", {"--store=" + folder.File("calibration.sqlite"),
                              "--machine=" + test::SourceDir() + "/deploy/config/machine.yaml"}));
  ChildProcess kinematics(Process("kinematics"));
  const auto ready = kinematics.WaitUntilReady();
  ASSERT_TRUE(ready) << kinematics.err() << calibration.err();
  RunLoad("cam", ready->rpc_port, "50");
}

TEST_F(LoadSlice, ProgrammersWhoPlanHaveNoErrors) {
  ChildProcess calibration(
      Process("calibration", {"--store=" + folder.File("calibration.sqlite"),
                              "--machine=" + test::SourceDir() + "/deploy/config/machine.yaml"}));
  ChildProcess trajectory(Process("trajectory"));
  const auto ready = trajectory.WaitUntilReady();
  ASSERT_TRUE(ready) << trajectory.err() << calibration.err();
  RunLoad("plans", ready->rpc_port, "20");
}

}  // namespace
}  // namespace lambdajet
