#include <gtest/gtest.h>

#include <limits>
#include <nlohmann/json.hpp>
#include <sstream>

#include "platform/telemetry/log.hpp"

namespace lambdajet::test {
namespace {

// What the log has written to stderr, line by line as JSON; a line that is none fails the test.
template <typename Write>
std::vector<nlohmann::json> Lines(const LogOptions& options, Write&& write) {
  ::testing::internal::CaptureStderr();
  {
    Log log(options);
    write(log);
  }
  std::istringstream text(::testing::internal::GetCapturedStderr());
  std::vector<nlohmann::json> lines;
  for (std::string line; std::getline(text, line);) {
    lines.push_back(nlohmann::json::parse(line, nullptr, false));
    EXPECT_TRUE(lines.back().is_object()) << line;
  }
  return lines;
}

TEST(Log, WritesOneObjectALine) {
  const auto lines = Lines({"drive"}, [](Log& log) {
    log.Info("started", "it \"runs\"\n\tnow\x01",
             {{"port", 50051}, {"s_mm", 0.1}, {"ok", true}, {"who", "ann"}});
  });
  ASSERT_EQ(lines.size(), 1u);
  EXPECT_EQ(lines[0]["house"], "drive");
  EXPECT_EQ(lines[0]["level"], "info");
  EXPECT_EQ(lines[0]["event"], "started");
  EXPECT_EQ(lines[0]["message"], "it \"runs\"\n\tnow\x01");
  EXPECT_EQ(lines[0]["port"], 50051);
  EXPECT_EQ(lines[0]["s_mm"], 0.1);
  EXPECT_EQ(lines[0]["ok"], true);
  EXPECT_EQ(lines[0]["who"], "ann");
  EXPECT_GT(lines[0]["mono_ns"].get<std::int64_t>(), 0);
  EXPECT_EQ(lines[0]["ts"].get<std::string>().back(), 'Z');
}

TEST(Log, StaysJsonWithNumbersThatAreNone) {
  const auto lines = Lines({"drive"}, [](Log& log) {
    log.Error(
        "x", "y",
        {{"a", std::numeric_limits<double>::quiet_NaN()}, {"b", std::numeric_limits<double>::infinity()}});
  });
  ASSERT_EQ(lines.size(), 1u);
  EXPECT_EQ(lines[0]["b"], "inf");
}

TEST(Log, LeavesOutWhatIsBelowItsLevel) {
  const auto lines = Lines({"drive", LogLevel::kWarning}, [](Log& log) {
    log.Debug("a", "");
    log.Info("b", "");
    log.Warning("c", "");
    log.Error("d", "");
  });
  ASSERT_EQ(lines.size(), 2u);
  EXPECT_EQ(lines[0]["event"], "c");
}

TEST(Log, HoldsBackAnEventThatComesTooOften) {
  const auto lines = Lines({.house = "drive", .lines_per_second = 5}, [](Log& log) {
    for (int i = 0; i < 1000; ++i) {
      log.Info("often", "again");
    }
    log.Info("seldom", "once");
  });
  std::size_t often = 0;
  for (const auto& line : lines) {
    often += line["event"] == "often" ? 1 : 0;
  }
  EXPECT_GE(often, 5u);
  EXPECT_LE(often, 10u);  // two seconds at most are touched
  EXPECT_EQ(lines.back()["event"], "seldom");
}

}  // namespace
}  // namespace lambdajet::test
