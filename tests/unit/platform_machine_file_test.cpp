#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "foundation/contract/trouble.hpp"
#include "platform/machine_file/machine_file.hpp"
#include "platform/process/atomic_file.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/temporary_folder.hpp"

namespace lambdajet::test {
namespace {

using ::testing::HasSubstr;

std::string DemoPath() { return SourceDir() + "/deploy/config/machine.yaml"; }

std::string DemoText() { return *ReadWholeFile(DemoPath(), 1 << 20); }

std::string Replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

int LineOf(const std::string& text, const std::string& what) {
  return 1 + static_cast<int>(
                 std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(text.find(what)), '\n'));
}

TEST(MachineFile, ReadsTheDemonstrationMachine) {
  const auto machine = ReadMachineFile(DemoPath());
  ASSERT_TRUE(machine.ok()) << machine.status().ToString();
  EXPECT_EQ(machine->machine_id, "demo-1");
  EXPECT_EQ(machine->value(Parameter::kMainLinkLengthMm), 1200.0);
  EXPECT_DOUBLE_EQ(machine->stiffness_n_per_mm(), 50.0);
  EXPECT_DOUBLE_EQ(machine->covariance(0, 0), 0.0025);
  EXPECT_GE(machine->marks.size(), 12u);
  EXPECT_EQ(machine->hash.size(), 12u);
}

TEST(MachineFile, LaysTheWholeSheetUnderTheWorkingZone) {
  const auto machine = ReadMachineFile(DemoPath());
  ASSERT_TRUE(machine.ok());
  const double length = machine->value(Parameter::kMainLinkLengthMm);
  const double attach = machine->value(Parameter::kAttachLengthMm);
  const double second = machine->value(Parameter::kSecondLinkLengthMm);
  for (const Eigen::Vector2d& head : {Eigen::Vector2d(0.0, 0.0), machine->p_JC_mm()}) {
    for (double x = 0.0; x <= machine->sheet_width_mm; x += 100.0) {
      for (double y = 0.0; y <= machine->sheet_height_mm; y += 100.0) {
        const Eigen::Vector2d p_DE = machine->X_DJ() * head - machine->X_EW() * Eigen::Vector2d(x, y);
        EXPECT_GE(p_DE.y(), 250.0);
        EXPECT_LE(p_DE.y(), 1050.0);
        const double dx = std::sqrt(length * length - p_DE.y() * p_DE.y());
        const double slider_1 = p_DE.x() - dx;
        const double y_attach = p_DE.y() * attach / length;
        const double slider_2 =
            slider_1 + dx * attach / length + std::sqrt(second * second - y_attach * y_attach);
        for (const double slider : {slider_1, slider_2}) {
          EXPECT_GT(slider, machine->actuators[0].position_min_mm);
          EXPECT_LT(slider, machine->actuators[0].position_max_mm);
        }
      }
    }
  }
}

TEST(MachineFile, ReadsBackWhatItWrites) {
  const TemporaryFolder folder;
  auto machine = *ReadMachineFile(DemoPath());
  std::mt19937_64 numbers(11);
  std::normal_distribution<double> normal;
  for (int round = 0; round < 50; ++round) {
    ParameterCovariance root;
    for (double& entry : root.reshaped()) {
      entry = normal(numbers);
    }
    machine.covariance = 1e-4 * root * root.transpose();
    machine.covariance = 0.5 * (machine.covariance + machine.covariance.transpose()).eval();
    machine.value(Parameter::kBaseXMm) += normal(numbers);
    machine.version += 1;
    machine.hash = MachineHash(machine);
    ASSERT_TRUE(WriteMachineFile(folder.File("machine.yaml"), machine).ok());
    const auto read = ReadMachineFile(folder.File("machine.yaml"));
    ASSERT_TRUE(read.ok()) << read.status().ToString();
    EXPECT_EQ(read->parameters, machine.parameters);
    EXPECT_EQ(read->covariance, machine.covariance);
    EXPECT_EQ(read->hash, machine.hash);
    EXPECT_EQ(MachineText(*read), MachineText(machine));
  }
}

TEST(MachineFile, HashIsOfTheContentAndOfNothingElse) {
  auto machine = *ReadMachineFile(DemoPath());
  const std::string hash = machine.hash;
  machine.version = 9;
  machine.machine_id = "other";
  EXPECT_EQ(MachineHash(machine), hash);
  machine.value(Parameter::kCameraYMm) = 1e-12;
  EXPECT_NE(MachineHash(machine), hash);
}

struct BadFile {
  std::string from;
  std::string to;
  std::string reason;
  std::string says;
  int lines_below = 0;  // the fault's line, counted from that of `to`
};
void PrintTo(const BadFile& bad, std::ostream* out) { *out << bad.to; }

class BadMachineFile : public ::testing::TestWithParam<BadFile> {};

TEST_P(BadMachineFile, IsRefusedWithKeyAndLine) {
  const std::string text = Replaced(DemoText(), GetParam().from, GetParam().to);
  const auto machine = ParseMachine(text, "bad.yaml");
  ASSERT_FALSE(machine.ok());
  EXPECT_EQ(TroubleReason(machine.status()), "BAD_MACHINE_FILE");
  const auto violations = TroubleViolations(machine.status());
  ASSERT_FALSE(violations.empty());
  EXPECT_EQ(violations[0].reason, GetParam().reason);
  EXPECT_THAT(violations[0].description, HasSubstr(GetParam().says));
  if (!GetParam().to.empty()) {
    const std::string line =
        "bad.yaml:" + std::to_string(LineOf(text, GetParam().to) + GetParam().lines_below);
    EXPECT_THAT(violations[0].description, HasSubstr(line));
  }
}

INSTANTIATE_TEST_SUITE_P(
    Kinds, BadMachineFile,
    ::testing::Values(
        BadFile{"  feed_mm_per_s: 120", "  fed_mm_per_s: 120", "MISSING", "feed_mm_per_s"},
        BadFile{"  rapid_mm_per_s: 300", "  rapid_mm_per_s: 300\n  rapid_mm_per_s: 300", "DUPLICATE",
                "rapid_mm_per_s", 1},
        BadFile{"control_period_s: 0.001", "control_period_s: fast", "WRONG_VALUE", "finite number in s"},
        BadFile{"  kerf_width_mm: 0.8", "  kerf_width_mm: .nan", "WRONG_VALUE", "finite number in mm"},
        BadFile{"  kerf_width_mm: 0.8", "  kerf_width_mm: -0.8", "WRONG_VALUE",
                "is -0.8 mm; right is a finite number, 0"},
        BadFile{"working_mode: {s1: 1,", "working_mode: {s1: 2,", "WRONG_VALUE", "from -1 to 1"},
        BadFile{"working_mode: {s1: 1,", "working_mode: {s1: 0,", "WRONG_VALUE", "working_mode.s1 is 0"},
        BadFile{"{value: 600, sigma: 0.05}", "{value: 600, sigma: -1}", "WRONG_VALUE",
                "attach_length_mm.sigma"},
        BadFile{"{value: 600, sigma: 0.05}", "{value: -600, sigma: 0.05}", "WRONG_VALUE", "-600 mm"},
        BadFile{"- {id: 16, x_W_mm: 60", "- {id: 3, x_W_mm: 60", "DUPLICATE", "another mark"},
        BadFile{"- {id: 16, x_W_mm: 60", "- {id: 16, x_W_mm: 6000", "WRONG_VALUE", "not on the sheet"},
        BadFile{"machine_id: demo-1", "machine_id: Demo 1", "WRONG_VALUE", "machine_id"},
        BadFile{"machine_id: demo-1", "extra: 1\nmachine_id: demo-1", "UNKNOWN_KEY", "extra"},
        BadFile{"machine_id: demo-1", "machine_id: [", "NOT_YAML", "not YAML", 2}));

TEST(MachineFile, RefusesACovarianceThatIsNone) {
  auto machine = *ReadMachineFile(DemoPath());
  machine.covariance(0, 1) = machine.covariance(1, 0) = 1.0;  // far beyond both variances
  const auto read = ParseMachine(MachineText(machine), "bad.yaml");
  ASSERT_FALSE(read.ok());
  EXPECT_THAT(std::string(read.status().message()), HasSubstr("no negative eigenvalue"));
}

TEST(MachineFile, NamesTheFileThatIsNotThere) {
  EXPECT_EQ(TroubleReason(ReadMachineFile("/no/such/machine.yaml").status()), "NO_SUCH_FILE");
  EXPECT_EQ(TroubleReason(ReadMachineFile("/tmp").status()), "NOT_A_FILE");
}

}  // namespace
}  // namespace lambdajet::test
