// CLDATA and G-code in and out: writing what was read changes nothing, and a program in G-code makes the same motions as its
// CLDATA.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <numbers>
#include <random>
#include <sstream>

#include "trajectory/core/part_program/cldata_writer.hpp"
#include "trajectory/core/part_program/gcode_writer.hpp"
#include "trajectory/core/part_program/read_program.hpp"

namespace lambdajet::trajectory {
namespace {

constexpr double kPi = std::numbers::pi;

std::string Shipped(const std::string& name) {
  std::ifstream file(std::string(std::getenv("LAMBDAJET_SOURCE_DIR")) + "/deploy/parts/" + name);
  std::stringstream text;
  text << file.rdbuf();
  EXPECT_FALSE(text.str().empty()) << name;
  return text.str();
}

bool Moves(const Operation& o) {
  return o.kind == OperationKind::kTraverse || o.kind == OperationKind::kFeedLine ||
         o.kind == OperationKind::kFeedArc;
}

// Modes of G-code that CLDATA has no word for, and changes of feed that the motions carry themselves.
bool Compared(const Operation& o) {
  return o.kind != OperationKind::kUnitsChange && o.kind != OperationKind::kDistanceChange &&
         o.kind != OperationKind::kWorkOffsetChange && o.kind != OperationKind::kFeedChange;
}

void ExpectSame(const std::vector<Operation>& a, const std::vector<Operation>& b, double tolerance) {
  std::vector<Operation> p, q;
  std::copy_if(a.begin(), a.end(), std::back_inserter(p), Compared);
  std::copy_if(b.begin(), b.end(), std::back_inserter(q), Compared);
  ASSERT_EQ(p.size(), q.size());
  for (std::size_t i = 0; i < p.size(); ++i) {
    SCOPED_TRACE(FormatOperation(p[i]) + " | " + FormatOperation(q[i]));
    ASSERT_EQ(p[i].kind, q[i].kind);
    ASSERT_NEAR(p[i].x_W_mm, q[i].x_W_mm, tolerance);
    ASSERT_NEAR(p[i].y_W_mm, q[i].y_W_mm, tolerance);
    ASSERT_NEAR(p[i].z_W_mm, q[i].z_W_mm, tolerance);
    ASSERT_NEAR(std::sin(p[i].b_rad), std::sin(q[i].b_rad), 1e-11);
    ASSERT_NEAR(std::cos(p[i].b_rad) * std::sin(p[i].a_rad - q[i].a_rad), 0.0, 1e-11);
    if (Moves(p[i])) {
      ASSERT_NEAR(p[i].kerf_offset_mm, q[i].kerf_offset_mm, tolerance);
    }
    if (p[i].kind == OperationKind::kFeedArc) {
      ASSERT_EQ(p[i].plane, q[i].plane);
      ASSERT_NEAR(p[i].center_x_W_mm, q[i].center_x_W_mm, tolerance);
      ASSERT_NEAR(p[i].center_y_W_mm, q[i].center_y_W_mm, tolerance);
      const double radius = std::hypot(p[i].x_W_mm - p[i].center_x_W_mm, p[i].y_W_mm - p[i].center_y_W_mm,
                                       p[i].z_W_mm - p[i].center_z_W_mm);
      ASSERT_NEAR(p[i].sweep_rad * radius, q[i].sweep_rad * radius, 1e3 * tolerance);
    }
    if (Moves(p[i]) && p[i].kind != OperationKind::kTraverse) {
      ASSERT_NEAR(p[i].feed_mm_per_s, q[i].feed_mm_per_s, 1e-10 * p[i].feed_mm_per_s);
    }
    if (!Moves(p[i])) {
      ASSERT_EQ(p[i].value, q[i].value);
    }
  }
}

void ExpectFixedPoint(const std::string& program, const ReadOptions& options) {
  const PartProgram first = ReadPartProgram(program, options);
  ASSERT_TRUE(first.faults.empty()) << first.faults[0].line << " " << first.faults[0].reason
                                    << first.faults[0].message;
  const CldataText once = WriteCldata(first.operations, "part");
  ASSERT_TRUE(once.faults.empty());
  ReadOptions cldata = options;
  cldata.notation = ProgramNotation::kByContent;
  const PartProgram second = ReadPartProgram(once.text, cldata);
  ASSERT_TRUE(second.faults.empty()) << second.faults[0].line << " " << second.faults[0].message << "\n"
                                     << once.text;
  EXPECT_EQ(WriteCldata(second.operations, "part").text, once.text);
  ExpectSame(first.operations, second.operations, 1e-9);
}

TEST(CldataLaw, ShippedPartsMakeTheSameMotions) {
  for (const char* part :
       {"bracket.ngc", "flange.ngc", "gear.ngc", "nest.ngc", "sharp_plate.ngc", "slender.ngc"}) {
    SCOPED_TRACE(part);
    ExpectFixedPoint(Shipped(part), {});
  }
}

class Draw {
 public:
  explicit Draw(unsigned seed) : random_(seed) {}
  double In(double from, double to) { return std::uniform_real_distribution<>(from, to)(random_); }
  int Of(int count) { return static_cast<int>(random_() % static_cast<unsigned>(count)); }

