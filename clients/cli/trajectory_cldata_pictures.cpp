#include "clients/cli/trajectory_cldata_pictures.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "clients/cli/output.hpp"
#include "clients/cli/picture.hpp"

namespace lambdajet::cli {
namespace {

using trajectory::PilgerDie;
using trajectory::PilgerProgram;
using trajectory::ProgramVerification;
using trajectory::VerifyArgument;

constexpr double kShownDegPerRad = 180.0 / std::numbers::pi;
constexpr double kSheetWidth_px = 1500.0;
constexpr double kLeft_px = 80.0;
constexpr double kGap_px = 90.0;
constexpr double kPanel_px = 240.0;

std::pair<double, double> RangeOf(const std::vector<double>& values) {
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  const double margin = 0.06 * std::max(*high - *low, 1e-9 + 1e-6 * std::abs(*high));
  return {*low - margin, *high + margin};
}

// More than two turns lie over each other.
bool Wraps(const ProgramVerification& v) {
  return v.over == VerifyArgument::kTurn && v.arguments.back() - v.arguments.front() > 4.0 * std::numbers::pi;
}

double DrawnArgument(const ProgramVerification& v, double argument, bool wraps) {
  if (v.over != VerifyArgument::kTurn) {
    return argument;
  }
  const double deg = argument * kShownDegPerRad;
  return wraps ? deg - 360.0 * std::floor((deg + 20.0) / 360.0) : deg;
}

void DrawSeries(PlotFrame& frame, const ProgramVerification& v, const std::vector<double>& values,
                bool wraps) {
  Points line;
  std::size_t piece = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const bool begins = piece < v.begins.size() && v.begins[piece] == i;
    const double x = DrawnArgument(v, v.arguments[i], wraps);
    piece += begins ? 1 : 0;
    if (begins || (!line.empty() && x < line.back().first)) {
      frame.Line(line, kBlue.Faded(0.75), 1.1);
      line.clear();
    }
    line.push_back({x, values[i]});
  }
  frame.Line(line, kBlue.Faded(0.75), 1.1);
}

double ValueNear(const ProgramVerification& v, const std::vector<double>& values, double argument) {
  const auto at = std::lower_bound(v.arguments.begin(), v.arguments.end(), argument - 1e-9);
  return at == v.arguments.end() ? values.back() : values[static_cast<std::size_t>(at - v.arguments.begin())];
}

Axis ArgumentAxis(const ProgramVerification& v, bool wraps) {
  if (v.over != VerifyArgument::kTurn) {
    return {v.arguments.front(), v.arguments.back(), "path length, mm"};
  }
  return wraps ? Axis{-20.0, 340.0, "C, deg (turns over each other)"}
               : Axis{v.arguments.front() * kShownDegPerRad, v.arguments.back() * kShownDegPerRad, "C, deg"};
}

}  // namespace

absl::Status DrawVerification(const ProgramVerification& v, const std::string& path) {
  if (v.arguments.empty()) {
    return absl::InvalidArgumentError("the program has no motion to draw");
  }
  const double columns = static_cast<double>(v.series.size());
  const double width = (kSheetWidth_px - kLeft_px - 30.0 - (columns - 1.0) * kGap_px) / columns;
  Picture picture(kSheetWidth_px, 3.0 * (kPanel_px + 90.0) + 40.0);
  const bool wraps = Wraps(v), turn = v.over == VerifyArgument::kTurn;
  for (std::size_t k = 0; k < v.series.size(); ++k) {
    const auto& s = v.series[k];
    const std::array<const std::vector<double>*, 3> rows = {&s.values, &s.first, &s.second};
    const std::string unit = s.name.substr(s.name.rfind(' ') + 1), by = turn ? "rad" : "mm";
    const std::array<std::string, 3> titles = {
        s.name,
        std::string("first derivative by ") + (turn ? "C" : "path") + ", " + unit + "/" + by + ": peak " +
            Fixed(s.peak_first, 4),
        "second derivative, " + unit + "/" + by + "²: peak " + Fixed(s.peak_second, 4)};
    for (std::size_t row = 0; row < 3; ++row) {
      const auto [low, high] = RangeOf(*rows[row]);
      PlotFrame frame(picture,
                      {kLeft_px + static_cast<double>(k) * (width + kGap_px),
                       40.0 + static_cast<double>(row) * (kPanel_px + 90.0), width, kPanel_px},
                      ArgumentAxis(v, wraps), {low, high, ""}, titles[row]);
      DrawSeries(frame, v, *rows[row], wraps);
      for (const auto& b : v.breaks) {
        if (b.coordinate == k && static_cast<std::size_t>(b.order) == row) {
          frame.Dot(DrawnArgument(v, b.argument, wraps), ValueNear(v, *rows[row], b.argument), 3.5, kRed);
        }
      }
    }
  }
  return picture.Write(path);
}

