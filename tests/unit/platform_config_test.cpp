#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>

#include "platform/config/load.hpp"
#include "tests/support/temporary_folder.hpp"

namespace lambdajet::test {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

class Config : public ::testing::Test {
 protected:
  Config() {
    schema_.Add("rpc.address", &address_, "where gRPC listens");
    schema_.Add("rpc.reflection", &reflection_, "list the services");
    schema_.Add("path.feed_mm_per_s", &feed_mm_per_s_, {0.1, 500.0}, "fastest feed");
    schema_.Add("bus.domain", &domain_, {0, 232}, "DDS domain");
    schema_.Add("bus.peers", &peers_, "hosts");
    schema_.AddChoice("log_level", &level_, {"info", "error"}, "least level");
    schema_.AddPath("bus.key_file", &key_file_, "keys");
  }

  ConfigOutcome Load(std::vector<std::string> arguments, const std::string& yaml = "") {
    if (!yaml.empty()) {
      arguments.push_back("--config=" + folder_.Write("house.yaml", yaml));
    }
    return LoadConfig(schema_, {"house", "a house for tests", arguments, [this](const std::string& name) {
                                  const auto found = environment_.find(name);
                                  return found == environment_.end() ? std::nullopt
                                                                     : std::optional(found->second);
                                }});
  }