 private:
  std::mt19937_64 random_;
};

Operation At(OperationKind kind, double x, double y, double feed) {
  Operation o;
  o.kind = kind;
  o.x_W_mm = x;
  o.y_W_mm = y;
  o.feed_mm_per_s = feed;
  return o;
}

// Lines, chords of arcs just cut, arcs of up to three turns, both ways.
std::vector<Operation> RandomPlanar(Draw& draw) {
  double x = draw.In(0, 500), y = draw.In(0, 500);
  std::vector<Operation> list = {At(OperationKind::kTraverse, x, y, 0)};
  double kerf = 0.0;
  for (int i = 0; i < 40; ++i) {
    const double feed = draw.In(1, 200);
    if (draw.Of(8) == 0) {
      kerf = draw.In(-1, 1);
    }
    Operation o;
    if (draw.Of(3) == 0) {
      o = At(OperationKind::kFeedLine, draw.In(0, 500), draw.In(0, 500), feed);
    } else {
      const double radius = draw.In(0.1, 200), angle = draw.In(-kPi, kPi);
      const double sweep = (draw.Of(2) == 0 ? 1 : -1) * (draw.Of(5) == 0 ? 2 * kPi : draw.In(1e-3, 6 * kPi));
      const double cx = x - radius * std::cos(angle), cy = y - radius * std::sin(angle);
      o = At(OperationKind::kFeedArc, cx + radius * std::cos(angle + sweep),
             cy + radius * std::sin(angle + sweep), feed);
      if (std::abs(std::abs(sweep) - 2 * kPi) < 1e-12) {
        o.x_W_mm = x;
        o.y_W_mm = y;
      }
      o.center_x_W_mm = cx;
      o.center_y_W_mm = cy;
      o.sweep_rad = sweep;
      if (draw.Of(3) == 0) {  // then the chord, at the same feed
        o.kerf_offset_mm = kerf;
        list.push_back(o);
        const double to = angle + sweep + draw.In(0.1, 3.0);
        o = At(OperationKind::kFeedLine, cx + radius * std::cos(to), cy + radius * std::sin(to), feed);
      }
    }
    o.kerf_offset_mm = kerf;
    list.push_back(o);
    x = o.x_W_mm;
    y = o.y_W_mm;
  }
  list.push_back(At(OperationKind::kEnd, x, y, 0));
  return list;
}

TEST(CldataLaw, RandomPlanarProgramsComeBack) {
  for (unsigned seed = 1; seed <= 300; ++seed) {
    SCOPED_TRACE(seed);
    Draw draw(seed);
    const std::vector<Operation> list = RandomPlanar(draw);
    const CldataText text = WriteCldata(list, "random");
    ASSERT_TRUE(text.faults.empty());
    const PartProgram read = ReadCldata(text.text);
    ASSERT_TRUE(read.faults.empty()) << read.faults[0].line << " " << read.faults[0].message << "\n"
                                     << text.text;
    ExpectSame(list, read.operations, 1e-9);
    ExpectFixedPoint(text.text, {});
    if (HasFatalFailure()) {
      return;
    }
  }
}

// As ExpectSame, and the turns of all three axes.
void ExpectSameInSixAxes(const std::vector<Operation>& a, const std::vector<Operation>& b) {
  ExpectSame(a, b, 1e-9);
  std::vector<Operation> p, q;
  std::copy_if(a.begin(), a.end(), std::back_inserter(p), Moves);
  std::copy_if(b.begin(), b.end(), std::back_inserter(q), Moves);
  ASSERT_EQ(p.size(), q.size());
  for (std::size_t i = 0; i < p.size(); ++i) {
    SCOPED_TRACE(FormatOperation(p[i]) + " | " + FormatOperation(q[i]));
    ASSERT_NEAR(p[i].a_rad, q[i].a_rad, 1e-9);
    ASSERT_NEAR(p[i].b_rad, q[i].b_rad, 1e-9);
    ASSERT_NEAR(p[i].c_rad, q[i].c_rad, 1e-9);
    ASSERT_NEAR(p[i].center_z_W_mm, q[i].center_z_W_mm, p[i].plane == ArcPlane::kXy ? 1e9 : 1e-9);
    ASSERT_NEAR(p[i].sweep_rad, q[i].sweep_rad, 2e-9);
  }
}

TEST(GcodeLaw, RandomPlanarProgramsComeBack) {
  for (unsigned seed = 1; seed <= 300; ++seed) {
    SCOPED_TRACE(seed);
    Draw draw(seed);
    const std::vector<Operation> list = RandomPlanar(draw);
    const std::string text = WriteGcode(list, "random");
    const PartProgram read = ReadGcode(text);
    ASSERT_TRUE(read.faults.empty()) << read.faults[0].line << " " << read.faults[0].message << "\n" << text;
    ExpectSame(list, read.operations, 1e-9);
    EXPECT_EQ(WriteGcode(read.operations, "random"), text);
    if (HasFailure()) {
      return;
    }
  }
}

// Lines, arcs and helices of up to three turns in all three planes, both ways, in six axes.
std::vector<Operation> RandomSpatial(Draw& draw) {
  std::array<double, 3> at = {draw.In(-100, 100), draw.In(-100, 100), draw.In(-100, 100)};
  const auto add = [&](OperationKind kind, std::vector<Operation>& list) -> Operation& {
    Operation& o =
        list.emplace_back(At(kind, at[0], at[1], kind == OperationKind::kTraverse ? 0 : draw.In(1, 200)));
    o.axes = kSixAxes;
    o.z_W_mm = at[2];
    o.a_rad = draw.In(-kPi, kPi);
    o.b_rad = draw.In(-1, 1);
    o.c_rad = draw.In(-kPi, kPi);
    return o;
  };
  std::vector<Operation> list;
  add(OperationKind::kTraverse, list);
  for (int i = 0; i < 40; ++i) {
    if (draw.Of(4) == 0) {
      at = {draw.In(-100, 100), draw.In(-100, 100), draw.In(-100, 100)};
      add(OperationKind::kFeedLine, list);
      continue;
    }
    const int plane = draw.Of(3);
    const std::size_t u = plane == 0 ? 0 : plane == 1 ? 2 : 1, v = (u + 1) % 3, normal = (u + 2) % 3;
    const double radius = draw.In(0.1, 200), angle = draw.In(-kPi, kPi);
    const bool whole = draw.Of(5) == 0;
    const double sweep =
        (draw.Of(2) == 0 ? 1 : -1) * (whole ? 2 * kPi * (1 + draw.Of(3)) : draw.In(1e-3, 6 * kPi));
    std::array<double, 3> center = at;
    center[u] -= radius * std::cos(angle);
    center[v] -= radius * std::sin(angle);
    if (!whole) {
      at[u] = center[u] + radius * std::cos(angle + sweep);
      at[v] = center[v] + radius * std::sin(angle + sweep);
    }
    at[normal] += draw.Of(2) == 0 ? draw.In(-20, 20) : 0.0;
    Operation& o = add(OperationKind::kFeedArc, list);
    o.plane = static_cast<ArcPlane>(plane);
    o.center_x_W_mm = center[0];
    o.center_y_W_mm = center[1];
    o.center_z_W_mm = center[2];
    o.sweep_rad = sweep;
  }
  list.push_back(At(OperationKind::kEnd, 0, 0, 0));
  return list;
}

TEST(GcodeLaw, ArcsAndHelicesInAllPlanesComeBack) {
  GcodeOptions six;
  six.axes = kSixAxes;
  for (unsigned seed = 1; seed <= 300; ++seed) {
    SCOPED_TRACE(seed);
    Draw draw(seed);
    std::vector<Operation> list = RandomSpatial(draw);
    const std::string text = WriteGcode(list, "random");
    const PartProgram read = ReadGcode(text, six);
    ASSERT_TRUE(read.faults.empty()) << read.faults[0].line << " " << read.faults[0].message << "\n" << text;
    list.back() = read.operations.back();
    ExpectSameInSixAxes(list, read.operations);
    if (HasFatalFailure()) {
      return;
    }
  }
}

// Planes, inch, increments, timed feeds and turns by words of a shop, not by our own writer.
TEST(GcodeLaw, WhatAShopWroteComesBackWhateverItsModes) {
  GcodeOptions six;
  six.axes = kSixAxes;
  const PartProgram first = ReadGcode(
      "G20 G91 G18\nG0 X1 Y1 Z1\nF10\nG2 X0.5 Z0.5 I0.5 K0 Y0.3\nG3 X0 Z0 I0.25 K0 P3 A10\nG19 G2 Y0.2 Z0.2 "
      "R0.2 "
      "B5\nG93 G3 Y0 Z0 J0.1 K0.1 X0.1 F4\nG17 G2 X1 Y0 I0.5 J0 Z-0.2 F2\nG1 A20 C3 F3\nG94 G1 X1 F20\nG21 "
      "G90 G18 G3 X5 "
      "Z5 R60 "
      "C-30 F600\nM2\n",
      six);
  ASSERT_TRUE(first.faults.empty()) << first.faults[0].line << " " << first.faults[0].message;
  const std::string text = WriteGcode(first.operations, "shop");
  const PartProgram second = ReadGcode(text, six);
  ASSERT_TRUE(second.faults.empty()) << second.faults[0].line << " " << second.faults[0].message << "\n"
                                     << text;
  ExpectSameInSixAxes(first.operations, second.operations);
  EXPECT_EQ(WriteGcode(second.operations, "shop"), text);
  for (const char* word : {"G18\n", "G19\n", "G17\n", " P3", " K", " J", "G93\n", "G94 F"}) {
    EXPECT_NE(text.find(word), std::string::npos) << word;
  }
}

// The end of an arc that is shorter than the reader's grain must not become a full turn.
TEST(GcodeLaw, AnArcOfNoLengthIsNoTurn) {
  Operation start = At(OperationKind::kTraverse, 100, 0, 0), arc = At(OperationKind::kFeedArc, 100, 0, 10);
  arc.sweep_rad = 1e-13;
  const PartProgram read = ReadGcode(WriteGcode({start, arc}, "short"));
  ASSERT_TRUE(read.faults.empty()) << read.faults[0].message;
  for (const Operation& o : read.operations) {
    EXPECT_NE(o.kind, OperationKind::kFeedArc);
  }
}

TEST(CldataLaw, RandomToolAxesComeBack) {
  Draw draw(7);
  CldataOptions six{.axes = kSixAxes};
  for (int round = 0; round < 50; ++round) {
    std::vector<Operation> list;
    for (int i = 0; i < 40; ++i) {
      Operation o = At(i == 0 ? OperationKind::kTraverse : OperationKind::kFeedLine, draw.In(-300, 300),
                       draw.In(-300, 300), 20);
      o.axes = kSixAxes;
      o.z_W_mm = draw.In(-100, 100);
      o.a_rad = draw.In(-kPi, kPi);
      o.b_rad = draw.Of(5) == 0 ? 0.5 * kPi : draw.In(-0.5 * kPi, 0.5 * kPi);
      list.push_back(o);
    }
    const CldataText text = WriteCldata(list, "axes");
    ASSERT_TRUE(text.faults.empty());
    const PartProgram read = ReadCldata(text.text, six);
    ASSERT_TRUE(read.faults.empty()) << read.faults[0].message;
    list.push_back(At(OperationKind::kEnd, 0, 0, 0));
    list.back() = read.operations.back();
    ExpectSame(list, read.operations, 1e-9);
    ASSERT_EQ(WriteCldata(read.operations, "axes").text,
              text.text.substr(0, text.text.size() - 5) + "END\nFINI\n");
  }
}

// ---- drilling cycles ----

double Apart(const Operation& a, const Operation& b) {
  return std::hypot(a.x_W_mm - b.x_W_mm, a.y_W_mm - b.y_W_mm, a.z_W_mm - b.z_W_mm);
}

bool SameTool(const Operation& a, const Operation& b) {
  return std::abs(a.a_rad - b.a_rad) + std::abs(a.b_rad - b.b_rad) < 1e-9;
}

// What moves, dwells and switches, without moves of no length and with traverses on one line as one.
std::vector<Operation> Motions(const std::vector<Operation>& operations) {
  std::vector<Operation> list;
  for (const Operation& o : operations) {
    if (!Compared(o) ||
        (Moves(o) && !list.empty() && Apart(list.back(), o) < 1e-9 && SameTool(list.back(), o))) {
      continue;
    }
    if (!Moves(o) && !list.empty()) {  // stands where the motion before has ended
      const Operation ended = list.back();
      list.push_back(ended);
      list.back().kind = o.kind;
      list.back().value = o.value;
      continue;
    }
    const std::size_t n = list.size();
    const bool on =
        n > 1 && o.kind == OperationKind::kTraverse && list[n - 1].kind == o.kind &&
        SameTool(list[n - 2], o) && SameTool(list[n - 1], o) &&
        std::abs(Apart(list[n - 2], list[n - 1]) + Apart(list[n - 1], o) - Apart(list[n - 2], o)) < 1e-9;
    if (on) {
      list.back() = o;
    } else {
      list.push_back(o);
    }
  }
  return list;
}

std::string Words(const char* format, double a, double b, double c = 0.0, double d = 0.0, double e = 0.0,
                  double f = 0.0) {
  char text[200];
  std::snprintf(text, sizeof text, format, a, b, c, d, e, f);
  return text;
}

// Groups of holes with one tilt each, in one go, with a dwell, in steps; back to the level before or to R between them.
struct Twins {
  std::string gcode = "G21 G90\nF300\n";
  std::string cldata = "PARTNO/'T'\nMULTAX/ON\nFEDRAT/300,MMPM\n";

