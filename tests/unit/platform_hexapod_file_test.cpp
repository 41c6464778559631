#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <string>

#include "foundation/contract/trouble.hpp"
#include "platform/machine_file/hexapod_file.hpp"

namespace lambdajet {
namespace {

std::string Example() {
  return std::string(std::getenv("LAMBDAJET_SOURCE_DIR")) + "/deploy/config/hexapod.yaml";
}

std::string Replaced(std::string text, const std::string& what, const std::string& by) {
  const auto at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  return at == std::string::npos ? text : text.replace(at, what.size(), by);
}

std::string ExampleText() {
  const auto machine = ReadHexapodFile(Example());
  EXPECT_TRUE(machine.ok()) << machine.status().ToString();
  return machine.ok() ? HexapodText(*machine) : "";
}

void ExpectRefused(const std::string& yaml, const std::string& word) {
  const auto machine = ParseHexapod(yaml, "test.yaml");
  ASSERT_FALSE(machine.ok());
  EXPECT_EQ(machine.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_NE(std::string(machine.status().message()).find(word), std::string::npos)
      << machine.status().ToString();
}

TEST(HexapodFile, ReadsTheExampleOfTheDeployment) {
  const auto machine = ReadHexapodFile(Example());
  ASSERT_TRUE(machine.ok()) << machine.status().ToString();
  EXPECT_EQ(machine->machine_id, "hexapod-1");
  EXPECT_NEAR(machine->geometry.p_MA_mm.col(3).norm(), 600.0, 1e-9);
  EXPECT_NEAR(machine->geometry.R_MA[0](0, 0), -0.852730875, 1e-9);
  EXPECT_EQ(machine->geometry.joints[5], UniversalJoint{});
  EXPECT_EQ(machine->motion.strut_jerk_mm_per_s3, 150000.0);
  EXPECT_EQ(machine->motion.X_MT_zero.p_mm, Eigen::Vector3d(0, 0, 980));
}

TEST(HexapodFile, WritesWhatItReads) {
  auto machine = ReadHexapodFile(Example());
  ASSERT_TRUE(machine.ok());
  machine->geometry.joints[2].ez_mm = 0.05;
  machine->geometry.joints[2].nu_rad = -2e-4;
  machine->geometry.length_zero_mm[4] = 512.25;
  machine->motion.X_MT_zero = Pose::FromKrylov({12.5, -3, 940}, {0.25, -0.125, 0.5});
  const std::string text = HexapodText(*machine);
  const auto again = ParseHexapod(text, "again");
  ASSERT_TRUE(again.ok()) << again.status().ToString();
  EXPECT_EQ(HexapodText(*again), text);
  EXPECT_EQ(again->geometry.joints, machine->geometry.joints);
  EXPECT_EQ(again->geometry.length_zero_mm, machine->geometry.length_zero_mm);
}

TEST(HexapodFile, RefusesWithKeyAndLine) {
  const std::string text = ExampleText();
  ExpectRefused(Replaced(text, "screw_lead_mm: 0", "screw_lead_mm: ten"), "screw_lead_mm is 'ten'");
  ExpectRefused(Replaced(text, "screw_lead_mm: 0", "screw_led_mm: 0"), "screw_led_mm is not a known key");
  ExpectRefused(Replaced(text, "    length_zero_mm: 0\n", ""), "struts.1.length_zero_mm is missing");
  ExpectRefused(Replaced(text, "p_PB_mm: [", "p_PB_mm: [.nan, "), "struts.1.p_PB_mm is not three");
  ExpectRefused(Replaced(text, "strut_max_mm: 1150", "strut_max_mm: 1"), "strut limits");
  ExpectRefused(Replaced(text, "strut_jerk_mm_per_s3: 150000", "strut_jerk_mm_per_s3: 0"),
                "limits of motion");
  ExpectRefused(Replaced(text, "  rapid_mm_per_s: 400\n", ""), "motion.rapid_mm_per_s is missing");
  ExpectRefused(Replaced(text, "program_zero: {x_mm: 0, ", "program_zero: {"),
                "program_zero.x_mm is missing");
  ExpectRefused("struts: []", "is not a list of six struts");
  ExpectRefused("[", "is not YAML");
  ExpectRefused("", "is not a map of keys");
}

TEST(HexapodFile, ReadsASpindleOrNone) {
  const std::string text = ExampleText();
  const auto with = ParseHexapod(text, "test.yaml");
  ASSERT_TRUE(with.ok()) << with.status().ToString();
  EXPECT_EQ(with->motion.spindle_least_per_min, 500.0);
  EXPECT_EQ(with->motion.spindle_most_per_min, 12000.0);
  EXPECT_EQ(with->motion.spindle_run_up_s, 1.5);
  const std::string bare = text.substr(0, text.find("spindle:"));
  const auto without = ParseHexapod(bare, "test.yaml");
  ASSERT_TRUE(without.ok()) << without.status().ToString();
  EXPECT_EQ(without->motion.spindle_most_per_min, 0.0);
  EXPECT_EQ(HexapodText(*without), bare);
  EXPECT_NE(HexapodHash(*without), HexapodHash(*with));
  // Bounds themselves are right: turning from rest on, at once, or at one speed only.
  for (const char* spindle : {"{least_per_min: 0, most_per_min: 12000, run_up_s: 0}",
                              "{least_per_min: 3000, most_per_min: 3000, run_up_s: 600}",
                              "{least_per_min: 1, most_per_min: 1e6, run_up_s: 1.5}"}) {
    const auto edge = ParseHexapod(bare + "spindle: " + spindle + "\n", "test.yaml");
    ASSERT_TRUE(edge.ok()) << edge.status().ToString();
    EXPECT_EQ(ParseHexapod(HexapodText(*edge), "again")->motion.spindle_run_up_s,
              edge->motion.spindle_run_up_s);
  }
}

TEST(HexapodFile, RefusesASpindleThatCannotBeByKeyAndLine) {
  const std::string text = ExampleText(), bare = text.substr(0, text.find("spindle:"));
  const auto refused = [&](const std::string& spindle, const std::string& word, const std::string& reason) {
    SCOPED_TRACE(spindle);
    const auto machine = ParseHexapod(bare + "spindle: " + spindle + "\n", "test.yaml");
    ASSERT_FALSE(machine.ok());
    EXPECT_EQ(machine.status().code(), absl::StatusCode::kInvalidArgument);
    EXPECT_EQ(TroubleReason(machine.status()), "BAD_HEXAPOD_FILE");
    const std::string message(machine.status().message());
    EXPECT_NE(message.find(word), std::string::npos) << message;
    const auto violations = TroubleViolations(machine.status());
    ASSERT_FALSE(violations.empty());
    EXPECT_EQ(violations[0].reason, reason) << message;
    EXPECT_EQ(violations[0].field.rfind("spindle", 0), 0u) << violations[0].field;
    const int line = static_cast<int>(std::count(bare.begin(), bare.end(), '\n')) + 1;
    EXPECT_NE(message.find("test.yaml:" + std::to_string(line) + ": spindle"), std::string::npos) << message;
  };
  const std::string good = "{least_per_min: 500, most_per_min: 12000, run_up_s: 1.5}";
  refused("12000", "spindle is not a map of keys", "WRONG_TYPE");
  refused(Replaced(good, "least_per_min: 500, ", ""), "spindle.least_per_min is missing", "MISSING");
  refused(Replaced(good, "most_per_min: 12000, ", ""), "spindle.most_per_min is missing", "MISSING");
  refused(Replaced(good, ", run_up_s: 1.5", ""), "spindle.run_up_s is missing", "MISSING");
  refused(Replaced(good, "1.5", "1.5, most_rad_per_s: 1256"), "spindle.most_rad_per_s is not a known key",
          "UNKNOWN_KEY");
  refused(Replaced(good, "run_up_s: 1.5", "run_up_ms: 1500"), "spindle.run_up_s is missing", "MISSING");
  refused(Replaced(good, "12000", "12000 rpm"), "spindle.most_per_min is '12000 rpm'", "WRONG_VALUE");
  refused(Replaced(good, "12000", ".nan"), "spindle.most_per_min is ", "WRONG_VALUE");
  refused(Replaced(good, "12000", ".inf"), "spindle.most_per_min is ", "WRONG_VALUE");
  refused(Replaced(good, "500", "500, least_per_min: 600"), "spindle.least_per_min stands here a second time",
          "DUPLICATE");
  refused("{least_per_min: 0, most_per_min: 0, run_up_s: 1.5}", "spindle.most_per_min is 0; right is above 0",
          "WRONG_VALUE");
  refused(Replaced(good, "12000", "-12000"), "spindle.most_per_min is -12000; right is", "WRONG_VALUE");
  refused(Replaced(good, "12000", "1e12"), "spindle.most_per_min is 1e+12; right is", "WRONG_VALUE");
  refused(Replaced(good, "500", "13000"), "spindle.least_per_min is 13000; right is 0 up to most_per_min",
          "WRONG_VALUE");
  refused(Replaced(good, "500", "-1"), "spindle.least_per_min is -1; right is", "WRONG_VALUE");
  refused(Replaced(good, "1.5", "-0.1"), "spindle.run_up_s is -0.1; right is 0 to 600 s", "WRONG_VALUE");
  refused(Replaced(good, "1.5", "1e5"), "spindle.run_up_s is 1e+05; right is 0 to 600 s", "WRONG_VALUE");
}

}  // namespace
}  // namespace lambdajet