  TemporaryFolder folder_;
  std::map<std::string, std::string> environment_;
  ConfigSchema schema_;
  std::string address_ = "127.0.0.1:0";
  bool reflection_ = false;
  double feed_mm_per_s_ = 100.0;
  int domain_ = 42;
  std::vector<std::string> peers_;
  std::string level_ = "info";
  std::string key_file_;
};

TEST_F(Config, FlagWinsOverEnvironmentOverFileOverDefault) {
  const std::string yaml = "path: {feed_mm_per_s: 1}\nbus: {domain: 1}\nlog_level: error\n";
  environment_ = {{"LAMBDAJET_PATH_FEED_MM_PER_S", "2"}, {"LAMBDAJET_BUS_DOMAIN", "2"}};
  ASSERT_EQ(Load({"--path.feed_mm_per_s", "3"}, yaml).exit_code, std::nullopt);
  EXPECT_EQ(feed_mm_per_s_, 3.0);
  EXPECT_EQ(domain_, 2);
  EXPECT_EQ(level_, "error");
  EXPECT_EQ(address_, "127.0.0.1:0");
}

TEST_F(Config, PrintsValueAndOrigin) {
  environment_ = {{"LAMBDAJET_BUS_DOMAIN", "7"}};
  const ConfigOutcome outcome = Load({"--print-config", "--rpc.reflection=true"}, "\nlog_level: error\n");
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_THAT(outcome.out, HasSubstr("bus.domain: 7  # LAMBDAJET_BUS_DOMAIN\n"));
  EXPECT_THAT(outcome.out, HasSubstr("rpc.reflection: true  # flag\n"));
  EXPECT_THAT(outcome.out, HasSubstr("log_level: \"error\"  # " + folder_.path() + "/house.yaml:2\n"));
  EXPECT_THAT(outcome.out, HasSubstr("path.feed_mm_per_s: 100  # default\n"));
}

TEST_F(Config, HelpNamesEverySetting) {
  const ConfigOutcome outcome = Load({"--help"});
  EXPECT_EQ(outcome.exit_code, 0);
  for (const Setting& setting : schema_.settings()) {
    EXPECT_THAT(outcome.out, AllOf(HasSubstr("--" + setting.name), HasSubstr(setting.EnvironmentName()),
                                   HasSubstr(setting.description)));
  }
}

TEST_F(Config, RefusesAnUnknownKeyWithFileLineAndTheNearestKey) {
  const ConfigOutcome outcome = Load({}, "log_level: info\nrpc:\n  adress: here\n");
  EXPECT_EQ(outcome.exit_code, kExitConfig);
  EXPECT_THAT(outcome.err,
              HasSubstr("house.yaml:3: unknown key rpc.adress; the nearest known key is rpc.address"));
}

TEST_F(Config, RefusesAnUnknownFlagWithTheNearest) {
  EXPECT_THAT(Load({"--bus.domian=3"}).err,
              HasSubstr("unknown flag --bus.domian; the nearest is --bus.domain"));
  EXPECT_THAT(Load({"stray"}).err, HasSubstr("unexpected argument 'stray'"));
  EXPECT_THAT(Load({"--bus.domain"}).err, HasSubstr("has no value"));
}

TEST_F(Config, NamesValueAndWhatIsRight) {
  const ConfigOutcome outcome = Load(
      {}, "path: {feed_mm_per_s: 501}\nbus: {domain: 1.5}\nlog_level: loud\nrpc: {reflection: perhaps}\n");
  EXPECT_EQ(outcome.exit_code, kExitConfig);
  EXPECT_THAT(outcome.err,
              HasSubstr("house.yaml:1: path.feed_mm_per_s is '501'; right is a number from 0.1 to 500"));
  EXPECT_THAT(outcome.err,
              HasSubstr("house.yaml:2: bus.domain is '1.5'; right is a whole number from 0 to 232"));
  EXPECT_THAT(outcome.err, HasSubstr("house.yaml:3: log_level is 'loud'; right is one of info error"));
  EXPECT_THAT(outcome.err, HasSubstr("house.yaml:4: rpc.reflection is 'perhaps'; right is true or false"));
}

TEST_F(Config, NamesTheVariableThatIsWrong) {
  environment_ = {{"LAMBDAJET_PATH_FEED_MM_PER_S", "nan"}};
  EXPECT_THAT(Load({}).err, HasSubstr("LAMBDAJET_PATH_FEED_MM_PER_S: path.feed_mm_per_s is 'nan'"));
}

TEST_F(Config, RefusesDuplicatesMapsAndFilesThatAreNone) {
  EXPECT_THAT(Load({}, "log_level: info\nlog_level: info\n").err,
              HasSubstr(":2: log_level stands here a second time"));
  EXPECT_THAT(Load({}, "log_level: {a: b}\n").err, HasSubstr("log_level is a map"));
  EXPECT_THAT(Load({}, "- a\n").err, HasSubstr("must be a map of settings"));
  EXPECT_THAT(Load({}, "a: [\n").err, HasSubstr("house.yaml:"));
  EXPECT_THAT(Load({"--config=/no/such.yaml"}).err, HasSubstr("/no/such.yaml"));
  EXPECT_THAT(Load({"--config=/tmp"}).err, HasSubstr("not a regular file"));
}

TEST_F(Config, TellsAtMostTwentyFaults) {
  std::string yaml;
  for (int i = 0; i < 100; ++i) {
    yaml += "unknown_" + std::to_string(i) + ": 1\n";
  }
  const std::string err = Load({}, yaml).err;
  EXPECT_THAT(err, HasSubstr("house.yaml:20:"));
  EXPECT_THAT(err, Not(HasSubstr("house.yaml:21:")));
}

TEST_F(Config, ReadsListsAndAnchorsPathsAtTheFile) {
  ASSERT_EQ(Load({}, "bus:\n  peers: [drive, main-motion]\n  key_file: keys/bus.key\n").exit_code,
            std::nullopt);
  EXPECT_THAT(peers_, ElementsAre("drive", "main-motion"));
  EXPECT_EQ(key_file_, folder_.path() + "/keys/bus.key");
  ASSERT_EQ(Load({"--bus.peers=a,b", "--bus.key_file=here.key"}).exit_code, std::nullopt);
  EXPECT_THAT(peers_, ElementsAre("a", "b"));
  EXPECT_EQ(key_file_, "here.key");
}

}  // namespace
}  // namespace lambdajet::test