  void Group(Draw& draw) {
    const HeadAngles tilt{draw.Of(2) * draw.In(-0.4, 0.4), draw.Of(2) * draw.In(-0.4, 0.4)};
    const ToolAxis axis = AxisOf(ToolAngles::kRollPitch, tilt);
    const double way = draw.In(20, 30), level = way * axis[2], r = draw.In(1, 4), depth = draw.In(2, 15);
    const double x = draw.In(-50, 50), y = draw.In(-50, 50), feed = draw.In(20, 400);
    const bool to_r = draw.Of(2) == 0;
    const int kind = draw.Of(3);
    const double extra = kind == 1 ? draw.In(0.1, 1.0) : draw.In(1, 5);
    gcode += Words("G0 X%.12f Y%.12f Z%.12f A%.12f B%.12f\n", x + way * axis[0], y + way * axis[1],
                   way * axis[2], tilt.a_rad * 180 / kPi, tilt.b_rad * 180 / kPi);
    gcode += Words("G8%.0f G%.0f X%.12f Y%.12f", kind + 1, to_r ? 99 : 98, x, y);
    gcode += Words(" Z%.12f R%.12f", -depth, r);
    gcode += kind == 0 ? "" : Words(kind == 1 ? " P%.12f" : " Q%.12f", extra, 0.0);
    gcode += Words(" F%.12f\n", feed, 0.0);
    cldata += "RAPID\n" + Goto(x + way * axis[0], y + way * axis[1], way * axis[2], axis);
    cldata +=
        kind == 2 ? draw.Of(2) == 0 ? "CYCLE/DEEP,DEPTH," : "CYCLE/DRILL,PECK,DEPTH," : "CYCLE/DRILL,DEPTH,";
    cldata += Words("%.12f,MMPM,%.12f,", depth, feed);
    cldata += to_r              ? Words("CLEAR,%.12f", r, 0.0)
              : draw.Of(2) == 0 ? Words("CLEAR,%.12f,RAPTO,%.12f", level, level - r)
                                : Words("RAPTO,%.12f,RTRCTO,%.12f", r, level);
    cldata += kind == 0 ? "\n" : Words(kind == 1 ? ",DWELL,%.12f\n" : ",STEP,%.12f\n", extra, 0.0);
    cldata += Goto(x, y, 0, axis);
    for (int more = draw.Of(3); more > 0; --more) {
      const double to_x = draw.In(-50, 50), to_y = draw.In(-50, 50);
      gcode += Words("X%.12f Y%.12f\n", to_x, to_y);
      cldata += Goto(to_x, to_y, 0, axis);
    }
    gcode += "G80\n";
    cldata += "CYCLE/OFF\n";
  }

