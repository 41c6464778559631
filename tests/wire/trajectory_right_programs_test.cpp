// What right programs mean: each of the corpus gives the motions of the plain program that says the same in G0 to G3, and
// no rewriting that RS-274/NGC allows (units, distance mode, spaces, numbers, comments, loops) changes what is done.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "tests/laws/trajectory_cases.hpp"
#include "trajectory/core/feed/plan_program.hpp"
#include "trajectory/core/part_program/gcode_reader.hpp"
#include "trajectory/core/part_program/gcode_writer.hpp"

namespace lambdajet::trajectory {
namespace {

constexpr double kSame = 1e-9;

std::filesystem::path RightPrograms() {
  return std::filesystem::path(std::getenv("LAMBDAJET_SOURCE_DIR")) / "tests/wire/right_programs";
}

std::string Content(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  EXPECT_TRUE(file.good()) << path;
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

bool Modal(OperationKind kind) {
  return kind == OperationKind::kFeedChange || kind == OperationKind::kUnitsChange ||
         kind == OperationKind::kDistanceChange || kind == OperationKind::kWorkOffsetChange;
}

// What is done, without the modes that only a reader knows.
std::vector<Operation> Done(const std::string& text, std::uint8_t axes = kPlanarAxes) {
  GcodeOptions options;
  options.axes = axes;
  options.kerf_width_mm = 0.8;
  PartProgram program = ReadGcode(text, options);
  for (const ProgramFault& f : program.faults) {
    ADD_FAILURE() << f.line << ":" << f.column << " " << f.reason << " " << f.word << " " << f.message;
  }
  std::erase_if(program.operations, [](const Operation& o) { return Modal(o.kind); });
  return std::move(program.operations);
}

void ExpectSame(const std::vector<Operation>& got, const std::vector<Operation>& wanted) {
  ASSERT_EQ(got.size(), wanted.size());
  for (std::size_t i = 0; i < got.size(); ++i) {
    SCOPED_TRACE(FormatOperation(got[i]) + "\n   wanted " + FormatOperation(wanted[i]));
    const Operation &a = got[i], &b = wanted[i];
    ASSERT_EQ(a.kind, b.kind);
    const bool motion = a.kind == OperationKind::kTraverse || a.kind == OperationKind::kFeedLine ||
                        a.kind == OperationKind::kFeedArc;
    EXPECT_NEAR(a.x_W_mm, b.x_W_mm, kSame);
    EXPECT_NEAR(a.y_W_mm, b.y_W_mm, kSame);
    EXPECT_NEAR(a.z_W_mm, b.z_W_mm, kSame);
    EXPECT_NEAR(a.a_rad, b.a_rad, kSame);
    EXPECT_NEAR(a.b_rad, b.b_rad, kSame);
    EXPECT_NEAR(a.c_rad, b.c_rad, kSame);
    EXPECT_NEAR(a.value, b.value, kSame);
    EXPECT_NEAR(a.kerf_offset_mm, b.kerf_offset_mm, kSame);
    EXPECT_EQ(a.condition, b.condition);
    if (a.kind == OperationKind::kFeedArc) {
      EXPECT_EQ(a.plane, b.plane);
      EXPECT_NEAR(a.center_x_W_mm, b.center_x_W_mm, kSame);
      EXPECT_NEAR(a.center_y_W_mm, b.center_y_W_mm, kSame);
      EXPECT_NEAR(a.center_z_W_mm, b.center_z_W_mm, kSame);
      EXPECT_NEAR(a.sweep_rad, b.sweep_rad, kSame);
    }
    if (motion && a.kind != OperationKind::kTraverse) {
      EXPECT_NEAR(a.feed_mm_per_s, b.feed_mm_per_s, kSame);
    }
  }
}

TEST(RightPrograms, MeanWhatTheirPlainTextSays) {
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(RightPrograms())) {
    const std::string name = entry.path().filename().string();
    if (name.ends_with(".means.ngc") || !name.ends_with(".ngc")) {
      continue;
    }
    SCOPED_TRACE(name);
    const std::uint8_t axes = name.starts_with("six_") ? kSixAxes : kPlanarAxes;
    std::filesystem::path means = entry.path();
    means.replace_extension(".means.ngc");
    ExpectSame(Done(Content(entry.path()), axes), Done(Content(means), axes));
    ++count;
  }
  EXPECT_GE(count, 80);
}

TEST(RightPrograms, AreListedOneOperationALine) {
  const std::string text =
      "G21 G90\nG0 X10 Y0 (there)\nM3 P0.5\nG93 G3 X0 Y10 I-10 F2\nG94 G1 X5 F600\nG4 P1\nM5\nM2\n";
  std::string list;
  for (const Operation& o : ReadGcode(text).operations) {
    list += FormatOperation(o) + "\n";
  }
  EXPECT_EQ(
      list,
      "1 UNITS_CHANGE unit_mm=1\n1 DISTANCE_CHANGE g=90\n2 TRAVERSE x_mm=10 y_mm=0\n3 PIERCE time_s=0.5\n"
      "4 FEED_ARC x_mm=0 y_mm=10 center_x_mm=0 center_y_mm=0 sweep_rad=1.57079633 feed_mm_per_s=0.523598776\n"
      "5 FEED_CHANGE feed_mm_per_s=10\n5 FEED_LINE x_mm=5 y_mm=10 feed_mm_per_s=10\n6 DWELL time_s=1\n"
      "7 ABRASIVE_OFF\n7 JET_OFF\n8 END\n");
}

// What the list says of tools, with the jet and with a spindle.
std::string Switched(const std::string& text, std::uint8_t axes) {
  std::string list;
  for (const Operation& o : Done(text, axes)) {
    if (o.kind != OperationKind::kTraverse && o.kind != OperationKind::kFeedLine) {
      list += FormatOperation(o) + "\n";
    }
  }
  return list;
}

TEST(RightPrograms, StandStillForAnotherTool) {
  // Nothing is mounted at first; T alone only selects; the mounted tool is not asked for again; T0 takes it off.
  EXPECT_EQ(Switched("T1 M6\nT2\nM6\nM6\nT2 M6\nT0 M6\nM2\n", kPlanarAxes),
            "1 TOOL_CHANGE tool=1\n3 TOOL_CHANGE tool=2\n6 TOOL_CHANGE tool=0\n7 END\n");
  EXPECT_EQ(Switched("T0 M6\nM61 Q3\nT3 M6\nM2\n", kPlanarAxes), "2 TOOL_NUMBER tool=3\n4 END\n");
  // The jet and the spindle go off, before a pierce of the same line.
  EXPECT_EQ(Switched("F600\nM3 P1\nG1 X1\nM6 T5 M3 P2\nM6\nM2\n", kPlanarAxes),
            "2 PIERCE time_s=1\n4 ABRASIVE_OFF\n4 JET_OFF\n4 TOOL_CHANGE tool=5\n4 PIERCE time_s=2\n"
            "5 ABRASIVE_OFF\n5 JET_OFF\n6 END\n");
  EXPECT_EQ(Switched("S900 M3\nM8\nT5 M6\nM2\n", kSixAxes),
            "1 SPINDLE_ON speed_per_min=900\n2 COOLANT_ON\n3 SPINDLE_OFF\n3 TOOL_CHANGE tool=5\n"
            "4 COOLANT_OFF\n4 END\n");
  // G41 and G43 take the mounted tool's row, as #5400 and #5410 do.
  const std::vector<Operation> kerf =
      Done("G10 L1 P4 R0.3\nT4 M6\nG41\nG1 X#5400 Y[#5410*10+#<_current_tool>] F600\nG40 X0\nM2\n");
  EXPECT_NEAR(kerf[1].kerf_offset_mm, 0.3, kSame);
  EXPECT_NEAR(kerf[1].x_W_mm, 4.0, kSame);
  EXPECT_NEAR(kerf[1].y_W_mm, 10.0, kSame);
  EXPECT_NEAR(Done("G41\nG1 X9 F600\nG40 X0\nM2\n")[0].kerf_offset_mm, 0.4, kSame);
  EXPECT_NEAR(Done("G10 L1 P4 Z7\nT4 M6\nG43\nG0 Z1\nM2\n", kSixAxes)[1].z_W_mm, 8.0, kSame);
}

// The same gate as M0's, with the jet off before it.
TEST(RightPrograms, AToolChangeIsAStopOfThePlan) {
  const Plan plan = PlanPartProgram(
                        "G21 G90\nT1 M6\nG0 X100 Y100\nM3\nG1 X120 F600\nT2 M6\nG0 X130\nM3\nG1 X140\nM5\n"
                        "T2 M6\nM2\n",
                        DemoLikeMachine(), {})
                        .plan;
  ASSERT_FALSE(plan.segments.empty());
  std::vector<std::uint32_t> stops;
  for (const Gate& gate : plan.gates) {
    if (gate.kind == GateKind::kStop) {
      stops.push_back(gate.source_line);
    }
  }
  EXPECT_EQ(stops, (std::vector<std::uint32_t>{2, 6}));
  EXPECT_EQ(plan.gates.size(), 4u);
  EXPECT_EQ(std::count_if(plan.events.begin(), plan.events.end(),
                          [](const ProcessEvent& e) { return e.action == ProcessAction::kJetOff; }),
            2);
}

// Written and read again, nothing changes; a kerf that ends before the change ends there too.
TEST(RightPrograms, ToolsAreWrittenAsTheyAreRead) {
  const std::vector<Operation> done = Done(
      "T1 M6\nF600\nG0 X9\nM3\nG41.1 D0.8\nG1 X20\nX30\nG40 X40\nM61 Q2\nT3 M6\nG0 X50\nM3\n"
      "G41.1 D0.8 G1 X60\nX70\nM5\nG40\nT0 M6\nG0 X1\nM2\n");
  const std::string text = WriteGcode(done, "tools");
  ExpectSame(Done(text), done);
  EXPECT_EQ(WriteGcode(Done(text), "tools"), text);
}

TEST(RightPrograms, TurnAsOftenAsPSays) {
  const std::vector<Operation> done = Done("G0 X10\nG3 X-10 I-10 P3 F600\nG2 I10 P2\nM2\n");
  EXPECT_NEAR(done[1].sweep_rad, 5 * M_PI, kSame);
  EXPECT_NEAR(done[2].sweep_rad, -4 * M_PI, kSame);
}

// ---- rewriting that changes nothing, on random programs ----

std::vector<std::string> Lines(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) {
    lines.push_back(line);
  }
  return lines;
}

std::string Number(double value) {
  char text[48];
  std::snprintf(text, sizeof text, "%.15f", value);
  return text;
}

// The plain program that does these operations, written by whoever chooses the words.
template <class Coordinate>
std::string Written(const std::vector<Operation>& operations, const std::string& head, double unit_mm,
                    Coordinate coordinate) {
  std::string text = head + "\n";
  double x = 0.0, y = 0.0;
  for (const Operation& o : operations) {
    const auto end = [&] { return " X" + coordinate(x, o.x_W_mm) + " Y" + coordinate(y, o.y_W_mm); };
    const std::string feed = " F" + Number(60.0 * o.feed_mm_per_s / unit_mm);
    switch (o.kind) {
      case OperationKind::kTraverse:
        text += "G0" + end() + "\n";
        break;
      case OperationKind::kFeedLine:
        text += "G1" + end() + feed + "\n";
        break;
      case OperationKind::kFeedArc:
        text += (o.sweep_rad > 0.0 ? "G3" : "G2") + end() + " I" + Number((o.center_x_W_mm - x) / unit_mm) +
                " J" + Number((o.center_y_W_mm - y) / unit_mm) + feed + "\n";
        break;
      case OperationKind::kPierce:
        text += "M3 P" + Number(o.value) + "\n";
        break;
      case OperationKind::kJetOff:
        text += "M5\n";
        break;
      default:
        break;
    }
    x = o.x_W_mm, y = o.y_W_mm;
  }
  return text + "M2\n";
}

TEST(RightPrograms, DoNotChangeWithUnitsAndDistanceMode) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    const std::vector<Operation> plain = Done(RandomProgram(seed).Make());
    const auto absolute = [](double, double to) { return Number(to); };
    const auto inch = [](double, double to) { return Number(to / 25.4); };
    const auto relative = [](double from, double to) { return Number(to - from); };
    const auto near = [&plain](const std::vector<Operation>& other) {
      ASSERT_EQ(other.size(), plain.size());
      for (std::size_t i = 0; i < plain.size(); ++i) {
        ASSERT_EQ(other[i].kind, plain[i].kind);
        EXPECT_NEAR(other[i].x_W_mm, plain[i].x_W_mm, 1e-7);
        EXPECT_NEAR(other[i].y_W_mm, plain[i].y_W_mm, 1e-7);
        EXPECT_NEAR(other[i].sweep_rad, plain[i].sweep_rad, 1e-5);
        EXPECT_NEAR(other[i].feed_mm_per_s, plain[i].feed_mm_per_s, 1e-9);
      }
    };
    near(Done(Written(plain, "G21 G90", 1.0, absolute)));
    near(Done(Written(plain, "G20 G90", 25.4, inch)));
    near(Done(Written(plain, "G21 G91", 1.0, relative)));
  }
}

