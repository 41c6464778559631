#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include "clients/cli/kinematics_hexapod.hpp"
#include "clients/cli/picture.hpp"
#include "clients/cli/picture_option.hpp"
#include "foundation/contract/trouble.hpp"
#include "kinematics/core/hexapod_singularity.hpp"
#include "kinematics/core/service_rectangle.hpp"
#include "platform/machine_file/hexapod_file.hpp"

namespace lambdajet::cli {
namespace {

using namespace lambdajet::kinematics;

constexpr double kDeg = M_PI / 180.0;

// --- Service area.

// The region as thin upright strips; one polygon a run of strips with one span.
void FillRegion(PlotFrame& frame, const ServiceAreaMachine& machine, ServiceRegion region, Colour colour) {
  const double step = (frame.x().to - frame.x().from) / 700.0;
  for (double x = frame.x().from; x < frame.x().to; x += step) {
    const ServiceSpans spans = RegionAt(machine, region, x + 0.5 * step);
    for (int i = 0; i < spans.count; ++i) {
      frame.Area({{x, spans.from_y_mm[i]},
                  {x + step, spans.from_y_mm[i]},
                  {x + step, spans.to_y_mm[i]},
                  {x, spans.to_y_mm[i]}},
                 colour);
    }
  }
}

void DrawArc(PlotFrame& frame, ServicePoint centre, double radius, Colour colour, bool dashed) {
  Points arc;
  for (int i = 0; i <= 360; ++i) {
    const double t = M_PI * i / 360.0;
    arc.emplace_back(centre.x_mm + radius * std::cos(t), centre.y_mm + radius * std::sin(t));
  }
  frame.Line(arc, colour, 1.2, dashed);
}

void DrawMachineFrame(PlotFrame& frame, const ServiceAreaMachine& m) {
  const double axis = m.base_joint_spacing_mm / 2;
  const double top = m.frame_top_ratio * m.base_joint_spacing_mm / 2;
  const double bottom = m.frame_bottom_ratio * m.base_joint_spacing_mm / 2;
  frame.Line({{axis - top, 0},
              {axis - bottom, m.height_mm},
              {axis + bottom, m.height_mm},
              {axis + top, 0},
              {axis - top, 0}},
             kInk, 2.0);
  frame.Line({{axis, 0}, {axis, m.height_mm}}, kGrey, 0.8, true);
  for (const double joint : {0.0, m.base_joint_spacing_mm}) {
    frame.Dot(joint, 0, 5, kInk);
  }
}

PlotFrame ServiceFrame(Picture& picture, PlotFrame::Place place, const ServiceAreaMachine& m,
                       const std::string& title) {
  const double axis = m.base_joint_spacing_mm / 2;
  const double half = 0.55 * std::max(m.frame_top_ratio, m.frame_bottom_ratio) * m.base_joint_spacing_mm;
  return PlotFrame(picture, place, {axis - half, axis + half, "x, mm from base joint 1"},
                   {-0.06 * m.height_mm, 1.1 * m.height_mm, "y, mm down from the base"}, title, true, true);
}

// One of S1 to S4: between two curves over [from, to], as the closed form integrates it.
template <class Upper, class Lower>
void FillPart(PlotFrame& frame, ServicePoint origin, double from, double to, const Upper& upper,
              const Lower& lower, Colour colour, const std::string& name) {
  Points outline;
  constexpr int kPieces = 120;
  for (int i = 0; i <= kPieces; ++i) {
    const double x = from + (to - from) * i / kPieces;
    outline.emplace_back(origin.x_mm + x, origin.y_mm + lower(x));
  }
  for (int i = kPieces; i >= 0; --i) {
    const double x = from + (to - from) * i / kPieces;
    outline.emplace_back(origin.x_mm + x, origin.y_mm + upper(x));
  }
  frame.Area(outline, colour.Faded(0.45));
  const double x = 0.5 * (from + to);
  const bool narrow = std::abs(frame.X(to) - frame.X(from)) < 24.0;  // then the name stands to the left of it
  frame.Text(origin.x_mm + x, origin.y_mm + 0.5 * (upper(x) + lower(x)), name, kInk, narrow ? -34 : -8, 5,
             14);
}

double HalfCircle(double radius, double centre_x, double x) {
  return std::sqrt(std::max(0.0, radius * radius - (x - centre_x) * (x - centre_x)));
}

void DrawClosedForm(PlotFrame& frame, const ServiceAreaMachine& m, const PaperServiceArea& p) {
  const ServicePoint origin = ClosedFormOrigin(m);
  const double s = std::sin(m.tilt_rad);
  const double X = m.base_joint_spacing_mm - m.platform_joint_spacing_mm * std::cos(m.tilt_rad);
  const double bs = m.platform_joint_spacing_mm * s;
  const double lever = 2 * m.tool_length_mm * s;
  const auto outer_1 = [&](double x) { return HalfCircle(m.strut_max_mm, X, x) - bs; };
  const auto outer_2 = [&](double x) { return HalfCircle(m.strut_max_mm, X + lever, x); };
  const auto inner = [&](double x) { return HalfCircle(m.strut_min_mm, lever, x) - bs; };
  const auto wall = [&](double x) { return p.y_M_mm + p.k * (x - p.x_M_mm); };
  const auto table = [&](double) { return p.y_D_mm; };
  FillPart(frame, origin, p.x_A_mm, p.x_E_mm, outer_2, inner, kBlue, "S1");
  FillPart(frame, origin, p.x_E_mm, p.x_K_mm, outer_1, inner, kGreen, "S2");
  FillPart(frame, origin, p.x_B_mm, p.x_A_mm, outer_2, wall, kOrange, "S3");
  if (p.x_D_mm < p.x_K_mm) {
    FillPart(frame, origin, p.x_D_mm, p.x_K_mm, outer_1, table, kRed, "S4");
  }
  const auto mark = [&](double x, double y, const char* name, double dx_px = 6.0, double dy_px = -5.0) {
    frame.Dot(origin.x_mm + x, origin.y_mm + y, 3.2, kInk);
    frame.Text(origin.x_mm + x, origin.y_mm + y, name, kInk, dx_px, dy_px);
  };
  mark(p.x_A_mm, wall(p.x_A_mm), "A");
  mark(p.x_B_mm, wall(p.x_B_mm), "B");
  mark(p.x_E_mm, outer_2(p.x_E_mm), "E", -17.0, 12.0);
  mark(p.x_K_mm, inner(p.x_K_mm), "K");
  mark(p.x_M_mm, p.y_M_mm, "M");
  if (p.x_D_mm < p.x_K_mm) {
    mark(p.x_D_mm, p.y_D_mm, "D", 6.0, 16.0);
  }
}

std::string SquareMetres(double mm2) { return fmt::format("{:.4f} m\u00b2", mm2 * 1e-6); }

void DrawRectangle(PlotFrame& frame, const Rectangle& r) {
  frame.Line({{r.x_min_mm, r.y_min_mm},
              {r.x_max_mm, r.y_min_mm},
              {r.x_max_mm, r.y_max_mm},
              {r.x_min_mm, r.y_max_mm},
              {r.x_min_mm, r.y_min_mm}},
             kInk, 1.5);
}

std::string BoundOf(const char* side, const ServiceBound& bound) {
  if (bound.joint == 0) {
    return fmt::format("{}: {}", side, ServiceLimitSentence(bound.limit));
  }
  return fmt::format("{}: strut {} at its {} at {}phi", side, bound.joint,
                     bound.limit == ServiceLimit::kStrutLongest ? "longest" : "shortest",
                     bound.tilt_sign > 0 ? "+" : "-");
}

// The rectangle in the region that both tilts serve, and under the picture what binds its sides.
void DrawServiceRectangle(Picture& picture, PlotFrame& frame, const ServiceAreaMachine& m) {
  const ServiceRectangle found = LargestServiceRectangle(m);
  const Rectangle& r = found.rectangle;
  if (!(r.area_mm2() > 0.0)) {
    return;
  }
  DrawRectangle(frame, r);
  picture.Text(
      680, 626,
      fmt::format("largest rectangle {:.0f} x {:.0f} mm", r.x_max_mm - r.x_min_mm, r.y_max_mm - r.y_min_mm),
      12, kGrey);
  picture.Text(680, 642, BoundOf("left", found.binding[0]) + "; " + BoundOf("right", found.binding[1]), 12,
               kGrey);
  picture.Text(680, 658, BoundOf("above", found.binding[2]) + "; " + BoundOf("below", found.binding[3]), 12,
               kGrey);
}

absl::Status DrawServiceArea(const std::vector<std::string>& settings, const std::string& path) {
  const auto machine = ServiceMachineOf(settings);
  if (!machine.ok()) {
    return machine.status();
  }
  const ServiceAreaMachine& m = *machine;
  const PaperServiceArea paper = PaperClosedForm(m);
  Picture picture(1240, 672);
  PlotFrame left =
      ServiceFrame(picture, {70, 60, 520, 480}, m,
                   "The paper's parts (Fig. 2), left half; closed form " +
                       (paper.defined ? SquareMetres(paper.area_mm2) : std::string("undefined")));
  for (const int tilt : {1, -1}) {
    for (const int joint : {1, 2}) {
      DrawArc(left, ArcCentre(m, joint, tilt), m.strut_max_mm, kGrey, tilt < 0);
      DrawArc(left, ArcCentre(m, joint, tilt), m.strut_min_mm, kGrey, tilt < 0);
    }
  }
  if (paper.defined) {
    DrawClosedForm(left, m, paper);
  }
  DrawMachineFrame(left, m);
  picture.Text(70, 600,
               paper.in_order
                   ? "x_B <= x_A <= x_E <= x_D: the parts are the region. Solid arcs +phi, dashed -phi."
                   : "Not x_B <= x_A <= x_E <= x_D: parts run backwards. Solid arcs +phi, dashed -phi.",
               12, kGrey);
  PlotFrame right = ServiceFrame(picture, {680, 60, 520, 480}, m, "What is really served, exact areas");
  FillRegion(right, m, ServiceRegion::kUnion, Colour{0.80, 0.87, 0.95});
  FillRegion(right, m, ServiceRegion::kIntersection, Colour{0.42, 0.67, 0.48});
  DrawMachineFrame(right, m);
  DrawServiceRectangle(picture, right, m);
  const auto area = [&](ServiceRegion region) { return SquareMetres(ExactArea(m, region)); };
  picture.Text(680, 594,
               "dark: served at +phi and at -phi, " + area(ServiceRegion::kIntersection) +
                   "; pale: at one of them, " + area(ServiceRegion::kUnion),
               12, kGrey);
  picture.Text(680, 610, "the paper's region, exact: " + area(ServiceRegion::kPaper), 12, kGrey);
  return picture.Write(path);
}

void DrawSweep(Picture& picture, PlotFrame::Place place, const ServiceSweep& sweep) {
  constexpr int kSteps = 60;
  const bool tilt = sweep.parameter == ServiceParameter::kTilt;
  const double scale = tilt ? 1.0 / kDeg : 1.0;
  std::array<Points, 4> curves;
  double lowest = 1e9, highest = 0.0;
  for (int i = 0; i <= kSteps; ++i) {
    const double value = sweep.from + (sweep.to - sweep.from) * i / kSteps;
    const ServiceAreaMachine m = AtSweepValue(sweep, value);
    const std::array<double, 4> areas = {PaperClosedForm(m).area_mm2, ExactArea(m, ServiceRegion::kPaper),
                                         ExactArea(m, ServiceRegion::kIntersection),
                                         ExactArea(m, ServiceRegion::kUnion)};
    for (std::size_t c = 0; c < 4; ++c) {
      curves[c].emplace_back(value * scale, areas[c] * 1e-6);
      lowest = std::min(lowest, areas[c] * 1e-6);
      highest = std::max(highest, areas[c] * 1e-6);
    }
  }
  const double change = 100 * (curves[0].back().second / curves[0].front().second - 1);
  PlotFrame frame(
      picture, place,
      {sweep.from * scale, sweep.to * scale, tilt ? "tilt, deg" : std::string(sweep.parameter_name)},
      {0.93 * lowest, 1.03 * highest, "area, m\u00b2"},
      fmt::format("{}: printed {:+.1f} %, closed form {:+.2f} %", sweep.figure, sweep.printed_percent,
                  change));
  frame.Line(curves[3], kViolet, 1.6);
  frame.Line(curves[1], kOrange, 1.6, true);
  frame.Line(curves[0], kBlue, 2.4);
  frame.Line(curves[2], kGreen, 1.6);
}

absl::Status DrawSweeps(const std::string& path) {
  Picture picture(1260, 800);
  for (int i = 0; i < kServiceSweeps; ++i) {
    DrawSweep(picture, {75.0 + 410.0 * (i % 3), 70.0 + 360.0 * (i / 3), 310, 250}, PaperSweep(i));
  }
  double x = 75;
  for (const auto& [name, colour] : {std::pair{"closed form (the paper's curve)", kBlue},
                                     {"the paper's region, exact", kOrange},
                                     {"served at both tilts", kGreen},
                                     {"served at either tilt", kViolet}}) {
    picture.Line({{x, 770}, {x + 26, 770}}, colour, 3);
    picture.Text(x + 34, 774, name);
    x += 290;
  }
  picture.Text(75, 30, "Service area of two-sided tilted drilling, seed paper 002, Figs 3 to 8", 15);
  return picture.Write(path);
}

// --- Hexapod.

// Looks along (1, 2, -0.55) from above: right and up of the picture in M.
std::pair<double, double> Seen(const Eigen::Vector3d& p) {
  const Eigen::Vector3d look = Eigen::Vector3d(0.55, 1.0, -0.38).normalized();
  const Eigen::Vector3d right = look.cross(Eigen::Vector3d::UnitZ()).normalized();
  return {p.dot(right), p.dot(right.cross(look))};
}

Points SeenRing(const Pose& X, const StrutPoints& joints) {
  Points ring;
  for (int j = 0; j <= kStruts; ++j) {
    ring.push_back(Seen(X * Eigen::Vector3d(joints.col(j % kStruts))));
  }
  return ring;
}

// Blue at the shortest, red at the longest strut.
Colour LengthColour(double length, double shortest, double longest) {
  const double share = std::clamp((length - shortest) / std::max(1e-9, longest - shortest), 0.0, 1.0);
  return {0.12 + 0.7 * share, 0.38 - 0.2 * share, 0.75 - 0.6 * share};
}

double WholeDegrees(double angle_rad) { return std::round(angle_rad / kDeg) + 0.0; }  // never -0

void DrawMechanism(Picture& picture, PlotFrame::Place place, const Hexapod& hexapod, const Pose& X_MP) {
  const HexapodGeometry& g = hexapod.geometry();
  const Pose X_MT = ToolFromPlatform(hexapod, X_MP);
  Points all = SeenRing({}, g.p_MA_mm);
  const Points platform = SeenRing(X_MP, g.p_PB_mm);
  all.insert(all.end(), platform.begin(), platform.end());
  all.push_back(Seen(X_MT.p_mm));
  const auto [x_low, x_high] = std::minmax_element(all.begin(), all.end());
  double y_low = 1e9, y_high = -1e9;
  for (const auto& [x, y] : all) {
    y_low = std::min(y_low, y);
    y_high = std::max(y_high, y);
  }
  const HexapodInverse answer = SolveInverseWithMargin(hexapod, X_MP);
  const PlatformPose shown = PlatformPose::Of(X_MT);
  PlotFrame frame(
      picture, place,
      {x_low->first - 60, x_high->first + 60,
       "seen from the side, mm; struts with their lengths, mm, blue at the shortest, red at the longest"},
      {y_low - 80, y_high + 80, "mm"},
      fmt::format("tool at ({:.0f}, {:.0f}, {:.0f}) mm, psi {:.0f} theta {:.0f} gamma {:.0f} deg: {}",
                  shown.x_mm, shown.y_mm, shown.z_mm, WholeDegrees(shown.psi_rad),
                  WholeDegrees(shown.theta_rad), WholeDegrees(shown.gamma_rad), ReasonName(answer.reason)),
      true);
  frame.Area(SeenRing({}, g.p_MA_mm), kPale.Faded(0.8));
  frame.Line(SeenRing({}, g.p_MA_mm), kInk, 1.6);
  const double longest = answer.lengths_mm.maxCoeff(), shortest = answer.lengths_mm.minCoeff();
  for (int j = 0; j < kStruts; ++j) {
    const auto from = Seen(g.p_MA_mm.col(j));
    const auto to = Seen(X_MP * Eigen::Vector3d(g.p_PB_mm.col(j)));
    const bool blamed = answer.strut == j;
    frame.Line({from, to}, blamed ? kRed : LengthColour(answer.lengths_mm[j], shortest, longest),
               blamed ? 6.0 : 4.0);
    frame.Dot(from.first, from.second, 4, kInk);
    frame.Dot(to.first, to.second, 4, kInk);
    frame.Text(from.first, from.second, fmt::format("{}: {:.1f}", j + 1, answer.lengths_mm[j]), kInk,
               from.first > 400 ? -62 : 7, 18, 11);
  }
  frame.Area(platform, kBlue.Faded(0.25));
  frame.Line(platform, kBlue, 1.8);
  frame.Line({Seen(X_MP.p_mm), Seen(X_MT.p_mm)}, kOrange, 3.0);
  frame.Dot(Seen(X_MT.p_mm).first, Seen(X_MT.p_mm).second, 4, kOrange);
}

Colour BoundColour(HexapodBound bound) {
  switch (bound) {
    case HexapodBound::kStrutMin:
      return kBlue;
    case HexapodBound::kStrutMax:
      return kRed;
    case HexapodBound::kBaseJointCone:
      return kOrange;
    case HexapodBound::kPlatformJointCone:
      return kViolet;
    case HexapodBound::kSingularMargin:
      return kInk;
    case HexapodBound::kNone:
      break;
  }
  return kGrey;
}

void DrawSlice(Picture& picture, PlotFrame::Place place, const Hexapod& hexapod, double z_mm,
               const std::vector<double>& tilt_rad) {
  HexapodWorkspaceRequest request = WorkspaceRequestFor(hexapod, 8.0, tilt_rad);
  const HexapodSlice slice = CutSlice(hexapod, request, z_mm);
  double reach = 100.0;
  for (const HexapodSpan& span : slice.spans) {
    reach = std::max({reach, std::abs(span.from_x_mm), std::abs(span.to_x_mm), std::abs(span.y_mm)});
  }
  PlotFrame frame(
      picture, place, {-1.1 * reach, 1.1 * reach, "x, mm"}, {-1.1 * reach, 1.1 * reach, "y, mm"},
      fmt::format("workspace at z {:.0f} mm: {}; its largest rectangle", z_mm, SquareMetres(slice.area_mm2)),
      true);
  for (const HexapodSpan& span : slice.spans) {
    const double half = 0.55 * request.step_mm;
    frame.Area({{span.from_x_mm, span.y_mm - half},
                {span.to_x_mm, span.y_mm - half},
                {span.to_x_mm, span.y_mm + half},
                {span.from_x_mm, span.y_mm + half}},
               Colour{0.86, 0.93, 0.87});
  }
  const HexapodRectangle found = LargestRectangle(hexapod, request, slice);
  if (found.rectangle.area_mm2() > 0.0) {
    DrawRectangle(frame, found.rectangle);
    for (std::size_t side = 0; side < 4; ++side) {
      const Rectangle& r = found.rectangle;
      const double x = side == 0 ? r.x_min_mm : side == 1 ? r.x_max_mm : 0.5 * (r.x_min_mm + r.x_max_mm);
      const double y = side == 2 ? r.y_min_mm : side == 3 ? r.y_max_mm : 0.5 * (r.y_min_mm + r.y_max_mm);
      frame.Dot(x, y, 5.0, BoundColour(found.binding[side].bound));
    }
  }
  for (const HexapodSpan& span : slice.spans) {
    frame.Dot(span.from_x_mm, span.y_mm, 2.4, BoundColour(span.from.bound));
    frame.Dot(span.to_x_mm, span.y_mm, 2.4, BoundColour(span.to.bound));
  }
  frame.Legend({{"strut too short", kBlue},
                {"strut too long", kRed},
                {"joint cone, base", kOrange},
                {"joint cone, platform", kViolet},
                {"singular margin", kInk}},
               true);
}

void DrawYaw(Picture& picture, PlotFrame::Place place, const Hexapod& hexapod) {
  Points determinant, margin;
  const Pose home = hexapod.geometry().X_MP_home;
  const double at_home = AnalyseSingularity(hexapod, home).determinant;
  double low = 0.0;
  for (int deg = -180; deg <= 180; ++deg) {
    const HexapodSingularity s = AnalyseSingularity(hexapod, {home.p_mm, RotationZ(-deg * kDeg) * home.R});
    determinant.emplace_back(deg, s.determinant / at_home);
    margin.emplace_back(deg, s.signed_margin);
    low = std::min({low, s.determinant / at_home, s.signed_margin});
  }
  PlotFrame frame(picture, place, {-180, 180, "psi, deg, at home"}, {low - 0.1, 1.8, ""},
                  "det J over the yaw; singular where it is 0");
  frame.Line({{-180, 0}, {180, 0}}, kGrey, 1.0);
  frame.Line(determinant, kBlue, 2.2);
  frame.Line(margin, kOrange, 2.2);
  frame.Legend({{"det J / det J at home", kBlue}, {"smallest singular value, signed, mm/mm", kOrange}});
}

struct HexapodPictureOptions {
  std::string machine;
  std::string out;
  std::vector<double> pose;
  std::vector<double> tilt_rad;
};

absl::Status DrawHexapod(const HexapodPictureOptions& options) {
  const auto machine = ReadHexapodFile(options.machine);
  if (!machine.ok()) {
    return machine.status();
  }
  const Hexapod hexapod(machine->geometry);
  const std::vector<double>& p = options.pose;
  const Pose X_MT = p.empty() ? ToolFromPlatform(hexapod, hexapod.geometry().X_MP_home)
                              : Pose::FromKrylov({p[0], p[1], p[2]}, {p[3], p[4], p[5]});
  if (!X_MT.p_mm.allFinite() || !X_MT.R.allFinite()) {
    return Trouble(absl::StatusCode::kInvalidArgument, "NOT_FINITE", "the pose must be six finite numbers");
  }
  Picture picture(1300, 760);
  DrawMechanism(picture, {70, 60, 560, 620}, hexapod, PlatformFromTool(hexapod, X_MT));
  DrawSlice(picture, {740, 60, 500, 340}, hexapod, X_MT.p_mm.z(), options.tilt_rad);
  DrawYaw(picture, {740, 480, 500, 200}, hexapod);
  return picture.Write(options.out);
}

}  // namespace

void AddHexapodPictures(CLI::App& draw, Output& output) {
  auto hexapod = std::make_shared<HexapodPictureOptions>();
  CLI::App* mechanism =
      draw.add_subcommand("hexapod", "mechanism in a pose, slice of the workspace, det J over the yaw");
  mechanism->add_option("--machine", hexapod->machine, "YAML file of the hexapod")->required();
  mechanism
      ->add_option("--pose", hexapod->pose, "tool: x_mm y_mm z_mm psi_rad theta_rad gamma_rad; default home")
      ->expected(6);
  mechanism->add_option("--tilt-rad", hexapod->tilt_rad,
                        "tilts about x that the slice must serve, both ways");
  AddPictureOption(*mechanism, "--out", hexapod->out, "of the hexapod")->required();
  mechanism->callback([hexapod, &output] { output.Finish(DrawHexapod(*hexapod)); });

  auto settings = std::make_shared<std::vector<std::string>>();
  auto out = std::make_shared<std::string>();
  CLI::App* area =
      draw.add_subcommand("service-area", "the paper's Fig. 2 with its parts, beside what is really served");
  area->add_option("--set", *settings, "name=number, as in service-area");
  AddPictureOption(*area, "--out", *out, "of the areas")->required();
  area->callback([settings, out, &output] { output.Finish(DrawServiceArea(*settings, *out)); });

  auto sweeps_out = std::make_shared<std::string>();
  CLI::App* sweeps = draw.add_subcommand("sweeps", "the paper's Figs 3 to 8");
  AddPictureOption(*sweeps, "--out", *sweeps_out, "of the sweeps")->required();
  sweeps->callback([sweeps_out, &output] { output.Finish(DrawSweeps(*sweeps_out)); });
}

}  // namespace lambdajet::cli