namespace {

// The section of the groove at phi, seen along the die's motion: x, and radius minus the die's.
Points SectionOf(const PilgerDie& die, double phi) {
  const double a = die.groove.width.At(phi)[0], b = die.groove.depth.At(phi)[0];
  Points points = {{-1.35 * a, 0.0}};
  for (int i = -90; i <= 90; i += 2) {
    points.push_back({a * std::sin(i / kShownDegPerRad), -b * std::cos(i / kShownDegPerRad)});
  }
  points.push_back({1.35 * a, 0.0});
  return points;
}

// The rim of the wheel at a contact, as it looks in the plane of X and Z: a stadium's end along the normal.
Points RimOf(const PilgerDie& die, double phi, double alpha, double depth_mm) {
  const auto pose = PoseAt(die.groove, die.wheel, phi, alpha);
  const double reach = die.wheel.radius_mm - die.wheel.profile_radius_mm, round = die.wheel.profile_radius_mm;
  const double out_x = std::sin(pose.a_rad.value), out_z = std::cos(pose.a_rad.value);
  const double x = pose.x_mm.value - reach * out_x,
               z = pose.z_mm.value - reach * out_z - die.groove.die_radius_mm;
  Points points = {{x + round * out_z + depth_mm * out_x, z - round * out_x + depth_mm * out_z}};
  for (int i = 0; i <= 36; ++i) {
    const double turn = std::numbers::pi * i / 36.0, along = std::cos(turn) * round,
                 down = std::sin(turn) * round;
    points.push_back({x + along * out_z - down * out_x, z - along * out_x - down * out_z});
  }
  points.push_back({x - round * out_z + depth_mm * out_x, z + round * out_x + depth_mm * out_z});
  return points;
}

void DrawSection(Picture& picture, double left_px, const PilgerProgram& program, const PilgerDie& die,
                 double phi) {
  const double a = die.groove.width.At(phi)[0], b = die.groove.depth.At(phi)[0];
  PlotFrame frame(
      picture, {left_px, 40.0, 420.0, 330.0}, {-1.35 * a, 1.35 * a, "x along the die's axis, mm"},
      {-1.15 * b, 1.0 * b, "above the die's cylinder, mm"},
      "section at " + Fixed(phi * kShownDegPerRad, 1) + " deg: " + Fixed(a, 2) + " x " + Fixed(b, 2) + " mm",
      true);
  const std::size_t middle = program.passes.size() / 2;
  for (const auto& [pass, colour] : {std::pair{std::size_t{0}, kOrange}, std::pair{middle, kGreen},
                                     std::pair{program.passes.size() - 1, kViolet}}) {
    const Points rim = RimOf(die, phi, program.passes[pass].alpha_rad, 0.9 * b);
    frame.Area(rim, colour.Faded(0.12));
    frame.Line(rim, colour, 1.2);
  }
  frame.Line(SectionOf(die, phi), kInk, 1.8);
  for (const auto& pass : program.passes) {
    frame.Dot(a * std::sin(pass.alpha_rad), -b * std::cos(pass.alpha_rad), 2.2, kBlue);
  }
}

struct AxisCurve {
  const char* title;
  double trajectory::GrindingPoint::*value;
  double scale;
};

// Three turns from the middle of the program: cutting in blue, idle in orange.
void DrawAxis(Picture& picture, double top_px, const PilgerProgram& program, const AxisCurve& curve) {
  const std::size_t shown = std::min<std::size_t>(3, program.passes.size());
  const std::size_t first = (program.passes.size() - shown) / 2;
  const double from = program.passes[first].c_from_rad;
  const double to = first + shown < program.passes.size() ? program.passes[first + shown].c_from_rad
                                                          : program.passes.back().c_to_rad;
  std::vector<double> values;
  std::vector<std::pair<Points, bool>> pieces;
  for (const auto& p : program.points) {
    if (p.c_rad < from - 1e-9 || p.c_rad > to + 1e-9) {
      continue;
    }
    const std::pair<double, double> at{p.c_rad * kShownDegPerRad, p.*curve.value * curve.scale};
    values.push_back(at.second);
    if (pieces.empty() || pieces.back().second != p.cutting) {
      if (!pieces.empty()) {
        pieces.back().first.push_back(at);
      }
      pieces.push_back({pieces.empty() ? Points{} : Points{pieces.back().first.back()}, p.cutting});
    }
    pieces.back().first.push_back(at);
  }
  const auto [low, high] = RangeOf(values);
  PlotFrame frame(picture, {kLeft_px, top_px, kSheetWidth_px - kLeft_px - 30.0, 190.0},
                  {from * kShownDegPerRad, to * kShownDegPerRad, "C, deg"}, {low, high, ""}, curve.title);
  for (const auto& [points, cutting] : pieces) {
    frame.Line(points, cutting ? kBlue : kOrange, 1.8);
  }
  frame.Legend({{"cutting", kBlue}, {"idle", kOrange}}, true);
}

}  // namespace

absl::Status DrawPilger(const PilgerProgram& program, const PilgerDie& die, const std::string& path) {
  Picture picture(kSheetWidth_px, 1250.0);
  DrawSection(picture, kLeft_px, program, die, 0.0);
  DrawSection(picture, kLeft_px + 490.0, program, die, 0.5 * die.groove.zone_rad);
  DrawSection(picture, kLeft_px + 980.0, program, die, die.groove.zone_rad);
  const std::array<AxisCurve, 3> curves = {
      {{"X of the wheel's centre, mm", &trajectory::GrindingPoint::x_mm, 1.0},
       {"Z of the wheel's centre, mm", &trajectory::GrindingPoint::z_mm, 1.0},
       {"A of the wheel, deg", &trajectory::GrindingPoint::a_rad, kShownDegPerRad}}};
  for (std::size_t k = 0; k < curves.size(); ++k) {
    DrawAxis(picture, 460.0 + 265.0 * static_cast<double>(k), program, curves[k]);
  }
  return picture.Write(path);
}

}  // namespace lambdajet::cli