// Line numbers, comments, small letters, spaces within numbers, block delete that is empty, CR/LF.
std::string Disguised(const std::string& line, std::mt19937& random) {
  std::string text = "N" + std::to_string(random() % 1000) + " (part " + std::to_string(random() % 9) + ")";
  for (const char c : line) {
    if (random() % 4 == 0) {
      text += random() % 2 == 0 ? ' ' : '\t';
    }
    text += random() % 2 == 0 ? static_cast<char>(std::tolower(c)) : c;
  }
  return text + (random() % 2 == 0 ? " ; end of line\r\n" : "(end)\n/ G77 not read\n");
}

TEST(RightPrograms, DoNotChangeWithNumbersCommentsAndSpaces) {
  std::mt19937 random(7);
  for (unsigned seed = 0; seed < 20; ++seed) {
    const std::string text = RandomProgram(seed).Make();
    std::string disguised;
    for (const std::string& line : Lines(text)) {
      disguised += Disguised(line, random);
    }
    ExpectSame(Done(disguised), Done(text));
  }
}

TEST(RightPrograms, LoopEqualsItsUnrolledText) {
  std::mt19937 random(11);
  for (int i = 0; i < 20; ++i) {
    const int outer = 1 + static_cast<int>(random() % 4), inner = 1 + static_cast<int>(random() % 5);
    const std::string body = "G91 G0 X" + std::to_string(random() % 9) + "\nG1 Y[#1*2+#2] F600\n";
    std::string unrolled;
    for (int a = 0; a < outer; ++a) {
      for (int b = 0; b < inner; ++b) {
        std::string turn = body;
        turn.replace(turn.find("[#1*2+#2]"), 9, std::to_string(a * 2 + b));
        unrolled += turn;
      }
    }
    const std::string m = std::to_string(outer), n = std::to_string(inner);
    const std::string nested = "#1=0\no1 while [#1 LT " + m + "]\n#2=0\no2 do\n" + body +
                               "#2=[#2+1]\no2 while [#2 LT " + n + "]\n#1=[#1+1]\no1 endwhile\nM2\n";
    const std::string called =
        "o5 sub\n" + body + "o5 endsub\n#31=0\no1 repeat [" + m + "]\n#32=0\no2 repeat [" + n +
        "]\no5 call [#31] [#32]\n#32=[#32+1]\no2 endrepeat\n#31=[#31+1]\no1 endrepeat\nM2\n";
    ExpectSame(Done(nested), Done(unrolled + "M2\n"));
    ExpectSame(Done(called), Done(unrolled + "M2\n"));
  }
}