  static std::string Goto(double x, double y, double z, const ToolAxis& axis) {
    return Words("GOTO/%.12f,%.12f,%.12f,%.15f,%.15f,%.15f\n", x, y, z, axis[0], axis[1], axis[2]);
  }
};

TEST(CldataLaw, CyclesDrillAsThoseOfGcodeDo) {
  int holes = 0;
  for (unsigned seed = 1; seed <= 200; ++seed) {
    SCOPED_TRACE(seed);
    Draw draw(seed);
    Twins twins;
    for (int group = 0; group < 5; ++group) {
      twins.Group(draw);
    }
    ReadOptions options;
    options.gcode.axes = options.cldata.axes = kSixAxes;
    options.cldata.tool_angles = ToolAngles::kRollPitch;
    const PartProgram gcode = ReadPartProgram(twins.gcode + "M2\n", options);
    const PartProgram cldata = ReadPartProgram(twins.cldata + "FINI\n", options);
    ASSERT_TRUE(gcode.faults.empty()) << gcode.faults[0].line << gcode.faults[0].message << twins.gcode;
    ASSERT_TRUE(cldata.faults.empty()) << cldata.faults[0].line << cldata.faults[0].message << twins.cldata;
    ExpectSame(Motions(gcode.operations), Motions(cldata.operations), 1e-8);
    if (HasFatalFailure()) {
      FAIL() << twins.gcode << twins.cldata;
    }
    const CldataText once = WriteCldata(cldata.operations, "t", {}, ToolAngles::kRollPitch);
    ASSERT_TRUE(once.faults.empty());
    const PartProgram again = ReadPartProgram(once.text, options);
    ASSERT_TRUE(again.faults.empty()) << again.faults[0].message;
    ExpectSame(cldata.operations, again.operations, 1e-9);
    EXPECT_EQ(WriteCldata(again.operations, "t", {}, ToolAngles::kRollPitch).text, once.text);
    holes += static_cast<int>(std::count(twins.cldata.begin(), twins.cldata.end(), 'G'));
  }
  EXPECT_GT(holes, 1000);
}

// One hole as Creo, Fusion and NX write it; and what stands below its height rises along the tool before it goes aside.
TEST(CldataLaw, CyclesOfDifferentPostsAreTheSameHole) {
  const auto heights = [](const std::string& cycle) {
    const PartProgram read =
        ReadCldata("UNITS/MM\nFEDRAT/100,MMPM\nRAPID\nGOTO/0,0,1\n" + cycle + "\nGOTO/7,0,-2\nFINI\n",
                   {.axes = kSixAxes});
    EXPECT_TRUE(read.faults.empty()) << cycle << read.faults[0].message;
    std::string text;
    for (const Operation& o : read.operations) {
      if (Moves(o)) {
        text += Words(o.kind == OperationKind::kTraverse ? "r%g:%g " : "f%g:%g ", o.x_W_mm, o.z_W_mm);
      }
    }
    return text;
  };
  const std::string one = "r0:1 r0:8 r7:8 r7:1 f7:-11 r7:8 ";
  EXPECT_EQ(heights("CYCLE/DRILL,DEPTH,9,MMPM,50,CLEAR,10,RAPTO,7"), one);
  EXPECT_EQ(heights("CYCLE / DRILL, 9.0, MMPM, 50.0, 10.0, RAPTO, 7.0"), one);
  EXPECT_EQ(heights("CYCLE/DRILL,RAPTO,3,FEDTO,-9,RTRCTO,10,MMPM,50"), one);
  EXPECT_EQ(heights("CYCLE/FACE,DEPTH,9,CLEAR,3,RETURN,10"), one);
  EXPECT_EQ(heights("CYCLE/DRILL,BRKCHP,DEPTH,9,STEP,7,CLEAR,3"), "r0:1 r7:1 f7:-6 r7:-5.746 f7:-11 r7:1 ");
}

TEST(CldataLaw, SpindleAndCoolantAreThoseOfMachinesWithZ) {
  const PartProgram read = ReadCldata(
      "UNITS/MM\nSPINDL/1500,RPM,CLW\nCOOLNT/FLOOD\nRAPID\nGOTO/0,0,9\nSPINDL/RANGE,2,2000,RPM,CCLW\nSPINDL/"
      "ON\n"
      "AUXFUN/3\nFEDRAT/0.1,MMPR\nGOTO/0,0,0\nSPINDL/OFF\nAUXFUN/5\nAUXFUN/4\nFINI\n",
      {.axes = kSixAxes});
  ASSERT_TRUE(read.faults.empty()) << read.faults[0].message;
  std::string text;
  for (const Operation& o : read.operations) {
    text += FormatOperation(o).substr(0, FormatOperation(o).find(" x_mm")) + "\n";
  }
  EXPECT_EQ(text,
            "1 UNITS_CHANGE unit_mm=1\n2 SPINDLE_ON speed_per_min=1500\n3 COOLANT_ON\n5 TRAVERSE\n"
            "6 SPINDLE_ON speed_per_min=-2000\n8 SPINDLE_ON speed_per_min=2000\n9 FEED_CHANGE "
            "feed_mm_per_s=3.33333333\n"
            "10 FEED_LINE\n11 SPINDLE_OFF\n13 SPINDLE_ON speed_per_min=-2000\n14 SPINDLE_OFF\n14 "
            "COOLANT_OFF\n14 END\n");
  const CldataText once = WriteCldata(read.operations, "s");
  ASSERT_TRUE(once.faults.empty());
  const PartProgram again = ReadCldata(once.text, {.axes = kSixAxes});
  ASSERT_TRUE(again.faults.empty()) << again.faults[0].message;
  EXPECT_EQ(WriteCldata(again.operations, "s").text, once.text);
  CldataOptions slow{.axes = kSixAxes};
  slow.spindle = {100, 1800};
  EXPECT_EQ(ReadCldata("SPINDL/1900,RPM\nFINI\n", slow).faults.at(0).reason, "SPINDLE_SPEED_OUT_OF_RANGE");
  slow.spindle.most_per_min = 0.0;
  EXPECT_EQ(ReadCldata("SPINDL/1900,RPM\nFINI\n", slow).faults.at(0).reason, "SPINDLE_MISSING");
}

TEST(CldataLaw, WhatCldataCannotSayIsNamed) {
  Operation o = At(OperationKind::kFeedLine, 1, 2, 3);
  o.line = 12;
  o.c_rad = 0.1;
  const CldataText text = WriteCldata({o}, "part");
  ASSERT_EQ(text.faults.size(), 1u);
  EXPECT_EQ(text.faults[0].reason, "AXIS_NOT_WRITABLE");
  EXPECT_EQ(text.faults[0].line, 12u);
  EXPECT_TRUE(text.text.empty());
}

// One program as three posts write it: short and long forms, small letters, continuation, inches, increments.
constexpr const char* kPlain = R"(PARTNO/'THREE WAYS'
UNITS/MM
FROM/10,10,0
FEDRAT/1200,MMPM
SPINDL/ON
GOTO/60,10,0
CIRCLE/60,30,0,0,0,1,20
GOTO/80,30,0
GOTO/60,50,0
GOTO/10,50,0
SPINDL/OFF
FINI
)";
constexpr const char* kCreo = R"($$ a post with spaces
PARTNO THREE WAYS
UNITS / MM
MULTAX / OFF
from / 10.0000000000, 10., 0
FEDRAT / 20.0, MMPS
SPINDL / 1000.0, RPM, CLW
goto / 60.0, $ goes on
 10.0, 0.0
CIRCLE / 60, 30, 0, $
 0, 0, -1, $
 20
GOTO / 80, 30, 0
GOTO / 60, 50, 0.000
GODLTA / -50, 0, 0
SPINDL / OFF
END
FINI
)";
constexpr const char* kInches = R"(PARTNO/'THREE WAYS'
MODE/MILL
UNITS/INCHES
RAPID
GOTO/0.393700787401575, 0.393700787401575, 0.0
FEDRAT/47.244094488188978,IPM
AUXFUN/3
GOTO/2.362204724409449,0.393700787401575,0
MOVARC/2.362204724409449,1.181102362204724,0,0,0,1,0.787401574803150,ANGLE,180
GOTO/2.362204724409449,1.968503937007874,0
GOTO/0.393700787401575,1.968503937007874,0,0,0,1
AUXFUN/5
FINI
)";

