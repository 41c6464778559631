// Laws of toolpaths: offset and back, distance from the contour, area grown, invariances, nesting, order, modal state.
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <random>

#include "trajectory/core/part_program/gcode_reader.hpp"
#include "trajectory/core/part_program/gcode_writer.hpp"
#include "trajectory/core/toolpath/cut_order.hpp"
#include "trajectory/core/toolpath/kerf.hpp"
#include "trajectory/core/toolpath/offset.hpp"
#include "trajectory/core/toolpath/program_text.hpp"
#include "trajectory/core/toolpath/start_from_line.hpp"
#include "trajectory/core/toolpath/toolpath.hpp"

namespace lambdajet::trajectory {
namespace {

using Eigen::Vector2d;
using Random = std::mt19937_64;
constexpr double kPi = std::numbers::pi;

double Between(Random& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}

// Corners on a circle (convex) or on two in turn (a star), each rounded by `fillet` if above 0; counter-clockwise.
Pieces RandomOutline(Random& random, bool convex, double fillet_mm) {
  const int n = 2 * static_cast<int>(Between(random, 2.0, 7.0));
  const double size = Between(random, 30.0, 80.0), phase = Between(random, 0.0, 1.0);
  std::vector<Vector2d> p;
  for (int i = 0; i < n; ++i) {
    const double a = 2.0 * kPi * (i + phase + Between(random, 0.0, 0.3)) / n;
    const double r = convex || i % 2 == 0 ? size : Between(random, 0.6, 0.8) * size;
    p.push_back(r * Vector2d(std::cos(a), std::sin(a)));
  }
  Pieces pieces;
  Vector2d at = Vector2d::Zero();
  for (int i = 0; i <= n; ++i) {
    const Vector2d a = p[static_cast<std::size_t>((i + n - 1) % n)], b = p[static_cast<std::size_t>(i % n)],
                   c = p[static_cast<std::size_t>((i + 1) % n)];
    const Vector2d u = (b - a).normalized(), v = (c - b).normalized();
    const double turn = TurnBetween(u, v), trim = fillet_mm * std::tan(std::abs(turn) / 2.0);
    const Vector2d begin = b - trim * u, end = b + trim * v;
    if (i > 0) {
      pieces.push_back(LinePiece(at, begin));
      if (fillet_mm > 0.0) {
        const double side = turn > 0.0 ? 1.0 : -1.0;
        pieces.push_back({begin, end, begin + side * fillet_mm * Vector2d(-u.y(), u.x()), turn, 0});
      }
    }
    at = end;
  }
  pieces.front().from_mm = pieces.back().to_mm;
  return pieces;
}

double FarthestFrom(const Pieces& a, const Pieces& b) {
  double farthest = 0.0;
  for (const Piece& piece : a) {
    for (int k = 0; k <= 8; ++k) {
      double nearest = 1e300;
      for (const Piece& other : b) {
        nearest = std::min(nearest, Distance(other, PointAt(piece, k / 8.0)));
      }
      farthest = std::max(farthest, nearest);
    }
  }
  return farthest;
}

TEST(OffsetLaw, OffsetAndBackIsTheContour) {
  Random random(1);
  for (int i = 0; i < 400; ++i) {
    const double d = Between(random, 0.1, 2.0) * (i % 2 == 0 ? 1.0 : -1.0);
    const Pieces contour = RandomOutline(random, i % 4 < 2, std::abs(d) + Between(random, 0.0, 2.0));
    const OffsetChain out = OffsetPieces(contour, true, d);
    ASSERT_FALSE(out.blocked());
    const OffsetChain back = OffsetPieces(out.pieces, true, -d);
    ASSERT_FALSE(back.blocked());
    EXPECT_LT(FarthestFrom(back.pieces, contour), 1e-9);
    EXPECT_LT(FarthestFrom(contour, back.pieces), 1e-9);
  }
}

TEST(OffsetLaw, SharpConvexCornersComeBackFromTheirRoll) {
  Random random(2);
  for (int i = 0; i < 200; ++i) {
    const double d = Between(random, 0.1, 3.0);
    const Pieces contour = RandomOutline(random, true, 0.0);
    const OffsetChain out = OffsetPieces(contour, true, -d);
    ASSERT_FALSE(out.blocked());
    const OffsetChain back = OffsetPieces(out.pieces, true, d);
    ASSERT_FALSE(back.blocked());
    EXPECT_EQ(back.pieces.size(), contour.size());
    EXPECT_LT(FarthestFrom(contour, back.pieces), 1e-9);
  }
}

TEST(OffsetLaw, EveryPlaceIsAtTheKerfFromTheContour) {
  Random random(3);
  for (int i = 0; i < 300; ++i) {
    const double d = Between(random, 0.1, 2.0) * (i % 2 == 0 ? 1.0 : -1.0);
    const Pieces contour = RandomOutline(random, i % 3 == 0, i % 5 == 0 ? 0.0 : 2.1);
    const OffsetChain out = OffsetPieces(contour, true, d);
    ASSERT_FALSE(out.blocked());
    for (const Piece& piece : out.pieces) {
      for (int k = 0; k <= 10; ++k) {
        double nearest = 1e300;
        for (const Piece& c : contour) {
          nearest = std::min(nearest, Distance(c, PointAt(piece, k / 10.0)));
        }
        EXPECT_NEAR(nearest, std::abs(d), 1e-9);
      }
    }
    EXPECT_THAT(FindGouges(out.pieces, contour, PieceIndex(contour), std::abs(d)), testing::IsEmpty());
  }
}

TEST(OffsetLaw, ConvexAreaGrowsByPerimeterAndCircle) {
  Random random(4);
  for (int i = 0; i < 300; ++i) {
    const double r = Between(random, 0.1, 5.0);
    const Pieces contour = RandomOutline(random, true, i % 2 == 0 ? 0.0 : Between(random, 0.5, 3.0));
    const OffsetChain out = OffsetPieces(contour, true, -r);
    const double grown = SignedArea_mm2(contour) + r * Length(contour) + kPi * r * r;
    EXPECT_NEAR(SignedArea_mm2(out.pieces), grown, 1e-9 * grown);
    EXPECT_NEAR(Length(out.pieces), Length(contour) + 2.0 * kPi * r, 1e-9 * Length(contour));
  }
}

TEST(OffsetLaw, TooSmallRadiiAndNarrowPlacesAreNamed) {
  Pieces slot;  // 0.6 mm wide with round ends
  slot.push_back(LinePiece({0, -0.3}, {20, -0.3}));
  AppendArc({20, 0}, 0.3, -kPi / 2, kPi, 0, slot);
  slot.push_back(LinePiece({20, 0.3}, {0, 0.3}));
  AppendArc({0, 0}, 0.3, kPi / 2, kPi, 0, slot);
  const OffsetChain inside = OffsetPieces(slot, true, 0.4);
  ASSERT_EQ(inside.faults.size(), 2u);
  EXPECT_EQ(inside.faults[0].reason, "RADIUS_BELOW_KERF");
  EXPECT_DOUBLE_EQ(inside.faults[0].size_mm, 0.4);
  EXPECT_NEAR((inside.faults[0].at_mm - Vector2d(20.3, 0)).norm(), 0.0, 1e-12);
  const Pieces notch = {LinePiece({0, 0}, {10, 0}),    LinePiece({10, 0}, {10, 5}),
                        LinePiece({10, 5}, {5.3, 5}),  LinePiece({5.3, 5}, {5.3, 2}),
                        LinePiece({5.3, 2}, {4.7, 2}), LinePiece({4.7, 2}, {4.7, 5}),
                        LinePiece({4.7, 5}, {0, 5}),   LinePiece({0, 5}, {0, 0})};
  const OffsetChain outside = OffsetPieces(notch, true, -0.4);
  ASSERT_TRUE(outside.blocked());
  EXPECT_TRUE(std::any_of(outside.faults.begin(), outside.faults.end(), [](const OffsetFault& f) {
    return f.reason == "KERF_GOUGE" && (f.at_mm - Vector2d(5.0, 2.0)).norm() < 1e-9;
  }));
}

// ---- drawings ----

Drawing DrawingOf(const std::vector<Pieces>& outlines) {
  Drawing drawing;
  drawing.unit_mm = 1.0;
  for (const Pieces& outline : outlines) {
    for (const Piece& p : outline) {
      DrawingEntity entity{p.is_arc() ? "ARC" : "LINE", "CUT", 0, {}};
      if (p.is_arc()) {
        const Vector2d out = p.from_mm - p.center_mm;
        const double r = out.norm();
        entity.curves.push_back(
            ConicCurve{p.center_mm, {r, 0}, {0, r}, std::atan2(out.y(), out.x()), p.sweep_rad});
      } else {
        entity.curves.push_back(LineCurve{p.from_mm, p.to_mm});
      }
      drawing.entities.push_back(std::move(entity));
    }
  }
  return drawing;
}

Pieces Square(double x, double y, double side) {
  return {LinePiece({x, y}, {x + side, y}), LinePiece({x + side, y}, {x + side, y + side}),
          LinePiece({x + side, y + side}, {x, y + side}), LinePiece({x, y + side}, {x, y})};
}

TEST(ContourLaw, AnyOrderAndSenseOfEntitiesGivesTheSameContours) {
  Random random(5);
  for (int i = 0; i < 60; ++i) {
    const Pieces outline = RandomOutline(random, false, 1.5);
    Drawing drawing = DrawingOf({outline, Square(-5, -5, 10)});
    std::shuffle(drawing.entities.begin(), drawing.entities.end(), random);
    for (DrawingEntity& entity : drawing.entities) {
      if (auto* line = std::get_if<LineCurve>(&entity.curves[0]); line && random() % 2 == 0) {
        std::swap(line->from, line->to);
      }
    }
    const ContourSet set = FindContours(drawing, {});
    ASSERT_FALSE(set.blocked()) << set.findings[0].reason << " " << set.findings[0].message
                                << set.findings[0].at_mm.transpose();
    ASSERT_EQ(set.contours.size(), 2u);
    double areas[2] = {SignedArea_mm2(set.contours[0].pieces), SignedArea_mm2(set.contours[1].pieces)};
    EXPECT_NEAR(std::max(areas[0], areas[1]), SignedArea_mm2(outline), 1e-8);
    EXPECT_NEAR(std::min(areas[0], areas[1]), 100.0, 1e-9);
    EXPECT_EQ(set.part_count, 1);
  }
}

TEST(ContourLaw, DepthParityMakesHolesAndParts) {
  std::vector<Pieces> nested;
  for (int k = 0; k < 7; ++k) {
    nested.push_back(Square(10.0 * k, 10.0 * k, 200.0 - 20.0 * k));
  }
  Random random(6);
  std::shuffle(nested.begin(), nested.end(), random);
  const ContourSet set = FindContours(DrawingOf(nested), {});
  ASSERT_EQ(set.contours.size(), 7u);
  EXPECT_EQ(set.part_count, 4);
  for (const Contour& c : set.contours) {
    const int depth = static_cast<int>(std::lround((200.0 - std::sqrt(SignedArea_mm2(c.pieces))) / 20.0));
    EXPECT_EQ(c.depth, depth);
    EXPECT_EQ(c.hole, depth % 2 == 1);
  }
}

TEST(ToolpathLaw, TurningAndMovingTheDrawingTurnsAndMovesThePath) {
  Random random(7);
  for (int i = 0; i < 20; ++i) {
    const Pieces outline = RandomOutline(random, i % 2 == 0, 1.5);
    const Drawing drawing = DrawingOf({outline, Square(-6, -6, 12)});
    ToolpathOptions options;
    options.shortest_order = false;
    ContourSet set = FindContours(drawing, {}), turned = set;
    const Toolpath as_drawn = MakeToolpath(drawing, set, options);
    PlaceContours(turned, Between(random, -3.0, 3.0), {Between(random, -50, 50), Between(random, -50, 50)});
    const Toolpath moved = MakeToolpath(drawing, turned, options);
    ASSERT_EQ(as_drawn.cuts.size(), 2u);
    ASSERT_EQ(moved.cuts.size(), 2u);
    EXPECT_NEAR(as_drawn.cut_mm, moved.cut_mm, 1e-7);
    EXPECT_NEAR((as_drawn.cuts[0].end() - as_drawn.cuts[1].pierce()).norm(),
                (moved.cuts[0].end() - moved.cuts[1].pierce()).norm(), 1e-6);
  }
}

TEST(ToolpathLaw, LeadsAndPiercesKeepClearAndHolesComeFirst) {
  Random random(8);
  for (int i = 0; i < 30; ++i) {
    const Drawing drawing =
        DrawingOf({RandomOutline(random, i % 2 == 0, 2.0), Square(-8, -8, 6), Square(2, 2, 5)});
    const ContourSet set = FindContours(drawing, {});
    ToolpathOptions options;
    options.lead = i % 3 == 0 ? LeadKind::kLine : LeadKind::kArc;
    options.tab_count = i % 4;
    const Toolpath toolpath = MakeToolpath(drawing, set, options);
    ASSERT_FALSE(set.blocked()) << set.findings[0].reason << " " << set.findings[0].message
                                << set.findings[0].at_mm.transpose();
    ASSERT_EQ(toolpath.cuts.size(), 3u);
    EXPECT_EQ(toolpath.cuts.back().kind, CutKind::kOutline);
    EXPECT_EQ(toolpath.cuts.back().tabs.size(), static_cast<std::size_t>(options.tab_count));
    for (const Cut& cut : toolpath.cuts) {
      for (const Contour& contour : set.contours) {
        for (const Piece& c : contour.pieces) {
          EXPECT_GE(Distance(c, cut.pierce()), 0.4 + options.pierce_clearance_mm - 1e-5);
          for (const Pieces* pieces : {&cut.lead_in, &cut.path, &cut.lead_out}) {
            for (const Piece& p : *pieces) {
              EXPECT_GE(Nearest(p, c).distance_mm, 0.4 - 2e-6);
            }
          }
        }
      }
    }
  }
}

TEST(ToolpathLaw, TheTextReadsBackAsThePath) {
  Random random(9);
  for (int i = 0; i < 20; ++i) {
    const Drawing drawing = DrawingOf({RandomOutline(random, false, 2.0), Square(-8, -8, 14)});
    const ContourSet set = FindContours(drawing, {});
    ToolpathOptions options;
    options.pierce = static_cast<PierceKind>(i % 3);
    options.tab_count = i % 2;
    const Toolpath toolpath = MakeToolpath(drawing, set, options);
    ASSERT_FALSE(toolpath.blocked());
    const PartProgram program = ReadGcode(ProgramText(set, toolpath, options, "law"));
    ASSERT_TRUE(program.faults.empty()) << program.faults[0].reason;
    double read_mm = 0.0, made_mm = 0.0;
    Vector2d at = Vector2d::Zero();
    for (const Operation& o : program.operations) {
      const Vector2d to(o.x_W_mm, o.y_W_mm);
      if (o.kind == OperationKind::kFeedLine) {
        read_mm += (to - at).norm();
      } else if (o.kind == OperationKind::kFeedArc) {
        read_mm += std::abs(o.sweep_rad) * (to - Vector2d(o.center_x_W_mm, o.center_y_W_mm)).norm();
      }
      at = to;
    }
    for (const Cut& cut : toolpath.cuts) {
      made_mm += Length(cut.lead_in) + Length(cut.path) + Length(cut.lead_out);
    }
    EXPECT_NEAR(read_mm, made_mm, 1e-4);
  }
}

TEST(OrderLaw, IsNeverLongerThanTheDrawingsAndKeepsInnerFirst) {
  Random random(10);
  double drawn_mm = 0.0, ordered_mm = 0.0;
  for (int i = 0; i < 20; ++i) {
    std::vector<CutStop> cuts;
    const int parts = 1 + static_cast<int>(random() % 12);
    for (int part = 1; part <= parts; ++part) {
      const Vector2d place(Between(random, 0, 800), Between(random, 0, 600));
      for (int k = 0; k < 4; ++k) {
        const Vector2d at = place + Vector2d(Between(random, -40, 40), Between(random, -40, 40));
        cuts.push_back({at, at + Vector2d(1, 1), part, part > 1 && part % 3 == 0 ? part - 1 : 0, k > 0});
      }
    }
    std::shuffle(cuts.begin(), cuts.end(), random);
    const CutOrder order = OrderCuts(cuts, {0, 0}, true);
    ASSERT_EQ(order.sequence.size(), cuts.size());
    EXPECT_LE(order.idle_mm, order.drawing_idle_mm);
    drawn_mm += order.drawing_idle_mm;
    ordered_mm += order.idle_mm;
    std::vector<std::size_t> place(cuts.size());
    double length = 0.0;
    Vector2d at = Vector2d::Zero();
    for (std::size_t k = 0; k < cuts.size(); ++k) {
      place[order.sequence[k]] = k;
      length += (cuts[order.sequence[k]].entry_mm - at).norm();
      at = cuts[order.sequence[k]].exit_mm;
    }
    EXPECT_NEAR(length, order.idle_mm, 1e-9);
    for (std::size_t a = 0; a < cuts.size(); ++a) {
      for (std::size_t b = 0; b < cuts.size(); ++b) {
        const bool before = (cuts[a].part == cuts[b].part && cuts[a].hole && !cuts[b].hole) ||
                            (!cuts[a].hole && !cuts[b].hole && cuts[a].enclosing_part == cuts[b].part);
        EXPECT_TRUE(!before || place[a] < place[b]);
      }
    }
    EXPECT_EQ(OrderCuts(cuts, {0, 0}, true).sequence, order.sequence);
  }
  RecordProperty("idle_gain_percent", static_cast<int>(100.0 * (1.0 - ordered_mm / drawn_mm)));
  EXPECT_LT(ordered_mm, 0.8 * drawn_mm);
}

// Idle length of a sequence of single-cut parts from the origin; infinite if a part stands before one in its hole.
double IdleOf(const std::vector<CutStop>& cuts, const std::vector<std::size_t>& sequence) {
  std::vector<std::size_t> place(cuts.size() + 1, cuts.size());
  double length = 0.0;
  Vector2d at = Vector2d::Zero();
  for (std::size_t k = 0; k < sequence.size(); ++k) {
    const CutStop& cut = cuts[sequence[k]];
    length += (cut.entry_mm - at).norm();
    at = cut.exit_mm;
    place[static_cast<std::size_t>(cut.part)] = k;
  }
  for (const CutStop& cut : cuts) {
    const auto part = static_cast<std::size_t>(cut.part),
               around = static_cast<std::size_t>(cut.enclosing_part);
    if (around != 0 && place[part] > place[around]) {
      return 1e300;
    }
  }
  return length;
}

// Part k in a hole of part k + 1 for every third.
std::vector<CutStop> RandomParts(Random& random, int count) {
  std::vector<CutStop> cuts;
  for (int part = 1; part <= count; ++part) {
    const Vector2d at(Between(random, 0, 800), Between(random, 0, 600));
    cuts.push_back({at, at + Vector2d(Between(random, -30, 30), Between(random, -30, 30)), part,
                    part % 3 == 1 && part < count ? part + 1 : 0, false});
  }
  std::shuffle(cuts.begin(), cuts.end(), random);
  return cuts;
}

TEST(OrderLaw, ManyNestedPartsKeepInnerFirstAndBeatNearestNeighbour) {
  Random random(11);
  for (const int count : {30, 400, 2000}) {
    const std::vector<CutStop> cuts = RandomParts(random, count);
    const CutOrder order = OrderCuts(cuts, {0, 0}, true);
    EXPECT_NEAR(IdleOf(cuts, order.sequence), order.idle_mm, 1e-6);
    std::vector<std::size_t> sorted = order.sequence, nearest;
    std::sort(sorted.begin(), sorted.end());
    std::vector<bool> done(cuts.size() + 1, false);
    Vector2d at = Vector2d::Zero();
    while (nearest.size() < cuts.size()) {
      std::size_t best = cuts.size();
      for (std::size_t c = 0; c < cuts.size(); ++c) {
        const bool open = std::none_of(cuts.begin(), cuts.end(), [&](const CutStop& inner) {
          return inner.enclosing_part == cuts[c].part && !done[static_cast<std::size_t>(inner.part)];
        });
        if (!done[static_cast<std::size_t>(cuts[c].part)] && open &&
            (best == cuts.size() || (cuts[c].entry_mm - at).norm() < (cuts[best].entry_mm - at).norm())) {
          best = c;
        }
      }
      done[static_cast<std::size_t>(cuts[best].part)] = true;
      nearest.push_back(best);
      at = cuts[best].exit_mm;
    }
    for (std::size_t k = 0; k < sorted.size(); ++k) {
      ASSERT_EQ(sorted[k], k);
    }
    EXPECT_LE(order.idle_mm, IdleOf(cuts, nearest) + 1e-6);
  }
}

TEST(OrderLaw, NoReversalAndNoMoveOfUpToThreeGains) {
  Random random(12);
  for (int i = 0; i < 60; ++i) {
    const std::vector<CutStop> cuts = RandomParts(random, 2 + i % 9);  // all are neighbours of all
    const CutOrder order = OrderCuts(cuts, {0, 0}, true);
    const std::size_t n = cuts.size();
    for (std::size_t a = 0; a < n; ++a) {
      for (std::size_t b = a + 1; b <= n; ++b) {
        const auto place = [](auto& list, std::size_t k) { return list.begin() + static_cast<long>(k); };
        std::vector<std::size_t> trial = order.sequence;
        std::reverse(place(trial, a), place(trial, b));
        EXPECT_GE(IdleOf(cuts, trial), order.idle_mm - 1e-6);
        for (std::size_t m = a + 1; m < b; ++m) {
          trial = order.sequence;
          std::rotate(place(trial, a), place(trial, m), place(trial, b));
          EXPECT_TRUE(std::min(m - a, b - m) > 3 || IdleOf(cuts, trial) >= order.idle_mm - 1e-6);
        }
      }
    }
  }
}

TEST(OrderLaw, OfUpToSevenCutsItIsWithinTwoPercentOfTheShortest) {
  Random random(13);
  for (int i = 0; i < 60; ++i) {
    const std::vector<CutStop> cuts = RandomParts(random, 1 + i % 7);
    std::vector<std::size_t> trial(cuts.size());
    std::iota(trial.begin(), trial.end(), std::size_t{0});
    double shortest = 1e300;
    do {
      shortest = std::min(shortest, IdleOf(cuts, trial));
    } while (std::next_permutation(trial.begin(), trial.end()));
    const double ours = OrderCuts(cuts, {0, 0}, true).idle_mm;
    EXPECT_GE(ours, shortest - 1e-6);
    EXPECT_LE(ours, 1.02 * shortest);
  }
}

TEST(Toolpath, TabsStandAwayFromCornersAndAsLongAsAsked) {
  const Drawing drawing = DrawingOf({Square(0, 0, 100)});
  const ContourSet set = FindContours(drawing, {});
  ToolpathOptions options;
  options.tab_count = 8;
  options.tab_mm = 0.7;
  const Toolpath toolpath = MakeToolpath(drawing, set, options);
  ASSERT_EQ(toolpath.cuts.size(), 1u);
  const Cut& cut = toolpath.cuts[0];
  ASSERT_EQ(cut.tabs.size(), 8u);
  for (const Tab& tab : cut.tabs) {
    EXPECT_NEAR(tab.to_mm - tab.from_mm, 0.7 + 0.8, 1e-12);  // the jet cuts half a kerf beyond each end
    double s = 0.0;
    for (const Piece& piece : cut.path) {  // a square's path: lines, and arcs rolled about its corners
      const bool apart = tab.from_mm >= s + Length(piece) || tab.to_mm <= s;
      EXPECT_TRUE(apart || !piece.is_arc());
      s += Length(piece);
    }
  }
}

TEST(Toolpath, ASkippedPartIsNotCutButKeptClearOf) {
  const Drawing drawing = DrawingOf({Square(0, 0, 50), Square(10, 10, 8), Square(50.5, 0, 50)});
  const ContourSet set = FindContours(drawing, {});
  ToolpathOptions options;
  const auto reasons = [&] {
    std::vector<std::string> list;
    for (const Finding& f : MakeToolpath(drawing, set, options).findings) {
      if (f.blocks) {
        list.emplace_back(f.reason);
      }
    }
    return list;
  };
  EXPECT_THAT(reasons(), testing::Contains("KERF_GOUGE"));
  options.skip_parts = {2};
  EXPECT_THAT(reasons(), testing::Contains("KERF_GOUGE"));  // part 1 would still cut into part 2
  options.kerf_mm = 0.2;
  const Toolpath toolpath = MakeToolpath(drawing, set, options);
  ASSERT_EQ(toolpath.cuts.size(), 2u);
  EXPECT_EQ(toolpath.cuts[0].part, 1);
  EXPECT_EQ(toolpath.cuts[1].part, 1);
  options.skip_parts = {3};
  EXPECT_THAT(reasons(), testing::ElementsAre("NO_SUCH_PART"));
}

// ---- programmed compensation ----

PartProgram Programmed(const std::string& text, double offset_mm) {
  PartProgram program = ReadGcode(text);
  bool on = false;
  for (Operation& o : program.operations) {  // the dwell marks where compensation begins and ends
    on ^= o.kind == OperationKind::kDwell;
    const bool motion = o.kind == OperationKind::kTraverse || o.kind == OperationKind::kFeedLine ||
                        o.kind == OperationKind::kFeedArc;
    o.kerf_offset_mm = on && motion ? offset_mm : 0.0;
  }
  return program;
}

TEST(KerfLaw, ProgrammedContourIsFollowedAtTheOffset) {
  const PartProgram program =
      CompensateKerf(Programmed("G0 X-10 Y5\nF600\nG4 P0\nG1 X0 Y0\nG1 X20\nG3 X25 Y5 I0 J5\nG1 Y20\nG1 "
                                "X0\nG1 Y0\nG4 P0\nG1 X-10 Y-5\nM2\n",
                                -0.4));
  ASSERT_TRUE(program.faults.empty()) << program.faults[0].message;
  std::vector<Vector2d> ends;
  for (const Operation& o : program.operations) {
    if (o.kind == OperationKind::kFeedLine || o.kind == OperationKind::kFeedArc) {
      ends.push_back({o.x_W_mm, o.y_W_mm});
    }
  }
  // Entry beside its own end is trimmed by nothing: the corner there is rolled, as LinuxCNC does.
  const Vector2d entry = Vector2d(10, -5).normalized();
  EXPECT_NEAR((ends[0] - 0.4 * Vector2d(entry.y(), -entry.x())).norm(), 0.0, 1e-9);
  EXPECT_THAT(ends[1].x(), testing::DoubleNear(0.0, 1e-9));
  EXPECT_THAT(ends[1].y(), testing::DoubleNear(-0.4, 1e-9));
  EXPECT_THAT(ends[3].x(), testing::DoubleNear(25.4, 1e-9));
  EXPECT_EQ(ends.back(), Vector2d(-10, -5));
}

TEST(KerfLaw, WhatCannotBeCutIsNamedWithItsLine) {
  const auto reason = [](const std::string& text, double offset) {
    const PartProgram p = CompensateKerf(Programmed(text, offset));
    return p.faults.empty() ? std::string("NONE")
                            : std::string(p.faults[0].reason) + " " + std::to_string(p.faults[0].line);
  };
  const std::string enter = "G0 X-10 Y0\nF600\nG4 P0\nG1 X0 Y0\n";
  EXPECT_EQ(reason("G0 X-0.3 Y0\nF600\nG4 P0\nG1 X0 Y0\nG1 X10\nM2\n", 0.4), "KERF_ENTRY_TOO_SHORT 4");
  EXPECT_EQ(reason(enter + "G1 X20\nG3 X20 Y0.6 I0 J0.3\nG1 X0\nM2\n", 0.4), "RADIUS_BELOW_KERF 6");
  EXPECT_EQ(reason(enter + "G1 X20\nG1 Y0.5\nG1 X0\nM2\n", 0.4), "KERF_GOUGE 6");
  EXPECT_EQ(reason(enter + "G1 X20\nG4 P0\nG3 X30 Y10 I0 J10\nM2\n", 0.4), "KERF_EXIT_NOT_STRAIGHT 7");
  // A waist narrower than the kerf between far walls of one closed contour.
  EXPECT_EQ(reason("G0 X-5 Y5\nF600\nG4 P0\nG1 X0 Y5\nG1 Y0\nG1 X10\nG1 X12 Y4.8\nG1 X14 Y0\nG1 X24\nG1 "
                   "Y10\nG1 X14\nG1 X12 Y5.3\n"
                   "G1 X10 Y10\nG1 X0\nG1 Y5\nM2\n",
                   0.4)
                .substr(0, 10),
            "KERF_GOUGE");
  // Begun in an inner corner, the path runs into the contour where it closes; begun outside, it does not.
  EXPECT_EQ(reason(enter + "G1 X20\nG1 Y20\nG1 X0\nG1 Y0\nG4 P0\nG1 X-10\nM2\n", 0.4), "KERF_GOUGE 5");
  EXPECT_EQ(reason(enter + "G1 X20\nG1 Y20\nG1 X0\nG1 Y0\nG4 P0\nG1 X-10\nM2\n", -0.4), "NONE");
}

// ---- start from a line ----

TEST(StartFromLineLaw, RestoredStateIsTheReplayedOneAtEveryLine) {
  const std::string text =
      "G21 G90 G54\nG10 L2 P2 X30 Y40\nG64 P0.05\nG0 X10 Y10\nM3\nF1200\nG1 X50\nM9\nG1 "
      "Y50\nM5\nG55\nG91\nG0 X5 Y5\n"
      "M8 M67 E0 Q320\nM62 P0\nG20\nF50\nG1 X1\nG3 X1 Y1 I0 J1\nM63 P1\nM5\nG61\nG90 G54 G21\nG0 X0 Y0\nM101 "
      "P3\nG1 "
      "X100\nM102\nM2\n";
  const PartProgram program = ReadGcode(text);
  ASSERT_TRUE(program.faults.empty()) << program.faults[0].message;
  for (std::uint32_t line = 1; line < program.line_count; ++line) {
    const LineStart start = StartFromLine(program.operations, line);
    if (!start.reason.empty()) {
      EXPECT_GE(line, 28u);
      continue;
    }
    const std::vector<Operation> restored(start.operations.begin(),
                                          start.operations.begin() + static_cast<long>(start.restored_count));
    EXPECT_EQ(ReplayModalState(restored), start.state) << "line " << line;
    EXPECT_EQ(ReplayModalState(program.operations, line), start.state) << "line " << line;
    EXPECT_EQ(ReplayModalState(start.operations), ReplayModalState(program.operations)) << "line " << line;
  }
  EXPECT_EQ(StartFromLine(program.operations, 99).reason, "LINE_NOT_IN_PROGRAM");
}

TEST(StartFromLineLaw, WrittenOutItIsTheRestOfTheProgram) {
  const PartProgram program = ReadGcode(
      "G20 G91\nG10 L2 P1 X1 Y2\nG54\nF40\nG0 X1 Y1\nM3 P0.5\nG1 X2\nG3 X0 Y0 I1 J0 P2\nG2 X1 Y1 R1\nG64 "
      "P0.001\nM9\nG1 Y1\nM8\n"
      "M5\nG4 P1 M67 E0 Q200.5\nM0 M66 P1 L4 Q2\nG0 X1\nM62 P0\nG1 X1\nM5\nM2\n");
  ASSERT_TRUE(program.faults.empty()) << program.faults[0].message;
  for (std::uint32_t line = 1; line <= 19; ++line) {
    const LineStart start = StartFromLine(program.operations, line);
    const std::string text = WriteGcode(start.operations, "rest");
    const PartProgram rest = ReadGcode(text);
    ASSERT_TRUE(rest.faults.empty()) << "line " << line << ": " << rest.faults[0].reason << " "
                                     << rest.faults[0].message << text;
    const auto worked = [](const std::vector<Operation>& list) {
      std::vector<Operation> kept;
      std::copy_if(list.begin(), list.end(), std::back_inserter(kept), [](const Operation& o) {
        return o.kind != OperationKind::kUnitsChange && o.kind != OperationKind::kDistanceChange &&
               o.kind != OperationKind::kWorkOffsetChange && o.kind != OperationKind::kFeedChange;
      });
      return kept;
    };
    const auto a = worked(start.operations), b = worked(rest.operations);
    ASSERT_EQ(a.size(), b.size()) << "line " << line;
    for (std::size_t i = 0; i < a.size(); ++i) {
      EXPECT_EQ(a[i].kind, b[i].kind);
      if (a[i].kind == OperationKind::kTraverse || a[i].kind == OperationKind::kFeedLine ||
          a[i].kind == OperationKind::kFeedArc) {
        EXPECT_NEAR(a[i].x_W_mm, b[i].x_W_mm, 1e-6);
        EXPECT_NEAR(a[i].y_W_mm, b[i].y_W_mm, 1e-6);
      }
      EXPECT_NEAR(a[i].sweep_rad, b[i].sweep_rad, 1e-6);
      EXPECT_EQ(a[i].condition, b[i].condition);
    }
  }
}

}  // namespace
}  // namespace lambdajet::trajectory
