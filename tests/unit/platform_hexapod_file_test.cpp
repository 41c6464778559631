#include <gtest/gtest.h>

#include <cstdlib>
#include <string>

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

}  // namespace
}  // namespace lambdajet
