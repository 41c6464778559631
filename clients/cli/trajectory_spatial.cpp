#include "clients/cli/trajectory_spatial.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

#include "clients/cli/csv.hpp"
#include "clients/cli/feed_report.hpp"
#include "clients/cli/picture.hpp"
#include "clients/cli/program_faults.hpp"
#include "clients/cli/text_file.hpp"
#include "platform/machine_file/hexapod_file.hpp"
#include "trajectory/core/part_program/gcode_reader.hpp"
#include "trajectory/core/spatial_feed/plan_spatial_program.hpp"

namespace lambdajet::cli {
namespace {

using trajectory::FeedLimit;
using trajectory::PlannedSpatialProgram;
using trajectory::SpatialPlanSample;
using trajectory::StrutsAt;

constexpr double kDeg = 180.0 / M_PI;
constexpr double kWidth_px = 1300.0;
constexpr std::size_t kMostCurvePoints = 4000;
constexpr std::array<Colour, kStrutCount> kStrutColours = {kBlue, kOrange, kGreen, kRed, kViolet, kInk};

struct SpatialFiles {
  HexapodMachine machine;
  PlannedSpatialProgram planned;
};

// The plan; nothing after the program's faults were told.
absl::StatusOr<std::optional<SpatialFiles>> PlanFiles(const SpatialVerb& verb, Output& output) {
  const auto text = ReadTextFile(verb.program);
  auto machine = ReadHexapodFile(verb.hexapod);
  if (!text.ok() || !machine.ok()) {
    return text.ok() ? machine.status() : text.status();
  }
  trajectory::GcodeOptions reading;
  reading.axes = trajectory::kSixAxes;
  reading.default_tolerance_mm = machine->motion.corner_tolerance_mm;
  reading.kerf_compensation = false;  // the planner moves no contour
  const trajectory::PartProgram program = trajectory::ReadGcode(*text, reading);
  if (!program.faults.empty()) {
    TellFaults(verb.program, program.faults, output);
    return std::nullopt;
  }
  trajectory::SpatialOptions options;
  options.feed_scale = verb.feed_scale;
  SpatialFiles files{*machine, {}};
  files.planned = trajectory::PlanSpatialProgram(program.operations, machine->machine_id, machine->geometry,
                                                 machine->motion, options);
  if (!files.planned.faults.empty()) {
    TellFaults(verb.program, files.planned.faults, output);
    return std::nullopt;
  }
  return files;
}

void TellSummary(const SpatialFiles& files, Output& output) {
  const PlannedSpatialProgram& p = files.planned;
  output.Text(fmt::format(
      "plan {}: {:.2f} s moving, {:.2f} s at gates; {:.1f} mm of path (a turn counts at {:.1f} mm)",
      p.plan.id, p.plan.duration_s, p.gate_time_s, p.plan.length_mm, p.plan.turn_radius_mm));
  output.Text(
      fmt::format("{} segments, {} gates, {} events; farthest from the programmed path {:.4f} mm, {:.6f} rad",
                  p.plan.segments.size(), p.plan.gates.size(), p.plan.events.size(), p.tip_deviation_mm,
                  p.turn_deviation_rad));
  output.Text(fmt::format("struts between {:.1f} and {:.1f} mm; smallest singular margin {:.3f} mm/mm",
                          p.shortest_mm.minCoeff(), p.longest_mm.maxCoeff(), p.singular_margin_ratio));
  TellFeed(p.binding, p.slow, output);
}

nlohmann::json SummaryJson(const PlannedSpatialProgram& p) {
  return {{"plan_id", std::to_string(p.plan.id)},
          {"duration_s", p.plan.duration_s},
          {"gate_time_s", p.gate_time_s},
          {"cutting_time_s", p.cutting_time_s},
          {"length_mm", p.plan.length_mm},
          {"turn_radius_mm", p.plan.turn_radius_mm},
          {"segments", p.plan.segments.size()},
          {"gates", p.plan.gates.size()},
          {"events", p.plan.events.size()},
          {"tip_deviation_mm", p.tip_deviation_mm},
          {"turn_deviation_rad", p.turn_deviation_rad},
          {"shortest_strut_mm", p.shortest_mm.minCoeff()},
          {"longest_strut_mm", p.longest_mm.maxCoeff()},
          {"singular_margin", p.singular_margin_ratio},
          {"binding", BindingJson(p.binding)},
          {"slow", SlowJson(p.slow)}};
}

// The planned pose at tau, between samples on the chord.
Pose ToolAt(const PlannedSpatialProgram& p, double tau_s) {
  const auto after = std::upper_bound(p.samples.begin(), p.samples.end(), tau_s,
                                      [](double t, const SpatialPlanSample& s) { return t < s.tau_s; });
  if (after == p.samples.begin() || after == p.samples.end()) {
    const SpatialPlanSample& end = after == p.samples.begin() ? p.samples.front() : p.samples.back();
    return {end.p_W_mm, end.q_W.toRotationMatrix()};
  }
  const SpatialPlanSample &a = *std::prev(after), &b = *after;
  const double u = b.tau_s > a.tau_s ? (tau_s - a.tau_s) / (b.tau_s - a.tau_s) : 0.0;
  return {a.p_W_mm + u * (b.p_W_mm - a.p_W_mm), a.q_W.slerp(u, b.q_W).toRotationMatrix()};
}

CsvTable PointTable(const PlannedSpatialProgram& p, double step_s) {
  CsvTable table({"tau_s", "x_W_mm", "y_W_mm", "z_W_mm", "a_rad", "b_rad", "c_rad", "strut_1_mm",
                  "strut_2_mm", "strut_3_mm", "strut_4_mm", "strut_5_mm", "strut_6_mm", "strut_1_mm_per_s",
                  "strut_2_mm_per_s", "strut_3_mm_per_s", "strut_4_mm_per_s", "strut_5_mm_per_s",
                  "strut_6_mm_per_s"});
  const auto count = static_cast<std::int64_t>(p.plan.duration_s / step_s + 1e-9);
  for (std::int64_t i = 0; i <= count; ++i) {
    const double tau = static_cast<double>(i) * step_s;
    const Pose tool = ToolAt(p, tau);
    const RollPitchYaw turn = tool.roll_pitch_yaw();
    const trajectory::StrutState struts = StrutsAt(p.plan, tau);
    std::vector<double> row = {tau,           tool.p_mm.x(),  tool.p_mm.y(), tool.p_mm.z(),
                               turn.roll_rad, turn.pitch_rad, turn.yaw_rad};
    row.insert(row.end(), struts.q_mm.begin(), struts.q_mm.end());
    row.insert(row.end(), struts.first.begin(), struts.first.end());
    table.AddRow(row);
  }
  return table;
}

// --- Pictures.

// Blue is slow, red is fast.
Colour Ramp(double share) {
  const double x = std::clamp(share, 0.0, 1.0);
  return {std::clamp(2.0 * x - 0.3, 0.1, 0.9), 0.15 + 0.6 * (1.0 - std::abs(2.0 * x - 1.0)),
          std::clamp(1.1 - 1.6 * x, 0.1, 0.9)};
}

Colour ColourOf(FeedLimit limit) {
  switch (limit) {
    case FeedLimit::kFeed:
      return kGreen;
    case FeedLimit::kCorner:
    case FeedLimit::kContourTolerance:
      return kRed;
    case FeedLimit::kCurvature:
      return kOrange;
    case FeedLimit::kPathAcceleration:
    case FeedLimit::kPathJerk:
      return kBlue;
    default:
      return kViolet;
  }
}

// Seen from above the front right corner.
std::pair<double, double> Seen(const Eigen::Vector3d& p) {
  return {0.87 * p.x() + 0.5 * p.y(), 0.9 * p.z() - 0.25 * p.x() + 0.43 * p.y()};
}

void DrawPath(PlotFrame& frame, const PlannedSpatialProgram& p, bool by_speed, double fastest) {
  for (std::size_t i = 1; i < p.samples.size(); ++i) {
    const SpatialPlanSample &a = p.samples[i - 1], &b = p.samples[i];
    const Colour colour = by_speed ? Ramp(b.path_speed_mm_per_s / fastest) : ColourOf(b.limit);
    frame.Line({Seen(a.p_W_mm), Seen(b.p_W_mm)}, b.cutting || !by_speed ? colour : colour.Faded(0.35),
               b.cutting ? 3.0 : 1.2);
  }
}

// The tool every so often along the path: from the tip towards the spindle.
void DrawTool(PlotFrame& frame, const PlannedSpatialProgram& p, double length_mm) {
  double last = -1e9;
  for (const SpatialPlanSample& s : p.samples) {
    if (s.s_mm - last > p.plan.length_mm / 60.0) {
      frame.Line({Seen(s.p_W_mm), Seen(s.p_W_mm + length_mm * (s.q_W * Eigen::Vector3d::UnitZ()))},
                 kGrey.Faded(0.5), 0.8);
      last = s.s_mm;
    }
  }
}

void DrawPathFrame(Picture& picture, PlotFrame::Place place, const PlannedSpatialProgram& p, bool by_speed) {
  constexpr double kTool_mm = 25.0;
  double x0 = 1e9, x1 = -1e9, y0 = 1e9, y1 = -1e9, fastest = 1e-9;
  for (const SpatialPlanSample& s : p.samples) {
    for (const double height : {0.0, kTool_mm}) {
      const auto [x, y] = Seen(s.p_W_mm + height * (s.q_W * Eigen::Vector3d::UnitZ()));
      x0 = std::min(x0, x), x1 = std::max(x1, x), y0 = std::min(y0, y), y1 = std::max(y1, y);
    }
    fastest = std::max(fastest, s.path_speed_mm_per_s);
  }
  PlotFrame frame(picture, place, {x0 - 5, x1 + 5, "mm, seen from the front right"}, {y0 - 5, y1 + 5, ""},
                  by_speed ? fmt::format("path by speed, 0 to {:.0f} mm/s (a turn counts at {:.0f} mm)",
                                         fastest, p.plan.turn_radius_mm)
                           : std::string("path by what limits it"),
                  true);
  DrawTool(frame, p, kTool_mm);
  DrawPath(frame, p, by_speed, fastest);
  if (!by_speed) {
    frame.Legend({{"feed or rapid held", kGreen},
                  {"corner or tolerance", kRed},
                  {"curvature", kOrange},
                  {"path acceleration or jerk", kBlue},
                  {"a strut", kViolet}},
                 true);
  }
}

template <typename Value>
void DrawStruts(Picture& picture, double top_px, const PlannedSpatialProgram& p, const std::string& title,
                const std::string& label, Value value) {
  std::array<Points, kStrutCount> curves;
  double low = 1e9, high = -1e9;
  for (std::size_t i = 0; i <= kMostCurvePoints; ++i) {
    const double tau = p.plan.duration_s * static_cast<double>(i) / kMostCurvePoints;
    const StrutVector at = value(StrutsAt(p.plan, tau));
    for (std::size_t j = 0; j < kStrutCount; ++j) {
      const double y = at[static_cast<Eigen::Index>(j)];
      curves[j].push_back({tau, y});
      low = std::min(low, y), high = std::max(high, y);
    }
  }
  const double room = 0.05 * (high - low) + 1e-9;
  PlotFrame frame(picture, {80.0, top_px, kWidth_px - 120.0, 190.0},
                  {0.0, p.plan.duration_s, "program time, s"}, {low - room, high + room, label}, title);
  std::vector<std::pair<std::string, Colour>> legend;
  for (std::size_t j = 0; j < kStrutCount; ++j) {
    frame.Line(curves[j], kStrutColours[j], 1.1);
    legend.push_back({fmt::format("strut {}", j + 1), kStrutColours[j]});
  }
  frame.Legend(legend, true);
}

}  // namespace

absl::Status PlanSpatial(const SpatialVerb& verb, Output& output) {
  const auto files = PlanFiles(verb, output);
  if (!files.ok() || !files->has_value()) {
    return files.status();
  }
  const PlannedSpatialProgram& planned = (*files)->planned;
  if (!verb.out.empty()) {
    if (const absl::Status status = WriteCsv(verb.out, PointTable(planned, verb.step_s)); !status.ok()) {
      return status;
    }
  }
  if (verb.out != "-") {
    TellSummary(**files, output);
    output.Json(SummaryJson(planned));
  }
  return absl::OkStatus();
}

absl::Status DrawSpatial(const SpatialVerb& verb, Output& output) {
  const auto files = PlanFiles(verb, output);
  if (!files.ok() || !files->has_value()) {
    return files.status();
  }
  const PlannedSpatialProgram& p = (*files)->planned;
  const HexapodMotion& m = (*files)->machine.motion;
  Picture picture(kWidth_px, 1500.0);
  DrawPathFrame(picture, {80.0, 50.0, kWidth_px - 120.0, 560.0}, p, verb.colour == "speed");
  DrawStruts(picture, 680.0, p, "what the struts' encoders read", "mm",
             [](const trajectory::StrutState& s) { return s.q_mm; });
  DrawStruts(picture, 960.0, p, fmt::format("strut speeds (limit {:.0f} mm/s)", m.strut_velocity_mm_per_s),
             "mm/s", [](const trajectory::StrutState& s) { return s.first; });
  DrawStruts(picture, 1240.0, p,
             fmt::format("strut accelerations (limit {:.0f} mm/s\u00b2)", m.strut_acceleration_mm_per_s2),
             "mm/s\u00b2", [](const trajectory::StrutState& s) { return s.second; });
  return picture.Write(verb.out);
}

}  // namespace lambdajet::cli
