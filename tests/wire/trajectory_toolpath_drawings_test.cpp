// Drawings in, toolpaths out: every wrong drawing is refused by name, the shipped ones become plans, insertions are exact.
#include <gmock/gmock.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <numbers>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/demo_machine.hpp"
#include "tests/support/figure.hpp"
#include "trajectory/core/feed/plan_program.hpp"
#include "trajectory/core/toolpath/program_text.hpp"
#include "trajectory/drawing/dxf_file.hpp"

// libdime frees the name of SEQEND and ENDBLK with delete instead of delete[]: harmless, and not ours to mend.
extern "C" const char* __asan_default_options() { return "alloc_dealloc_mismatch=0"; }

namespace lambdajet::trajectory {
namespace {

using Eigen::Vector2d;
constexpr double kPi = std::numbers::pi;

std::string Source(const std::string& path) {
  return std::string(std::getenv("LAMBDAJET_SOURCE_DIR")) + "/" + path;
}
std::string Content(const std::string& path) {
  std::ifstream file(Source(path), std::ios::binary);
  EXPECT_TRUE(file.good()) << path;
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

std::vector<Finding> AllFindings(const std::string& dxf, const ContourOptions& contours = {}) {
  const Drawing drawing = ReadDxf(dxf);
  const ContourSet set = FindContours(drawing, contours);
  std::vector<Finding> findings = set.findings;
  if (!set.blocked()) {
    const Toolpath toolpath = MakeToolpath(drawing, set, {});
    findings.insert(findings.end(), toolpath.findings.begin(), toolpath.findings.end());
  }
  return findings;
}

std::string Group(int code, const std::string& value) { return std::to_string(code) + "\n" + value + "\n"; }
std::string Dxf(const std::string& entities, const std::string& blocks = "") {
  return Group(0, "SECTION") + Group(2, "HEADER") + Group(9, "$INSUNITS") + Group(70, "4") +
         Group(0, "ENDSEC") + Group(0, "SECTION") + Group(2, "BLOCKS") + blocks + Group(0, "ENDSEC") +
         Group(0, "SECTION") + Group(2, "ENTITIES") + entities + Group(0, "ENDSEC") + Group(0, "EOF");
}

// All that a user is told, one finding a row: what blocks and what does not, in order.
std::string Told(const std::string& drawing, const Finding& f) {
  char numbers[200];
  std::snprintf(numbers, sizeof numbers, "%u,%s,%s,%llX,%.4f,%.4f,%.4f", f.line, f.entity.c_str(),
                f.layer.c_str(), static_cast<unsigned long long>(f.dxf_handle), f.at_mm.x() + 0.0,
                f.at_mm.y() + 0.0, f.size_mm);
  return drawing + "," + std::string(f.reason) + "," + (f.blocks ? "blocks" : "told") + "," + numbers +
         ",\"" + f.message + "\"";
}

// LAMBDAJET_PRINT_TOLD prints the table as it would be now.
TEST(WrongDrawings, TellAllThatTheTableSaysAndNoMore) {
  std::istringstream table(Content("tests/wire/wrong_drawings/expected.csv"));
  std::map<std::string, std::vector<std::string>> expected;
  std::string row;
  std::getline(table, row);
  while (std::getline(table, row)) {
    expected[row.substr(0, row.find(','))].push_back(row);
  }
  for (const auto& entry : std::filesystem::directory_iterator(Source("tests/wire/wrong_drawings"))) {
    const std::string name = entry.path().stem();
    if (entry.path().extension() == ".dxf") {
      SCOPED_TRACE(name);
      std::vector<std::string> told;
      bool blocks = false;
      for (const Finding& f : AllFindings(Content("tests/wire/wrong_drawings/" + name + ".dxf"))) {
        told.push_back(Told(name, f));
        blocks |= f.blocks;
      }
      EXPECT_TRUE(blocks);
      EXPECT_EQ(told, expected[name]);
      for (const std::string& line : told) {
        std::getenv("LAMBDAJET_PRINT_TOLD") == nullptr ? 0 : std::printf("TOLD %s\n", line.c_str());
      }
    }
  }
  EXPECT_GE(expected.size(), 95u);
  tests::PrintFigure("wrong.drawings", static_cast<int>(expected.size()));
}

TEST(WrongDrawings, TooManyVerticesAndNumbersAreRefusedBeforeTheLibrarySeesThem) {
  std::string polyline = Group(0, "LWPOLYLINE") + Group(8, "CUT") + Group(70, "1");
  for (int i = 0; i < 32'001; ++i) {
    polyline += Group(10, std::to_string(i % 97)) + Group(20, std::to_string(i / 97));
  }
  const Drawing drawing = ReadDxf(Dxf(polyline));
  ASSERT_EQ(drawing.findings.size(), 1u);
  EXPECT_EQ(drawing.findings[0].reason, "TOO_MANY_VERTICES");
  EXPECT_TRUE(drawing.entities.empty());
}

TEST(WrongDrawings, FindingsNamePlaceLayerAndLine) {
  const auto findings = AllFindings(Content("tests/wire/wrong_drawings/hole_too_small.dxf"));
  ASSERT_FALSE(findings.empty());
  EXPECT_EQ(findings[0].layer, "CUT");
  EXPECT_EQ(findings[0].entity, "CIRCLE");
  EXPECT_GT(findings[0].line, 20u);
  EXPECT_NEAR((findings[0].at_mm - Vector2d(25, 25)).norm(), 0.3, 1e-9);
  EXPECT_DOUBLE_EQ(findings[0].size_mm, 0.4);
}

// Leaving out the insertion at which the reader gave up must not cut the half that was read.
TEST(WrongDrawings, WhatWasReadOnlyInPartBlocksWhateverIsLeftOut) {
  ContourOptions options;
  options.ignore_layers = {"CUT"};
  options.ignore_types = {"INSERT"};
  for (const std::string name : {"insert_itself", "insert_ring", "insert_bomb"}) {
    const Drawing drawing = ReadDxf(Content("tests/wire/wrong_drawings/" + name + ".dxf"));
    EXPECT_TRUE(FindContours(drawing, options).blocked()) << name;
    options.ignore_layers.clear();
    EXPECT_TRUE(FindContours(drawing, options).blocked()) << name;
  }
}

TEST(WrongDrawings, PlacesAreTheDrawingsWhereverItIsPlaced) {
  const Drawing drawing = ReadDxf(Content("tests/wire/wrong_drawings/hole_too_small.dxf"));
  ContourSet set = FindContours(drawing, {});
  PlaceContours(set, 0.7, Vector2d(300, 200));
  const Toolpath toolpath = MakeToolpath(drawing, set, {});
  ASSERT_FALSE(toolpath.findings.empty());
  EXPECT_NEAR((toolpath.findings[0].at_mm - Vector2d(25, 25)).norm(), 0.3, 1e-9);
}

std::string Square(double size) {
  const std::string far = std::to_string(size);
  return Group(0, "LWPOLYLINE") + Group(8, "CUT") + Group(70, "1") + Group(10, "0") + Group(20, "0") +
         Group(10, far) + Group(20, "0") + Group(10, far) + Group(20, far) + Group(10, "0") + Group(20, far);
}
std::string Disc(const std::string& layer, const std::string& x, const std::string& more = "") {
  return Group(0, "CIRCLE") + Group(8, layer) + more + Group(10, x) + Group(20, "20") + Group(40, "5");
}
std::string Layer(const std::string& name, const std::string& flags, const std::string& colour) {
  return Group(0, "LAYER") + Group(2, name) + Group(70, flags) + Group(62, colour);
}
ContourOptions Unit(double mm) {
  ContourOptions options;
  options.unit_mm = mm;
  return options;
}
std::vector<std::string> Reasons(const ContourSet& set, bool blocks) {
  std::vector<std::string> reasons;
  for (const Finding& f : set.findings) {
    if (f.blocks == blocks) {
      reasons.emplace_back(f.reason);
    }
  }
  return reasons;
}

TEST(Drawings, WhatNobodySeesOnTheDrawingIsNotCutAndTold) {
  const std::string layers = Group(0, "SECTION") + Group(2, "TABLES") + Group(0, "TABLE") +
                             Group(2, "LAYER") + Layer("Cut", "0", "7") + Layer("Off", "0", "-7") +
                             Layer("Frozen", "1", "7") + Group(0, "ENDTAB") + Group(0, "ENDSEC");
  const std::string block = Group(0, "BLOCK") + Group(2, "PAIR") + Group(10, "0") + Group(20, "0") +
                            Disc("0", "20") + Disc("CUT", "40") + Group(0, "ENDBLK");
  const auto insert = [](const std::string& layer) {
    return Group(0, "INSERT") + Group(8, layer) + Group(2, "pair") + Group(10, "0") + Group(20, "0");
  };
  struct Case {
    std::string entities;
    std::size_t contours;
    std::vector<std::string> told;
  };
  const std::vector<Case> cases = {
      {Disc("OFF", "20") + Disc("FROZEN", "40") + Disc("CUT", "60"), 2, {"LAYER_HIDDEN", "LAYER_HIDDEN"}},
      {insert("CUT"), 3, {}},
      {insert("OFF"), 2, {"LAYER_HIDDEN"}},
      {insert("FROZEN"), 1, {"LAYER_HIDDEN"}},
      {Disc("CUT", "20", Group(60, "1")), 1, {"ENTITY_INVISIBLE"}},
      {Disc("CUT", "20", Group(67, "1")), 1, {"PAPER_SPACE"}},
      {Group(0, "TEXT") + Group(8, "off") + Group(10, "1") + Group(20, "1"), 1, {}},
  };
  for (const Case& c : cases) {
    const ContourSet set = FindContours(ReadDxf(layers + Dxf(Square(80.0) + c.entities, block)), Unit(1.0));
    EXPECT_EQ(set.contours.size(), c.contours);
    EXPECT_EQ(Reasons(set, true), std::vector<std::string>{});
    EXPECT_EQ(Reasons(set, false), c.told);
  }
}

TEST(Drawings, WhatHasNoLengthOrAWidthIsTold) {
  const std::string speck =
      Group(0, "LINE") + Group(8, "CUT") + Group(10, "3") + Group(20, "1") + Group(11, "3") + Group(21, "1");
  const std::string dot =
      Group(0, "LWPOLYLINE") + Group(8, "CUT") + Group(70, "0") + Group(10, "20") + Group(20, "20");
  const std::string wide = Group(0, "LWPOLYLINE") + Group(8, "CUT") + Group(70, "1") + Group(43, "4") +
                           Group(10, "20") + Group(20, "40") + Group(42, "1") + Group(10, "40") +
                           Group(20, "40") + Group(42, "1");
  const ContourSet set = FindContours(ReadDxf(Dxf(Square(80.0) + speck + dot + wide)), Unit(25.4));
  EXPECT_EQ(Reasons(set, true), std::vector<std::string>{});
  EXPECT_EQ(Reasons(set, false), (std::vector<std::string>{"WIDE_POLYLINE", "NO_LENGTH", "NO_LENGTH"}));
  EXPECT_EQ(set.contours.size(), 2u);
  ASSERT_EQ(set.findings.size(), 3u);
  EXPECT_NEAR((set.findings[1].at_mm - Vector2d(76.2, 25.4)).norm(), 0.0, 1e-9);
}

// Dimensions stand as text in blocks of their own, which drawings keep when nobody inserts them any more.
TEST(Drawings, ABlockThatIsNotInsertedBlocksNothing) {
  const std::string block = Group(0, "BLOCK") + Group(2, "*D0") + Group(10, "0") + Group(20, "0") +
                            Group(0, "MTEXT") + Group(8, "0") + Group(10, "5") + Group(20, "5") +
                            Group(0, "ENDBLK");
  EXPECT_EQ(Reasons(FindContours(ReadDxf(Dxf(Square(80.0), block)), Unit(1.0)), true),
            std::vector<std::string>{});
  const std::string inserted =
      Group(0, "INSERT") + Group(8, "CUT") + Group(2, "*d0") + Group(10, "0") + Group(20, "0");
  EXPECT_EQ(Reasons(FindContours(ReadDxf(Dxf(Square(80.0) + inserted, block)), Unit(1.0)), true),
            std::vector<std::string>{"UNKNOWN_ENTITY"});
}

TEST(Drawings, WhatIsDrawnTwiceIsCutOnceAndTold) {
  std::string circle =
      Group(0, "CIRCLE") + Group(8, "CUT") + Group(10, "20") + Group(20, "20") + Group(40, "9");
  const Drawing drawing = ReadDxf(Dxf(circle + circle));
  const ContourSet set = FindContours(drawing, {});
  EXPECT_EQ(set.contours.size(), 1u);
  ASSERT_EQ(set.findings.size(), 1u);
  EXPECT_EQ(set.findings[0].reason, "DUPLICATE_ENTITY");
  EXPECT_FALSE(set.findings[0].blocks);
}

// The library keeps single precision; the table brings the file's doubles back.
TEST(Drawings, CoordinatesAreTheFilesDoubles) {
  const Drawing drawing =
      ReadDxf(Dxf(Group(0, "LINE") + Group(8, "CUT") + Group(10, "123456.123456789") + Group(20, "-0.1") +
                  Group(11, "3.3333333333333335") + Group(21, "1e-7")));
  ASSERT_EQ(drawing.entities.size(), 1u);
  const auto& line = std::get<LineCurve>(drawing.entities[0].curves[0]);
  EXPECT_EQ(line.from, Vector2d(123456.123456789, -0.1));
  EXPECT_EQ(line.to, Vector2d(3.3333333333333335, 1e-7));
}

TEST(Drawings, InsertionsTurnScaleMirrorNestAndRepeat) {
  const std::string inner = Group(0, "BLOCK") + Group(2, "INNER") + Group(10, "1") + Group(20, "2") +
                            Group(0, "CIRCLE") + Group(8, "0") + Group(10, "3") + Group(20, "2") +
                            Group(40, "1") + Group(0, "ENDBLK");
  const std::string outer = Group(0, "BLOCK") + Group(2, "OUTER") + Group(10, "0") + Group(20, "0") +
                            Group(0, "INSERT") + Group(8, "0") + Group(2, "INNER") + Group(10, "10") +
                            Group(20, "0") + Group(50, "90") + Group(0, "ENDBLK");
  const std::string insert = Group(0, "INSERT") + Group(8, "SPECIAL") + Group(2, "OUTER") + Group(10, "100") +
                             Group(20, "50") + Group(41, "2") + Group(42, "-3") + Group(50, "180") +
                             Group(70, "2") + Group(71, "3") + Group(44, "200") + Group(45, "100");
  const Drawing drawing = ReadDxf(Dxf(insert, inner + outer));
  ASSERT_EQ(drawing.entities.size(), 6u);
  // Centre in INNER (3, 2), base (1, 2), so (2, 0); turned by 90 degrees (0, 2); placed (10, 2); scaled (20, -6); turned (-20, 6).
  for (int k = 0; k < 6; ++k) {
    const auto& conic = std::get<ConicCurve>(drawing.entities[static_cast<std::size_t>(k)].curves[0]);
    const Vector2d expected = Vector2d(100 - 20, 50 + 6) - Vector2d(200.0 * (k % 2), 100.0 * (k / 2));
    EXPECT_NEAR((conic.center - expected).norm(), 0.0, 1e-9) << k;
    EXPECT_EQ(drawing.entities[static_cast<std::size_t>(k)].layer, "SPECIAL");
  }
  ContourOptions options;
  options.curve_tolerance_mm = 1e-4;
  const ContourSet set = FindContours(drawing, options);
  ASSERT_EQ(set.contours.size(), 6u);
  EXPECT_NEAR(SignedArea_mm2(set.contours[0].pieces), kPi * 2.0 * 3.0, 1e-3);  // an ellipse now
}

TEST(Drawings, EllipsesAndSplinesStayWithinTheToleranceAndSmooth) {
  const Drawing drawing = ReadDxf(Content("deploy/parts/mixed_nest.dxf"));
  ASSERT_TRUE(drawing.findings.empty());
  for (const double tolerance_mm : {0.05, 0.005, 0.0005}) {
    for (const DrawingEntity& entity : drawing.entities) {
      Pieces pieces;
      ASSERT_TRUE(AppendPieces(entity.curves[0], tolerance_mm, 0, pieces));
      if (entity.type != "ELLIPSE" && entity.type != "SPLINE") {
        continue;
      }
      for (std::size_t i = 0; i < pieces.size(); ++i) {
        const Piece& next = pieces[(i + 1) % pieces.size()];
        EXPECT_LT((pieces[i].to_mm - next.from_mm).norm(), 1e-9);
        EXPECT_LT(std::abs(TurnBetween(TangentAt(pieces[i], 1.0), TangentAt(next, 0.0))), 1e-6);
      }
      if (const auto* c = std::get_if<ConicCurve>(&entity.curves[0])) {
        for (int k = 0; k < 1000; ++k) {
          const double t = 2.0 * kPi * k / 1000;
          double nearest = 1e300;
          for (const Piece& piece : pieces) {
            nearest = std::min(nearest, Distance(piece, c->center + std::cos(t) * c->u + std::sin(t) * c->v));
          }
          EXPECT_LE(nearest, tolerance_mm);
        }
      }
    }
  }
}

TEST(ShippedDrawings, BecomePlansOfTheShippedMachine) {
  const MachineDescription machine = tests::DemoMachine();
  for (const std::string name : {"slotted_plate", "mixed_nest"}) {
    SCOPED_TRACE(name);
    const Drawing drawing = ReadDxf(Content("deploy/parts/" + name + ".dxf"));
    ContourOptions contours;
    contours.ignore_layers = {"CENTRE"};
    contours.mark_layers = {"SCRIBE"};
    const ContourSet set = FindContours(drawing, contours);
    ASSERT_FALSE(set.blocked());
    for (const PierceKind pierce : {PierceKind::kStationary, PierceKind::kMoving}) {
      ToolpathOptions options;
      options.pierce = pierce;
      options.tab_count = 2;
      const Toolpath toolpath = MakeToolpath(drawing, set, options);
      ASSERT_FALSE(toolpath.blocked());
      EXPECT_LE(toolpath.idle_mm, toolpath.drawing_idle_mm);
      const std::string program = ProgramText(set, toolpath, options, name);
      const Admission admission = AdmitPartProgram(program, machine, {});
      ASSERT_TRUE(admission.faults.empty()) << admission.faults[0].line << " " << admission.faults[0].reason;
      EXPECT_EQ(admission.pierce_count,
                pierce == PierceKind::kStationary ? static_cast<unsigned>(toolpath.pierce_count) : 0u);
      const PlannedProgram plan = PlanPartProgram(program, machine, {});
      ASSERT_TRUE(plan.faults.empty());
      EXPECT_GT(plan.plan.segments.size(), 100u);
      double mark_mm = 0.0;
      for (const Pieces& mark : set.marks) {
        mark_mm += Length(mark);
      }
      EXPECT_NEAR(plan.cutting_length_mm, toolpath.cut_mm, 0.5 + 0.01 * toolpath.cut_mm + mark_mm);
    }
  }
}

}  // namespace
}  // namespace lambdajet::trajectory