// What CATIA, Creo and NX write beside the motions, over lines and with empty fields, changes none of them.
constexpr const char* kDescribed =
    "$$-> CSYS / 1.0, 0.0, 0.0, 0.0, $\n   0.0, 1.0, 0.0, 0.0, $\n   0.0, 0.0, 1.0, 0.0\n"
    "PARTNO part\nMSYS/0,0,0,1,0,0,0,1,0\nTOOLNO/1,MILL,1.0,,50.0,$\nON,,NOTE\nINTOL/ 0.01\nOUTTOL/ 0.01\n"
    "TLAXIS/ 0.0, 0.0, 1.0\nSEQNO/10,INCR,10\nCLEARP/XYPLAN,20\n"
    "FROM/10,10,0\nSPINDL/ON\nFEDRAT/600,MMPM\nGOTO/30,10,0\nARCSLP/ON\nGOTO/30,40,0\nDELAY/2,SEC\n"
    "SPINDL/OFF\nREWIND/0\nFINI\n";

TEST(CldataLaw, WhatOnlyDescribesChangesNothing) {
  const PartProgram described = ReadPartProgram(kDescribed);
  const PartProgram plain = ReadPartProgram(
      "PARTNO part\nFROM/10,10,0\nSPINDL/ON\nFEDRAT/600,MMPM\nGOTO/30,10,0\nGOTO/30,40,0\nDELAY/2\n"
      "SPINDL/OFF\nFINI\n");
  ASSERT_TRUE(plain.faults.empty());
  ASSERT_TRUE(described.faults.empty())
      << described.faults[0].line << ":" << described.faults[0].column << " " << described.faults[0].message;
  ExpectSame(plain.operations, described.operations, 1e-12);
}

