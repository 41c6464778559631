// What LinuxCNC's own interpreter makes of programs and lines, beside what this reader does: golden files written by
// tests/long/linuxcnc from Debian's rs274.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <sstream>
#include <string>
#include <vector>

#include "trajectory/core/part_program/gcode_reader.hpp"

namespace lambdajet::trajectory {
namespace {

constexpr double kDegreesARadian = 180.0 / std::numbers::pi;

std::filesystem::path GoldenFolder() {
  return std::filesystem::path(std::getenv("LAMBDAJET_SOURCE_DIR")) / "tests/wire/linuxcnc";
}

std::vector<std::string> GoldenLines(const std::filesystem::path& path) {
  std::ifstream file(path);
  EXPECT_TRUE(file.good()) << path;
  std::vector<std::string> lines;
  for (std::string line; std::getline(file, line);) {
    lines.push_back(line);
  }
  return lines;
}

std::string GoldenText(const std::filesystem::path& path) {
  std::ifstream file(path);
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

PartProgram ReadFor(const std::string& text, std::uint8_t axes) {
  GcodeOptions options;
  options.axes = axes;
  options.kerf_width_mm = 0.8;
  return ReadGcode(text, options);
}

std::vector<double> EndInDegrees(const Operation& o) {
  return {o.x_W_mm,
          o.y_W_mm,
          o.z_W_mm,
          o.a_rad * kDegreesARadian,
          o.b_rad * kDegreesARadian,
          o.c_rad * kDegreesARadian};
}

// Motions and dwells, without moves that go nowhere: LinuxCNC tells of those, too, and the golden files do not.
std::vector<Operation> MotionsOf(const PartProgram& program, double nowhere_mm) {
  std::vector<Operation> kept;
  std::vector<double> at(6, 0.0);
  for (const Operation& o : program.operations) {
    const bool straight = o.kind == OperationKind::kTraverse || o.kind == OperationKind::kFeedLine;
    if (!straight && o.kind != OperationKind::kFeedArc && o.kind != OperationKind::kDwell) {
      continue;
    }
    const std::vector<double> end = EndInDegrees(o);
    double way = 0.0;
    for (std::size_t i = 0; i < end.size(); ++i) {
      way = std::max(way, std::abs(end[i] - at[i]));
    }
    if (o.kind != OperationKind::kDwell) {
      at = straight && way < nowhere_mm ? at : end;
    }
    if (!straight || way >= nowhere_mm) {
      kept.push_back(o);
    }
  }
  return kept;
}

// One line of a golden file beside one operation; lengths in millimetres and degrees, to `to`.
class Golden {
 public:
  Golden(const std::string& line, double to) : words_(line), to_(to) { words_ >> kind_; }

  void ExpectSame(const Operation& o) {
    if (o.kind == OperationKind::kDwell) {
      ASSERT_EQ(kind_, "DWELL");
      EXPECT_NEAR(o.value, Number(), 1e-3);
      return;
    }
    ASSERT_EQ(kind_, o.kind == OperationKind::kTraverse   ? "TRAVERSE"
                     : o.kind == OperationKind::kFeedLine ? "LINE"
                                                          : "ARC");
    for (const double coordinate : EndInDegrees(o)) {
      EXPECT_NEAR(coordinate, Number(), to_);
    }
    if (o.kind != OperationKind::kTraverse) {
      const double feed = Number();
      if (o.feed_mm_per_s > 0.0) {  // else it is told as a duration
        EXPECT_NEAR(o.feed_mm_per_s, feed, 1e-4 * feed + 50.0 * to_);
      }
    }
    if (o.kind == OperationKind::kFeedArc) {
      Arc(o);
    }
  }

 private:
  double Number() {
    double value = NAN;
    words_ >> value;
    return value;
  }

  // Where the written centre lies a little nearer to one end, the reader's lies between both.
  void Arc(const Operation& o) {
    const double center[] = {o.center_x_W_mm, o.center_y_W_mm, o.center_z_W_mm};
    double written[3];
    std::string plane;
    int turns = 0;
    words_ >> written[0] >> written[1] >> written[2] >> plane >> turns;
    EXPECT_EQ(plane, o.plane == ArcPlane::kXy ? "XY" : o.plane == ArcPlane::kZx ? "XZ" : "YZ");
    const std::size_t along = o.plane == ArcPlane::kXy ? 2 : o.plane == ArcPlane::kZx ? 1 : 0;
    const std::vector<double> end = EndInDegrees(o);
    double radius = 0.0;
    for (std::size_t i = 0; i < 3; ++i) {
      radius = i == along ? radius : std::hypot(radius, end[i] - written[i]);
    }
    for (std::size_t i = 0; i < 3; ++i) {
      if (i != along) {
        EXPECT_NEAR(center[i], written[i], 2.0 * to_ + 3e-3 * radius);
      }
    }
    const double full = std::ceil(std::abs(o.sweep_rad) / (2.0 * std::numbers::pi) - 1e-4);
    EXPECT_EQ(turns, std::copysign(full, o.sweep_rad));
  }

  std::istringstream words_;
  double to_;
  std::string kind_;
};

TEST(LinuxCnc, MakesTheSameMotionsOfAProgram) {
  int programs = 0;
  for (const auto& entry : std::filesystem::directory_iterator(GoldenFolder())) {
    if (entry.path().extension() != ".canon") {
      continue;
    }
    SCOPED_TRACE(entry.path().filename());
    const std::vector<std::string> golden = GoldenLines(entry.path());
    const double to = std::stod(golden.at(0).substr(golden[0].rfind(" to ") + 4));
    const std::string program = GoldenText(std::filesystem::path(entry.path()).replace_extension(".ngc"));
    const bool sheet = entry.path().filename().string().starts_with("xy");
    const PartProgram read = ReadFor(program, sheet ? kPlanarAxes : kSixAxes);
    ASSERT_TRUE(read.faults.empty()) << read.faults[0].line << " " << read.faults[0].reason;
    const std::vector<Operation> motions = MotionsOf(read, 0.51 * to);
    ASSERT_EQ(motions.size() + 1, golden.size());
    for (std::size_t i = 0; i < motions.size(); ++i) {
      SCOPED_TRACE(FormatOperation(motions[i]) + "\n   LinuxCNC " + golden[i + 1]);
      Golden(golden[i + 1], to).ExpectSame(motions[i]);
    }
    ++programs;
  }
  EXPECT_GE(programs, 60);
}

// Where the verdicts differ, the table says why.
TEST(LinuxCnc, AcceptsAndRefusesTheSameLines) {
  const std::vector<std::string> rows = GoldenLines(GoldenFolder() / "lines.tsv");
  int differ = 0;
  for (std::size_t i = 1; i < rows.size(); ++i) {
    std::istringstream row(rows[i]);
    std::string line, linuxcnc, expected, why;
    std::getline(row, line, '\t');
    std::getline(row, linuxcnc, '\t');
    std::getline(row, expected, '\t');
    std::getline(row, why);
    SCOPED_TRACE(line);
    const PartProgram read = ReadFor(
        "G21 G90 G17\nF1200\nG0 X11 Y20\nG1 X10.5\nG1 X11\n#31=1\n#32=2\n" + line + "\nG1 X20 Y21\nM2\n",
        kPlanarAxes);
    EXPECT_EQ(read.faults.empty() ? "good" : read.faults[0].reason, expected);
    const bool same = (linuxcnc == "good") == (expected == "good");
    EXPECT_EQ(why.empty(), same);
    differ += same ? 0 : 1;
  }
  EXPECT_GE(rows.size(), 400u);
  EXPECT_LE(differ, 50);
}

}  // namespace
}  // namespace lambdajet::trajectory
