#include "clients/cli/trajectory_drawing_picture.hpp"

#include <algorithm>
#include <cmath>

#include "clients/cli/output.hpp"
#include "clients/cli/picture.hpp"

namespace lambdajet::cli {
namespace {

using trajectory::Box;
using trajectory::Cut;
using trajectory::CutKind;
using trajectory::Finding;
using trajectory::Piece;
using trajectory::Pieces;

constexpr double kDrawingWidth_px = 1620.0;
constexpr double kPlanWidth_px = 1180.0;
constexpr double kDetail_px = 400.0;
constexpr Colour kWhite{1.0, 1.0, 1.0};
constexpr Colour kSheet{0.91, 0.93, 0.95};
constexpr double kHeight_px = 900.0;
constexpr double kPointEvery_rad = 0.05;

// `every_mm` above 0: points so close that a frame can cut the line off at its edge.
void Append(const Piece& piece, Points& points, double every_mm = 0.0) {
  int steps = piece.is_arc() ? std::max(2, static_cast<int>(std::abs(piece.sweep_rad) / kPointEvery_rad)) : 1;
  if (every_mm > 0.0) {
    steps = std::max(steps, static_cast<int>(Length(piece) / every_mm));
  }
  for (int i = points.empty() ? 0 : 1; i <= steps; ++i) {
    const Eigen::Vector2d p = PointAt(piece, static_cast<double>(i) / steps);
    points.push_back({p.x(), p.y()});
  }
}

Points PointsOf(const Pieces& pieces, double every_mm = 0.0) {
  Points points;
  for (const Piece& piece : pieces) {
    Append(piece, points, every_mm);
  }
  return points;
}

// The path without its tabs.
void DrawCut(PlotFrame& frame, const Cut& cut) {
  const Colour colour = cut.kind == CutKind::kMark ? kViolet : kBlue;
  Points run;
  double s = 0.0;
  std::size_t tab = 0;
  bool off = false;
  const auto flush = [&] {
    if (!off && run.size() > 1) {
      frame.Line(run, colour, 1.4);
    }
    run.clear();
  };
  for (Piece piece : cut.path) {
    while (tab < cut.tabs.size()) {
      const double edge = off ? cut.tabs[tab].to_mm : cut.tabs[tab].from_mm, length = Length(piece);
      if (edge >= s + length) {
        break;
      }
      const double share = std::max(0.0, (edge - s) / length);
      Append(Part(piece, 0.0, share), run);
      flush();
      tab += off ? 1 : 0;
      off = !off;
      piece = Part(piece, share, 1.0);
      s = edge;
    }
    Append(piece, run);
    s += Length(piece);
  }
  flush();
}

Eigen::Vector2d Placed(const trajectory::ContourSet& contours, const Eigen::Vector2d& drawn_mm) {
  return contours.placed.linear * drawn_mm + contours.placed.offset;
}

void DrawFindings(PlotFrame& frame, const trajectory::ContourSet& contours,
                  const std::vector<Finding>& findings) {
  for (const Finding& finding : findings) {
    if (finding.blocks) {
      const Eigen::Vector2d at_mm = Placed(contours, finding.at_mm);
      frame.Dot(at_mm.x(), at_mm.y(), 6.0, kRed.Faded(0.6));
      frame.Text(at_mm.x(), at_mm.y(), std::string(finding.reason), kRed, 8.0, -8.0);
    }
  }
}

// Parts shaded, what is cut out of them white; the drawing's lines over it.
void DrawContours(PlotFrame& frame, const trajectory::ContourSet& contours) {
  int deepest = 0;
  for (const trajectory::Contour& contour : contours.contours) {
    deepest = std::max(deepest, contour.depth);
  }
  for (int depth = 0; depth <= deepest; ++depth) {
    for (const trajectory::Contour& contour : contours.contours) {
      if (contour.depth == depth) {
        frame.Area(PointsOf(contour.pieces), contour.hole ? kWhite : kSheet);
      }
    }
  }
  for (const trajectory::Contour& contour : contours.contours) {
    frame.Line(PointsOf(contour.pieces), kInk, 0.8);
  }
}

// What is too small to see on the whole: the kerf's half between path and contour, the lead, the overlap; or the first fault.
void DrawDetail(Picture& picture, const trajectory::ContourSet& contours,
                const trajectory::Toolpath& toolpath, const Eigen::Vector2d& at, double half_mm,
                const std::string& title) {
  constexpr int kPointsAcross = 1500;
  PlotFrame frame(picture, {kDrawingWidth_px - kDetail_px - 20.0, 40.0, kDetail_px, kDetail_px},
                  {at.x() - half_mm, at.x() + half_mm, "x in W, mm"},
                  {at.y() - half_mm, at.y() + half_mm, ""}, title, true);
  Box window;
  window.Add(Eigen::Vector2d(at.x() - half_mm, at.y() - half_mm));
  window.Add(Eigen::Vector2d(at.x() + half_mm, at.y() + half_mm));
  const auto draw = [&](const Pieces& pieces, Colour colour, double width_px) {
    for (const Piece& piece : pieces) {
      if (BoxOf(piece).Near(window, 0.0)) {
        frame.Line(PointsOf({piece}, 2.0 * half_mm / kPointsAcross), colour, width_px);
      }
    }
  };
  for (const trajectory::Contour& contour : contours.contours) {
    draw(contour.pieces, kInk, 1.4);
  }
  if (toolpath.cuts.empty()) {
    frame.Dot(at.x(), at.y(), 6.0, kRed.Faded(0.6));
    return;
  }
  const Cut& cut = toolpath.cuts.back();
  draw(cut.path, kBlue, 1.8);
  draw(cut.lead_in, kOrange, 2.2);
  draw(cut.lead_out, kGreen, 2.2);
  frame.Dot(cut.pierce().x(), cut.pierce().y(), 5.0, kRed);
}

void ChooseDetail(Picture& picture, const trajectory::ContourSet& contours,
                  const trajectory::Toolpath& toolpath, double kerf_mm) {
  const double least_mm = 6.0 * std::max(kerf_mm, 0.2);
  if (!toolpath.cuts.empty()) {
    const Cut& cut = toolpath.cuts.back();
    DrawDetail(picture, contours, toolpath, cut.path.front().from_mm,
               std::max(1.5 * Length(cut.lead_in), least_mm), "the last cut's lead");
    return;
  }
  for (const auto* findings : {&contours.findings, &toolpath.findings}) {
    for (const Finding& finding : *findings) {
      if (finding.blocks && !finding.entity.empty()) {
        DrawDetail(picture, contours, toolpath, Placed(contours, finding.at_mm), least_mm,
                   std::string(finding.reason));
        return;
      }
    }
  }
}

Box BoxOfAll(const trajectory::ContourSet& contours, const trajectory::Toolpath& toolpath) {
  Box box;
  for (const trajectory::Contour& contour : contours.contours) {
    box.Add(BoxOf(contour.pieces));
  }
  for (const Pieces& mark : contours.marks) {
    box.Add(BoxOf(mark));
  }
  for (const Cut& cut : toolpath.cuts) {
    box.Add(cut.pierce());
    box.Add(cut.end());
  }
  if (box.low_mm.x() > box.high_mm.x()) {
    box.Add(Eigen::Vector2d(0, 0));
    box.Add(Eigen::Vector2d(1, 1));
  }
  return box;
}

}  // namespace

absl::Status DrawToolpath(const trajectory::ContourSet& contours, const trajectory::Toolpath& toolpath,
                          const trajectory::ToolpathOptions& options, const std::string& path) {
  Picture picture(kDrawingWidth_px, kHeight_px);
  const Box box = BoxOfAll(contours, toolpath);
  const Eigen::Vector2d margin = Eigen::Vector2d::Constant(0.04 * (box.high_mm - box.low_mm).maxCoeff());
  const Eigen::Vector2d low = box.low_mm - margin, high = box.high_mm + margin;
  PlotFrame frame(picture, {70.0, 40.0, kPlanWidth_px - 100.0, kHeight_px - 110.0},
                  {low.x(), high.x(), "x in W, mm"}, {low.y(), high.y(), "y in W, mm"},
                  "parts " + std::to_string(contours.part_count) + ", cuts " +
                      std::to_string(toolpath.cuts.size()) + ", idle " + Fixed(toolpath.idle_mm, 0) +
                      " mm (in the drawing's order " + Fixed(toolpath.drawing_idle_mm, 0) + ")",
                  true);
  DrawContours(frame, contours);
  Eigen::Vector2d at = options.home_W_mm;
  for (const Cut& cut : toolpath.cuts) {
    frame.Line({{at.x(), at.y()}, {cut.pierce().x(), cut.pierce().y()}}, kGrey.Faded(0.6), 0.8, true);
    at = cut.end();
  }
  int number = 0;
  for (const Cut& cut : toolpath.cuts) {
    DrawCut(frame, cut);
    frame.Line(PointsOf(cut.lead_in), kOrange, 1.6);
    frame.Line(PointsOf(cut.lead_out), kGreen, 1.6);
    frame.Dot(cut.pierce().x(), cut.pierce().y(), 2.6, kRed);
    frame.Text(cut.pierce().x(), cut.pierce().y(), std::to_string(++number), kInk, 4.0, -4.0, 11.0);
  }
  DrawFindings(frame, contours, contours.findings);
  DrawFindings(frame, contours, toolpath.findings);
  frame.Legend({{"drawing", kInk},
                {"path of the jet", kBlue},
                {"lead-in, pierce", kOrange},
                {"lead-out", kGreen},
                {"idle", kGrey}},
               true);
  ChooseDetail(picture, contours, toolpath, options.kerf_mm);
  return picture.Write(path);
}

}  // namespace lambdajet::cli