TEST(CldataLaw, PostsOfDifferentHabitsGiveTheSameOperations) {
  const PartProgram plain = ReadPartProgram(kPlain), creo = ReadPartProgram(kCreo),
                    inches = ReadPartProgram(kInches);
  for (const PartProgram* p : {&plain, &creo, &inches}) {
    ASSERT_TRUE(p->faults.empty()) << p->faults[0].line << ":" << p->faults[0].column << " "
                                   << p->faults[0].message;
  }
  ExpectSame(plain.operations, creo.operations, 1e-12);
  ExpectSame(plain.operations, inches.operations, 1e-12);
  const Operation& arc = plain.operations[5];
  ASSERT_EQ(arc.kind, OperationKind::kFeedArc);
  EXPECT_NEAR(arc.sweep_rad, kPi, 1e-12);
  EXPECT_EQ(arc.line, 8u);  // the first of its points
}

std::vector<std::string> StopsAndSwitches(const PartProgram& program) {
  std::vector<std::string> words;
  for (const Operation& o : program.operations) {
    const bool tool = o.kind == OperationKind::kToolChange || o.kind == OperationKind::kToolNumber;
    if (tool || o.kind == OperationKind::kStop || o.kind == OperationKind::kJetOff) {
      words.push_back(std::string(OperationName(o.kind)) +
                      (tool ? " " + std::to_string(static_cast<int>(o.value)) : ""));
    }
  }
  return words;
}