// ---- splines ----

struct Place {
  double x = 0.0, y = 0.0;
};

double DistanceToPiece(const Place& p, const Place& from, const Operation& o) {
  const double dx = o.x_W_mm - from.x, dy = o.y_W_mm - from.y;
  if (o.kind == OperationKind::kFeedLine) {
    const double l2 = dx * dx + dy * dy;
    const double t = l2 > 0 ? std::clamp(((p.x - from.x) * dx + (p.y - from.y) * dy) / l2, 0.0, 1.0) : 0.0;
    return std::hypot(p.x - from.x - t * dx, p.y - from.y - t * dy);
  }
  const double cx = o.center_x_W_mm, cy = o.center_y_W_mm;
  const double begin = std::atan2(from.y - cy, from.x - cx);
  double turn = std::atan2(p.y - cy, p.x - cx) - begin;
  turn = o.sweep_rad > 0 ? std::fmod(turn + 20 * M_PI, 2 * M_PI) : -std::fmod(20 * M_PI - turn, 2 * M_PI);
  if (std::abs(turn) <= std::abs(o.sweep_rad)) {
    return std::abs(std::hypot(p.x - cx, p.y - cy) - std::hypot(from.x - cx, from.y - cy));
  }
  return std::min(std::hypot(p.x - from.x, p.y - from.y), std::hypot(p.x - o.x_W_mm, p.y - o.y_W_mm));
}

