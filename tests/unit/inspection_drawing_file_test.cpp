#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "foundation/contract/trouble.hpp"
#include "inspection/drawing_file/drawing_file.hpp"

namespace lambdajet::inspection {
namespace {

constexpr char kGood[] = R"(name: flange
kerf_width_mm: 1.0
features:
  - name: outer
    kind: contour
    side: outside
    tolerance_mm: 0.1
    outline:
      - line: [0, 0, 100, 0]
      - arc: {center: [100, 10], radius: 10, start_deg: -90, sweep_deg: 180}
      - line: [100, 20, 0, 20]
      - line: [0, 20, 0, 0]
  - {name: bore, kind: hole, side: inside, tolerance_mm: 0.05, outline: [{circle: {center: [50, 10], radius: 4}}]}
)";

std::string Replaced(std::string text, const std::string& what, const std::string& by) {
  const auto at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  return text.replace(at, what.size(), by);
}

TEST(DrawingFile, ReadsEveryKindOfElement) {
  const auto drawing = ReadDrawing(kGood);
  ASSERT_TRUE(drawing.ok()) << drawing.status().ToString();
  ASSERT_EQ(drawing->features.size(), 2u);
  EXPECT_EQ(drawing->features[0].side, Side::kOutside);
  EXPECT_EQ(drawing->features[1].kind, FeatureKind::kHole);
  EXPECT_NEAR(LengthMm(drawing->features[0].outline[1]), 10.0 * std::numbers::pi, 1e-12);
  EXPECT_NEAR(0.5 * SignedAreaMm2(drawing->features[0].outline), 2000.0 + 50.0 * std::numbers::pi, 1e-9);
  EXPECT_NEAR(0.5 * SignedAreaMm2(drawing->features[1].outline), 16.0 * std::numbers::pi, 1e-9);
}

TEST(DrawingFile, RefusesWithLineAndKey) {
  const struct {
    const char *what, *by, *field, *reason;
  } cases[] = {
      {"side: outside", "side: left", "features[0].side", "BAD_VALUE"},
      {"kerf_width_mm: 1.0", "kerf_width_mm: .nan", "kerf_width_mm", "BAD_VALUE"},
      {"kerf_width_mm: 1.0", "kerf_mm: 1.0", "drawing.kerf_mm", "UNKNOWN_KEY"},
      {"[0, 0, 100, 0]", "[0, 0, 100]", "features[0].outline[0].line", "BAD_VALUE"},
      {"line: [0, 20, 0, 0]", "spline: [0, 20, 0, 0]", "features[0].outline[3].spline", "UNKNOWN_KEY"},
      {"[0, 20, 0, 0]", "[0, 20, 0, 5]", "features[0].outline[3]", "OPEN_OUTLINE"},
      {"tolerance_mm: 0.05", "tolerance_mm: -1", "features[1].tolerance_mm", "BAD_TOLERANCE"},
      {"radius: 4", "radius: 0", "features[1].outline[0]", "BAD_ELEMENT"},
  };
  for (const auto& c : cases) {
    const auto drawing = ReadDrawing(Replaced(kGood, c.what, c.by));
    ASSERT_FALSE(drawing.ok()) << c.by;
    EXPECT_EQ(TroubleReason(drawing.status()), "BAD_DRAWING");
    ASSERT_FALSE(TroubleViolations(drawing.status()).empty());
    EXPECT_EQ(TroubleViolations(drawing.status())[0].field, c.field) << c.by;
    EXPECT_EQ(TroubleViolations(drawing.status())[0].reason, c.reason) << c.by;
  }
}

TEST(DrawingFile, SurvivesNonsense) {
  for (const char* text :
       {"", "[", "a: [1, 2", "3", "features: 7", "{features: [1, [2], {outline: {}}]}", "\xff\xfe\x00"}) {
    EXPECT_FALSE(ReadDrawing(text).ok()) << text;
  }
  EXPECT_FALSE(ReadDrawing(std::string(kLargestDrawingBytes + 1, ' ')).ok());
}

}  // namespace
}  // namespace lambdajet::inspection