// The first LOADTL only names a tool, M6 always wants it mounted; any other tool stops, jet off, in both notations.
TEST(CldataLaw, ToolsChangeAsWithMSix) {
  const PartProgram cldata = ReadPartProgram(
      "PARTNO/1\nFROM/10,10,0\nLOADTL/4\nSPINDL/ON\nFEDRAT/600,MMPM\nGOTO/20,10,0\nLOADTL/4\nLOADTL/7\n"
      "RAPID\nGOTO/20,20,0\nSPINDL/ON\nGOTO/30,20,0\nFINI\n",
      {});
  ASSERT_TRUE(cldata.faults.empty()) << cldata.faults[0].message;
  EXPECT_EQ(StopsAndSwitches(cldata),
            (std::vector<std::string>{"TOOL_NUMBER 4", "JET_OFF", "TOOL_CHANGE 7", "JET_OFF"}));
  const PartProgram gcode =
      ReadPartProgram("G21 G90\nT4 M6\nG0 X10 Y10\nM3\nG1 X20 F600\nT7 M6\nG0 X30\nM3\nG1 X40\nM2\n", {});
  ASSERT_TRUE(gcode.faults.empty()) << gcode.faults[0].message;
  EXPECT_EQ(StopsAndSwitches(gcode),
            (std::vector<std::string>{"TOOL_CHANGE 4", "JET_OFF", "TOOL_CHANGE 7", "JET_OFF"}));
  for (const PartProgram& program : {cldata, gcode}) {
    const CldataText once = WriteCldata(program.operations, "part");
    ASSERT_TRUE(once.faults.empty());
    const PartProgram again = ReadPartProgram(once.text, {});
    ASSERT_TRUE(again.faults.empty());
    EXPECT_EQ(WriteCldata(again.operations, "part").text, once.text);
    std::vector<std::string> words = StopsAndSwitches(program);
    if (words[0] == "TOOL_CHANGE 4") {
      words.erase(words.begin());
      words.insert(words.begin(), {"STOP", "TOOL_NUMBER 4"});
    }
    EXPECT_EQ(StopsAndSwitches(again), words);
  }
}

