// CLDATA in and out: writing what was read changes nothing, and a program in G-code makes the same motions as its CLDATA.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <numbers>
#include <random>
#include <sstream>

#include "trajectory/core/part_program/cldata_writer.hpp"
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