TEST(RightPrograms, SplinesStayWithinAHundredthOfTheTolerance) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> place(-40.0, 40.0);
  for (int i = 0; i < 200; ++i) {
    double c[6];
    for (double& v : c) {
      v = std::round(1000.0 * place(random)) / 1000.0;
    }
    const std::vector<Operation> done =
        Done("G5 I" + Number(c[0]) + " J" + Number(c[1]) + " P" + Number(c[2]) + " Q" + Number(c[3]) + " X" +
             Number(c[4]) + " Y" + Number(c[5]) + " F600\nM2\n");
    double worst = 0.0;
    for (int k = 0; k <= 500; ++k) {
      const double t = k / 500.0, u = 1 - t;
      const Place p{3 * u * u * t * c[0] + 3 * u * t * t * (c[4] + c[2]) + t * t * t * c[4],
                    3 * u * u * t * c[1] + 3 * u * t * t * (c[5] + c[3]) + t * t * t * c[5]};
      double nearest = 1e9;
      Place from;
      for (const Operation& o : done) {
        if (o.kind != OperationKind::kEnd) {
          nearest = std::min(nearest, DistanceToPiece(p, from, o));
        }
        from = {o.x_W_mm, o.y_W_mm};
      }
      worst = std::max(worst, nearest);
    }
    EXPECT_LE(worst, 1.5 * 0.01 * 0.02) << i;
    EXPECT_LE(done.size(), 600u) << i;
    EXPECT_NEAR(done[done.size() - 2].x_W_mm, c[4], 1e-12);
    EXPECT_NEAR(done[done.size() - 2].y_W_mm, c[5], 1e-12);
  }
}

