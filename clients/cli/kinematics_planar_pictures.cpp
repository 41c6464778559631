#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>

#include "clients/cli/kinematics_planar.hpp"
#include "clients/cli/picture.hpp"
#include "clients/cli/picture_option.hpp"
#include "foundation/contract/trouble.hpp"
#include "kinematics/core/lambda_kernel.hpp"
#include "kinematics/core/workspace.hpp"
#include "platform/machine_file/machine_file.hpp"

namespace lambdajet::cli {
namespace {

using namespace lambdajet::kinematics;
using Eigen::Vector2d;

std::pair<double, double> PairOf(const Vector2d& v) { return {v.x(), v.y()}; }

Points PointsOf(const Outline& outline) {
  Points points;
  for (const Vector2d& p : outline) {
    points.push_back(PairOf(p));
  }
  return points;
}

struct Skeleton {
  Vector2d slider_1, slider_2, attachment, tool;
};

Vector2d Of(const lambda::Point<double>& p) { return {p.x, p.y}; }

Skeleton SkeletonAt(const LambdaMechanism& m, const Vector2d& p) {
  const auto k =
      lambda::CloseInverse<double>(m.geometry, {p.x(), p.y()}, m.working_mode.s1, m.working_mode.s2);
  return {Of(lambda::OnRail(m.geometry.rail_1, k.position_1_mm)),
          Of(lambda::OnRail(m.geometry.rail_2, k.position_2_mm)), Of(k.attachment), p};
}

// As much of a slider's travel as the frame shows.
void DrawRail(PlotFrame& frame, const lambda::Rail<double>& rail, const ActuatorTravel& travel) {
  const double from = std::max(travel.min_mm + rail.zero_mm, frame.x().from);
  const double to = std::min(travel.max_mm + rail.zero_mm, frame.x().to);
  const Vector2d a = Of(lambda::OnRail(rail, from));
  const Vector2d b = Of(lambda::OnRail(rail, to));
  frame.Line({PairOf(a), PairOf(b)}, kGrey, 5.0);
}

void DrawSkeleton(PlotFrame& frame, const LambdaMechanism& m, const Skeleton& s) {
  DrawRail(frame, m.geometry.rail_1, m.travel[0]);
  DrawRail(frame, m.geometry.rail_2, m.travel[1]);
  frame.Line({PairOf(s.slider_1), PairOf(s.tool)}, kBlue, 4.0);
  frame.Line({PairOf(s.slider_2), PairOf(s.attachment)}, kGreen, 4.0);
  for (const Vector2d& joint : {s.slider_1, s.slider_2, s.attachment}) {
    frame.Dot(joint.x(), joint.y(), 5.0, kInk);
  }
  frame.Dot(s.tool.x(), s.tool.y(), 5.0, kRed);
  frame.Text(s.slider_1.x(), s.slider_1.y(), "slider 1", kInk, -10, 20);
  frame.Text(s.slider_2.x(), s.slider_2.y(), "slider 2", kInk, -10, 20);
  frame.Text(s.tool.x(), s.tool.y(), "tool (E)", kRed, 9, -9);
}

// Paper 000's sheet under the jet: the sheet hangs on E, the jet stands still in D.
void DrawSheet(PlotFrame& frame, const MachineDescription& machine, const Vector2d& p) {
  const PlanarPose X_EW = machine.X_EW();
  Points sheet;
  for (const Vector2d& corner :
       {Vector2d(0, 0), Vector2d(machine.sheet_width_mm, 0),
        Vector2d(machine.sheet_width_mm, machine.sheet_height_mm), Vector2d(0, machine.sheet_height_mm)}) {
    sheet.push_back(PairOf(p + X_EW * corner));
  }
  frame.Area(sheet, kOrange.Faded(0.18));
  sheet.push_back(sheet.front());
  frame.Line(sheet, kOrange, 1.5);
  const Vector2d jet = machine.X_DJ().translation_mm();
  frame.Dot(jet.x(), jet.y(), 5.0, kViolet);
  frame.Text(jet.x(), jet.y(), "jet (J)", kViolet, 9, -9);
  frame.Text(sheet[0].first, sheet[0].second, "W", kOrange, -16, 14);
}

struct Extent {
  Vector2d low = Vector2d::Constant(1e300);
  Vector2d high = Vector2d::Constant(-1e300);
  void Take(const Vector2d& p) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
};

PlotFrame FrameFor(Picture& picture, const Extent& extent, const std::string& title) {
  const Vector2d pad = 0.06 * (extent.high - extent.low);
  return PlotFrame(picture, {75, 45, 900, 560},
                   {extent.low.x() - pad.x(), extent.high.x() + pad.x(), "x in D, mm"},
                   {extent.low.y() - pad.y(), extent.high.y() + pad.y(), "y in D, mm"}, title, true);
}

struct PictureOptions {
  std::string machine;
  std::string out;
  std::string mode;
  std::vector<double> at_mm;
};

absl::Status DrawPose(const PictureOptions& options, Output& output) {
  const auto machine = ReadMachineFile(options.machine);
  const auto mechanism = ReadMechanism(options.machine, options.mode);
  if (!machine.ok() || !mechanism.ok()) {
    return machine.ok() ? mechanism.status() : machine.status();
  }
  const Vector2d p(options.at_mm[0], options.at_mm[1]);
  const InverseAnswer answer = SolveInverse(*mechanism, p);
  if (!answer.positioned) {
    output.Fail(
        ExitCode::kRefused, ReasonName(answer.reason),
        fmt::format("the mechanism cannot be closed there, {} mm are missing", Fixed(answer.excess_mm, 3)));
    return absl::OkStatus();
  }
  const Skeleton s = SkeletonAt(*mechanism, p);
  Extent extent;
  for (const Vector2d& at : {s.slider_1, s.slider_2, s.tool, machine->X_DJ().translation_mm()}) {
    extent.Take(at);
  }
  const PlanarPose X_EW = machine->X_EW();
  extent.Take(p + X_EW * Vector2d(0, 0));
  extent.Take(p + X_EW * Vector2d(machine->sheet_width_mm, machine->sheet_height_mm));
  extent.Take({s.slider_1.x(), s.slider_1.y() - 60.0});
  Picture picture(1010, 670);
  PlotFrame frame =
      FrameFor(picture, extent,
               fmt::format("{}: tool at ({}, {}) mm, sliders {} and {} mm, {}", machine->machine_id,
                           Fixed(p.x(), 1), Fixed(p.y(), 1), Fixed(answer.actuator_position_mm.x(), 2),
                           Fixed(answer.actuator_position_mm.y(), 2), ReasonName(answer.reason)));
  DrawSheet(frame, *machine, p);
  DrawSkeleton(frame, *mechanism, s);
  frame.Legend({{"main link", kBlue},
                {"second link", kGreen},
                {"sheet", kOrange},
                {"jet", kViolet},
                {"rail, travel", kGrey}});
  return picture.Write(options.out);
}

// The zones within the singular margin, as rows of the picture: where the mechanism closes but must not go.
void DrawSingularZones(PlotFrame& frame, const LambdaMechanism& m, const Extent& extent) {
  const double step = (extent.high.x() - extent.low.x()) / 450.0;
  for (double y = extent.low.y(); y < extent.high.y(); y += step) {
    std::optional<double> from;
    for (double x = extent.low.x(); x <= extent.high.x() + step; x += step) {
      const InverseAnswer answer = SolveInverse(m, {x + 0.5 * step, y + 0.5 * step});
      const bool within = answer.positioned && answer.travel_margin_mm >= 0.0 &&
                          answer.reason == Reason::kSingular && x <= extent.high.x();
      if (within && !from) {
        from = x;
      } else if (!within && from) {
        frame.Area({{*from, y}, {x, y}, {x, y + step}, {*from, y + step}}, kRed.Faded(0.75));
        from.reset();
      }
    }
  }
}

absl::Status DrawWorkspace(const PictureOptions& options, Output& output) {
  const auto mechanism = ReadMechanism(options.machine, options.mode);
  if (!mechanism.ok()) {
    return mechanism.status();
  }
  const Workspace workspace = ComputeWorkspace(*mechanism);
  if (workspace.reason != Reason::kSolved) {
    output.Fail(ExitCode::kRefused, ReasonName(workspace.reason), "the mechanism has no usable pose to draw");
    return absl::OkStatus();
  }
  Extent extent;
  for (const Outline& outline : workspace.outlines) {
    for (const Vector2d& p : outline) {
      extent.Take(p);
    }
  }
  const double margin = 3.0 * mechanism->singular_margin_mm + 20.0;
  extent.Take(extent.low - Vector2d(0.0, margin));
  extent.Take(extent.high + Vector2d(0.0, margin));
  const Rectangle& r = workspace.rectangle;
  Picture picture(1010, 708);
  PlotFrame frame = FrameFor(
      picture, extent,
      fmt::format("workspace {} m\u00b2; largest rectangle {} x {} mm", Fixed(1e-6 * workspace.area_mm2, 4),
                  Fixed(r.x_max_mm - r.x_min_mm, 1), Fixed(r.y_max_mm - r.y_min_mm, 1)));
  DrawRail(frame, mechanism->geometry.rail_1, {extent.low.x(), extent.high.x()});
  DrawSingularZones(frame, *mechanism, extent);
  for (const Outline& outline : workspace.outlines) {
    Points line = PointsOf(outline);
    frame.Area(line, kBlue.Faded(0.18));
    line.push_back(line.front());
    frame.Line(line, kBlue, 2.0);
  }
  frame.Line({{r.x_min_mm, r.y_min_mm},
              {r.x_max_mm, r.y_min_mm},
              {r.x_max_mm, r.y_max_mm},
              {r.x_min_mm, r.y_max_mm},
              {r.x_min_mm, r.y_min_mm}},
             kGreen, 2.0);
  constexpr std::array<const char*, 4> kSides = {"left", "right", "bottom", "top"};
  for (std::size_t i = 0; i < kSides.size(); ++i) {
    picture.Text(75.0 + 470.0 * static_cast<double>(i % 2), 676.0 + 18.0 * static_cast<double>(i / 2),
                 fmt::format("{}: {}", kSides[i], PoseLimitSentence(workspace.binding[i])), 12, kGrey);
  }
  frame.Legend(
      {{"usable", kBlue},
       {fmt::format("within {} mm of a singular line", Fixed(mechanism->singular_margin_mm, 1)), kRed},
       {"largest rectangle", kGreen},
       {"rail", kGrey}},
      true);
  return picture.Write(options.out);
}

// det J over the height, cut where it leaves the frame.
Points Determinants(const LambdaMechanism& m, double y_max, double lowest) {
  Points points;
  for (int i = 1; i < 1200; ++i) {
    const double y = y_max * i / 1200.0;
    const LambdaJacobians j = ComputeJacobians(m, {0.0, y});
    if (j.differentiable && j.determinant >= lowest && j.determinant <= 1.0) {
      points.emplace_back(y, j.determinant);
    }
  }
  return points;
}

absl::Status DrawDeterminant(const PictureOptions& options, Output&) {
  const auto mechanism = ReadMechanism(options.machine, options.mode);
  if (!mechanism.ok()) {
    return mechanism.status();
  }
  const MechanismParameters& p = mechanism->parameters;
  constexpr double kLowest = -5.0;
  constexpr double kHighest = 1.5;
  const double height = 1.02 * p[0];
  Picture picture(1010, 670);
  PlotFrame frame(
      picture, {75, 45, 900, 560}, {0.0, height, "y, mm"}, {kLowest, kHighest, "det J"},
      fmt::format(
          "det J over y: lambda {:.0f}/{:.0f}/{:.0f}, biglide {:.0f}/{:.0f}, and as printed (seed paper 000, "
          "Fig. 6)",
          p[0], p[1], p[2], p[0], p[0]));
  frame.Line({{0.0, 0.0}, {height, 0.0}}, kGrey, 1.0);
  Points printed;
  for (int i = 0; i < 1200; ++i) {
    const double y = p[0] * i / 1200.0;
    const double j = p[1] / p[0] * (1.0 - y / std::sqrt(p[0] * p[0] - y * y));
    if (j >= kLowest) {
      printed.emplace_back(y, j);
    }
  }
  frame.Line(printed, kOrange, 1.6, true);
  frame.Line(Determinants(LambdaMechanism::FromParameters(IdealLambda(p[0], p[0], p[0])), height, kLowest),
             kGreen, 2.0);
  frame.Line(Determinants(*mechanism, height, kLowest), kBlue, 2.6);
  const double reach = std::min(p[0], p[0] * p[2] / p[1]);
  frame.Line({{reach, kLowest}, {reach, kHighest}}, kRed, 1.2, true);
  frame.Text(reach, 0.7, "type 1", kRed, -48, 0);
  frame.Text(0.0, 0.0, "type 2", kRed, 4, -8);
  frame.Legend({{"lambda", kBlue},
                {"biglide, same main link", kGreen},
                {"printed formula (zero at L1/sqrt 2 is an error)", kOrange}});
  return picture.Write(options.out);
}

using Draw = absl::Status (*)(const PictureOptions&, Output&);

std::shared_ptr<PictureOptions> AddPicture(CLI::App& draw, Output& output, const char* name, const char* what,
                                           Draw picture) {
  auto options = std::make_shared<PictureOptions>();
  CLI::App* verb = draw.add_subcommand(name, what);
  verb->add_option("--machine", options->machine, "machine file")->required();
  AddPictureOption(*verb, "--out", options->out, "of the mechanism")->required();
  verb->add_option("--mode", options->mode, "working mode: ++, +-, -+ or --; default the machine's");
  if (picture == DrawPose) {
    verb->add_option("--at-mm", options->at_mm, "x_D y_D of the tool")->required()->expected(2);
  }
  verb->callback([options, picture, &output] { output.Finish(picture(*options, output)); });
  return options;
}

}  // namespace

void AddPlanarPictures(CLI::App& draw, Output& output) {
  AddPicture(draw, output, "pose", "lambda: the mechanism in a pose, with sheet and jet", DrawPose);
  AddPicture(draw, output, "workspace", "lambda: where the tool may be, singular zones, largest rectangle",
             DrawWorkspace);
  AddPicture(draw, output, "determinant", "lambda: det J over the height, beside the biglide's",
             DrawDeterminant);
}

}  // namespace lambdajet::cli