TEST(CldataLaw, InverseTimeFeedGivesEveryMoveItsTime) {
  const PartProgram p =
      ReadCldata("FROM/0,0,0\nFEDRAT/60,INVERS\nGOTO/3,4,0\nGOTO/3,14,0\nGOTO/3,14,0\nFINI\n");
  ASSERT_TRUE(p.faults.empty());
  EXPECT_NEAR(p.operations[1].feed_mm_per_s, 5.0, 1e-12);
  EXPECT_NEAR(p.operations[2].feed_mm_per_s, 10.0, 1e-12);
  EXPECT_NEAR(p.operations[3].value, 1.0, 1e-12);
}

TEST(CldataLaw, NotationIsRecognisedByContent) {
  for (const char* cldata : {"PARTNO X\n", "$$ c\nG1\n", "\xEF\xBB\xBF  goto / 1,2,3\n", "UNITS/MM",
                             "TOOL PATH/A,TOOL,B\n", "FINI\n"}) {
    EXPECT_TRUE(LooksLikeCldata(cldata)) << cldata;
  }
  for (const char* gcode : {"G21 G90\n", "%\nG0 X1\n", "(GOTO/1,2,3)\n", "; FINI\n", "O100 sub\n", "#1=3\n",
                            "/G1\n", "", "\n\n", "M30", "X1Y1"}) {
    EXPECT_FALSE(LooksLikeCldata(gcode)) << gcode;
  }
}

}  // namespace
}  // namespace lambdajet::trajectory