// Z words of a flat program are read over where that is allowed, and refused elsewhere.
TEST(RightPrograms, LeaveOutZWhenTold) {
  GcodeOptions options;
  options.leave_out_z = true;
  const PartProgram program =
      ReadGcode("T1 M6\nG0 Z5\nG0 X10 Z5\nM3 S12000\nG1 Z-3 F100\nG43 H1\nX20\nM2\n", options);
  ASSERT_TRUE(program.faults.empty());
  std::size_t motions = 0;
  for (const Operation& o : program.operations) {
    motions += o.kind == OperationKind::kTraverse || o.kind == OperationKind::kFeedLine;
    EXPECT_EQ(o.z_W_mm, 0.0);
  }
  EXPECT_EQ(motions, 2u);
}

// Many lines are read (ten million by `benchmark_trajectory long`); one operation too many is refused.
TEST(RightPrograms, MayBeLong) {
  std::string text = "G1 F600\n";
  for (int i = 0; i < 300'000; ++i) {
    text += i % 2 == 0 ? "X1\n" : "X2\n";
  }
  GcodeOptions options;
  EXPECT_EQ(ReadGcode(text + "M2\n", options).operations.size(), 300'002u);
  options.operation_limit = 100'000;
  const PartProgram refused = ReadGcode(text + "M2\n", options);
  ASSERT_EQ(refused.faults.size(), 1u);
  EXPECT_EQ(refused.faults.front().reason, "PROGRAM_TOO_LONG");
}

}  // namespace
}  // namespace lambdajet::trajectory
