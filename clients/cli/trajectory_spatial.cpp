#include "clients/cli/trajectory_spatial.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

#include "clients/cli/csv.hpp"
#include "clients/cli/picture.hpp"
#include "clients/cli/plan_feed.hpp"
#include "clients/cli/program_faults.hpp"
#include "clients/cli/program_file.hpp"
#include "platform/machine_file/hexapod_file.hpp"
#include "trajectory/core/spatial_feed/play_spatial_plan.hpp"

namespace lambdajet::cli {
namespace {

using trajectory::FeedLimit;
using trajectory::HexapodModel;
using trajectory::PlannedSpatialProgram;
using trajectory::SpatialPlanSample;
using trajectory::StrutsAt;

constexpr double kDeg = 180.0 / M_PI;
constexpr double kSpatialWidth_px = 1300.0;
constexpr double kRoomForLegend = 1.09;  // of the time axis, so that names stand beside the curves
constexpr std::size_t kMostCurvePoints = 4000;
constexpr std::array<Colour, kStrutCount> kStrutColours = {kBlue, kOrange, kGreen, kRed, kViolet, kInk};

struct SpatialFiles {
  std::string text;
  HexapodModel machine;
};

absl::StatusOr<SpatialFiles> ReadFiles(const SpatialVerb& verb) {
  auto text = ReadProgramFile(verb.program);
  auto machine = ReadHexapodFile(verb.hexapod);
  if (!text.ok() || !machine.ok()) {
    return text.ok() ? machine.status() : text.status();
  }
  return SpatialFiles{*std::move(text),
                      {machine->machine_id, HexapodHash(*machine), machine->geometry, machine->motion}};
}

trajectory::SpatialOptions OptionsOf(const SpatialVerb& verb) {
  trajectory::SpatialOptions options;
  options.feed_scale = verb.feed_scale;
  return options;
}

// The plan; nothing after the program's faults were told.
absl::StatusOr<std::optional<PlannedSpatialProgram>> PlanFiles(const SpatialVerb& verb, HexapodModel& machine,
                                                               Output& output) {
  auto files = ReadFiles(verb);
  if (!files.ok()) {
    return files.status();
  }
  PlannedSpatialProgram planned =
      PlanSpatialText(files->text, files->machine, OptionsOf(verb), [&output](double ratio) {
        output.Progress(ratio, "planning");
        return true;
      });
  output.EndProgress();
  machine = std::move(files->machine);
  if (!planned.faults.empty()) {
    TellFaults(verb.program, planned.faults, output);
    return std::nullopt;
  }
  return planned;
}

void TellSummary(const PlannedSpatialProgram& p, Output& output) {
  output.Text(fmt::format(
      "plan {}: {:.2f} s moving, {:.2f} s at gates; {:.1f} mm of path (a turn counts at {:.1f} mm)",
      p.plan.id, p.plan.duration_s, p.gate_time_s, p.plan.length_mm, p.plan.turn_radius_mm));
  output.Text(
      fmt::format("{} segments, {} gates, {} events; farthest from the programmed path {:.4f} mm, {:.6f} rad",
                  p.plan.segments.size(), p.plan.gates.size(), p.plan.events.size(), p.tip_deviation_mm,
                  p.turn_deviation_rad));
  output.Text(fmt::format("struts between {:.1f} and {:.1f} mm; smallest singular margin {:.3f} mm/mm",
                          p.shortest_mm.minCoeff(), p.longest_mm.maxCoeff(), p.singular_margin_ratio));
  TellFeed(FeedOf(p.binding, p.slow), output);
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

CsvTable PointTable(const PlannedSpatialProgram& p, double step_s) {
  CsvTable table({"tau_s",
                  "s_mm",
                  "x_W_mm",
                  "y_W_mm",
                  "z_W_mm",
                  "a_rad",
                  "b_rad",
                  "c_rad",
                  "tip_mm_per_s",
                  "path_mm_per_s",
                  "strut_1_mm",
                  "strut_2_mm",
                  "strut_3_mm",
                  "strut_4_mm",
                  "strut_5_mm",
                  "strut_6_mm",
                  "strut_1_mm_per_s",
                  "strut_2_mm_per_s",
                  "strut_3_mm_per_s",
                  "strut_4_mm_per_s",
                  "strut_5_mm_per_s",
                  "strut_6_mm_per_s",
                  "cutting",
                  "source_line"});
  const auto count = static_cast<std::int64_t>(p.plan.duration_s / step_s + 1e-9);
  for (std::int64_t i = 0; i <= count; ++i) {
    const trajectory::SpatialPlanPoint at = PointAt(p, static_cast<double>(i) * step_s);
    std::vector<double> row = {
        at.tau_s,         at.s_mm,           at.p_W_mm.x(),   at.p_W_mm.y(),         at.p_W_mm.z(),
        at.turn.roll_rad, at.turn.pitch_rad, at.turn.yaw_rad, at.tip_speed_mm_per_s, at.path_speed_mm_per_s};
    row.insert(row.end(), at.struts.q_mm.begin(), at.struts.q_mm.end());
    row.insert(row.end(), at.struts.first.begin(), at.struts.first.end());
    row.push_back(at.cutting ? 1.0 : 0.0);
    row.push_back(static_cast<double>(at.line));
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
    case FeedLimit::kSmoothing:
      return kInk;
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

// The plane Z 0 below the cuts as a grid of 20 mm, and the axes of W at its origin: what the eye needs for depth.
void DrawPlane(PlotFrame& frame, const PlannedSpatialProgram& p) {
  constexpr double kGrid_mm = 20.0, kAxis_mm = 25.0;
  Eigen::Vector2d low = Eigen::Vector2d::Zero(), high = Eigen::Vector2d::Zero();
  for (const SpatialPlanSample& s : p.samples) {
    low = low.cwiseMin(s.p_W_mm.head<2>());
    high = high.cwiseMax(s.p_W_mm.head<2>());
  }
  const auto index = [](double v) { return std::round(v / kGrid_mm); };
  for (double i = index(low.x()) - 1; i <= index(high.x()) + 1; ++i) {
    frame.Line({Seen({i * kGrid_mm, (index(low.y()) - 1) * kGrid_mm, 0.0}),
                Seen({i * kGrid_mm, (index(high.y()) + 1) * kGrid_mm, 0.0})},
               kPale, 0.7);
  }
  for (double i = index(low.y()) - 1; i <= index(high.y()) + 1; ++i) {
    frame.Line({Seen({(index(low.x()) - 1) * kGrid_mm, i * kGrid_mm, 0.0}),
                Seen({(index(high.x()) + 1) * kGrid_mm, i * kGrid_mm, 0.0})},
               kPale, 0.7);
  }
  static constexpr std::array<const char*, 3> kNames = {"X", "Y", "Z"};
  for (int i = 0; i < 3; ++i) {
    const auto end = Seen(kAxis_mm * Eigen::Vector3d::Unit(i));
    frame.Line({Seen(Eigen::Vector3d::Zero()), end}, kInk, 1.2);
    frame.Text(end.first, end.second, kNames[static_cast<std::size_t>(i)]);
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
  DrawPlane(frame, p);
  DrawTool(frame, p, kTool_mm);
  DrawPath(frame, p, by_speed, fastest);
  if (by_speed) {
    std::vector<std::pair<std::string, Colour>> legend;
    for (const double share : {1.0, 0.75, 0.5, 0.25, 0.0}) {
      legend.emplace_back(fmt::format("{:.0f} mm/s", share * fastest), Ramp(share));
    }
    legend.emplace_back("thin: no cut", Ramp(0.5).Faded(0.35));
    legend.emplace_back("tool, 25 mm", kGrey.Faded(0.5));
    frame.Legend(legend, true);
  } else {
    frame.Legend({{"feed or rapid held", kGreen},
                  {"corner or tolerance", kRed},
                  {"curvature", kOrange},
                  {"path acceleration or jerk", kBlue},
                  {"a strut", kViolet},
                  {"none reached: smoothing in time", kInk}},
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
  PlotFrame frame(picture, {80.0, top_px, kSpatialWidth_px - 120.0, 190.0},
                  {0.0, kRoomForLegend * p.plan.duration_s, "program time, s"},
                  {low - room, high + room, label}, title);
  std::vector<std::pair<std::string, Colour>> legend;
  for (std::size_t j = 0; j < kStrutCount; ++j) {
    frame.Line(curves[j], kStrutColours[j], 1.1);
    legend.push_back({fmt::format("strut {}", j + 1), kStrutColours[j]});
  }
  frame.Legend(legend, true);
}

void DrawAll(Picture& picture, const PlannedSpatialProgram& p, const HexapodMotion& m, bool by_speed) {
  DrawPathFrame(picture, {80.0, 50.0, kSpatialWidth_px - 120.0, 560.0}, p, by_speed);
  DrawStruts(picture, 680.0, p, "what the struts' encoders read", "mm",
             [](const trajectory::StrutState& s) { return s.q_mm; });
  DrawStruts(picture, 960.0, p, fmt::format("strut speeds (limit {:.0f} mm/s)", m.strut_velocity_mm_per_s),
             "mm/s", [](const trajectory::StrutState& s) { return s.first; });
  DrawStruts(picture, 1240.0, p,
             fmt::format("strut accelerations (limit {:.0f} mm/s\u00b2)", m.strut_acceleration_mm_per_s2),
             "mm/s\u00b2", [](const trajectory::StrutState& s) { return s.second; });
}

// --- Playing.

void DrawErrors(Picture& picture, double top_px, double duration_s,
                const trajectory::SpatialPlayReport& played) {
  Points tip, drives;
  double high = 1e-6;
  for (const trajectory::PlayedPoint& at : played.trace) {
    tip.push_back({at.tau_s, 1e3 * at.tip_error_mm});
    drives.push_back({at.tau_s, 1e3 * at.drives_tip_error_mm});
    high = std::max({high, 1e3 * at.tip_error_mm, 1e3 * at.drives_tip_error_mm});
  }
  PlotFrame frame(picture, {80.0, top_px, kSpatialWidth_px - 120.0, 190.0},
                  {0.0, kRoomForLegend * duration_s, "program time, s"}, {0.0, 1.1 * high, "\u00b5m"},
                  "tip from the programmed path: as the plan says, and as simulated drives follow");
  frame.Line(drives, kOrange, 1.0);
  frame.Line(tip, kBlue, 1.2);
  frame.Legend({{"plan", kBlue}, {"drives", kOrange}}, true);
}

struct PlayedFigure {
  const char* what;
  const char* key;
  trajectory::WorstPlace worst;
  const char* unit;
  double limit;  // 0: none
};

std::vector<PlayedFigure> FiguresOf(const trajectory::SpatialPlayReport& p) {
  return {
      {"tip from the programmed path", "tip_error_mm", p.tip_error_mm, "mm", 0.0},
      {"turn from the programmed one", "turn_error_rad", p.turn_error_rad, "rad", 0.0},
      {"the larger in shares of tolerance", "tolerance_share", p.tolerance_share, "", 1.0},
      {"ends of blocks missed by", "missed_end_mm", p.missed_end_mm, "mm", 0.0},
      {"tip where simulated drives follow", "drives_tip_error_mm", p.drives_tip_error_mm, "mm", 0.0},
      {"a strut behind its reading", "following_mm", p.following_mm, "mm", 0.0},
      {"strut speed, of its limit", "strut_speed_share", p.strut_speed_share, "", 1.0},
      {"strut acceleration, of its limit", "strut_acceleration_share", p.strut_acceleration_share, "", 1.0},
      {"strut jerk, of its limit", "strut_jerk_share", p.strut_jerk_share, "", 1.0},
      {"path acceleration, of its limit", "path_acceleration_share", p.path_acceleration_share, "", 1.0}};
}

void TellPlay(const trajectory::SpatialPlayReport& p, const HexapodMotion& m, double rate_hz,
              Output& output) {
  output.Text(fmt::format(
      "played at {:.0f} Hz: {} cycles, {} without a pose; {:.3f} s predicted, {:.3f} s played "
      "({:+.3f} %)",
      rate_hz, p.cycles, p.unsolved, p.predicted_s, p.played_s, 100.0 * (p.played_s / p.predicted_s - 1.0)));
  TextTable table{{"worst of", "value", "unit", "allowed", "at s", "line"}, {}};
  nlohmann::json json = {{"cycles", p.cycles},
                         {"unsolved", p.unsolved},
                         {"predicted_s", p.predicted_s},
                         {"played_s", p.played_s}};
  bool kept = p.unsolved == 0;
  for (const PlayedFigure& f : FiguresOf(p)) {
    const bool exceeded = f.limit > 0.0 && f.worst.value > f.limit * (1.0 + 1e-6);
    kept = kept && !exceeded;
    table.rows.push_back({f.what, fmt::format("{:.6f}", f.worst.value), f.unit,
                          f.limit > 0.0 ? fmt::format("{:.0f}", f.limit) : "", Fixed(f.worst.tau_s, 3),
                          std::to_string(f.worst.line)});
    json[f.key] = {{"worst", f.worst.value}, {"tau_s", f.worst.tau_s}, {"line", f.worst.line}};
  }
  output.Table(table);
  output.Text(kept ? fmt::format("every limit and both tolerances ({} mm, {} rad before a G64 P) are kept",
                                 m.corner_tolerance_mm, m.corner_tolerance_rad)
                   : std::string("something is exceeded"),
              kept ? Tone::kGood : Tone::kBad);
  output.Json(json);
  output.Exit(kept ? ExitCode::kOk : ExitCode::kRefused);
}

}  // namespace

absl::Status CheckSpatial(const SpatialVerb& verb, Output& output) {
  const auto files = ReadFiles(verb);
  if (!files.ok()) {
    return files.status();
  }
  const trajectory::SpatialAdmission admission =
      AdmitSpatialProgram(files->text, files->machine, OptionsOf(verb));
  if (!admission.faults.empty()) {
    TellFaults(verb.program, admission.faults, output);
    return absl::OkStatus();
  }
  output.Text(fmt::format("admitted: {:.1f} mm of feed moves, {:.1f} mm idle (turns counted as their shift)",
                          admission.cutting_length_mm, admission.idle_length_mm),
              Tone::kGood);
  output.Json({{"admitted", true},
               {"cutting_length_mm", admission.cutting_length_mm},
               {"idle_length_mm", admission.idle_length_mm}});
  return absl::OkStatus();
}

absl::Status PlanSpatial(const SpatialVerb& verb, Output& output) {
  HexapodModel machine;
  const auto answer = PlanFiles(verb, machine, output);
  if (!answer.ok() || !answer->has_value()) {
    return answer.status();
  }
  const PlannedSpatialProgram& planned = **answer;
  if (!verb.out.empty()) {
    if (const absl::Status status = WriteCsv(verb.out, PointTable(planned, verb.step_s)); !status.ok()) {
      return status;
    }
  }
  if (verb.out != "-") {
    TellSummary(planned, output);
    output.Json(SummaryJson(planned));
  }
  return absl::OkStatus();
}

absl::Status DrawSpatial(const SpatialVerb& verb, Output& output) {
  HexapodModel machine;
  const auto answer = PlanFiles(verb, machine, output);
  if (!answer.ok() || !answer->has_value()) {
    return answer.status();
  }
  Picture picture(kSpatialWidth_px, 1500.0);
  DrawAll(picture, **answer, machine.motion, verb.colour == "speed");
  return picture.Write(verb.picture);
}

absl::Status PlaySpatial(const SpatialVerb& verb, Output& output) {
  HexapodModel machine;
  const auto files = ReadFiles(verb);
  const auto answer = PlanFiles(verb, machine, output);
  if (!answer.ok() || !answer->has_value()) {
    return answer.status();
  }
  const trajectory::PartProgram program = trajectory::ReadSpatialProgram(files->text, machine.motion);
  trajectory::SpatialPlayOptions options;
  options.cycle_s = 1.0 / verb.rate_hz;
  LongWork playing(output, fmt::format("playing {:.0f} s of the plan at {:.0f} Hz",
                                       (*answer)->plan.duration_s, verb.rate_hz));
  options.watch = [&playing](double ratio) { playing.At(ratio); };
  const trajectory::SpatialPlayReport played =
      PlaySpatialPlan(**answer, program.operations, machine, options);
  playing.Done();
  TellPlay(played, machine.motion, verb.rate_hz, output);
  if (verb.picture.empty()) {
    return absl::OkStatus();
  }
  Picture picture(kSpatialWidth_px, 1780.0);
  DrawAll(picture, **answer, machine.motion, verb.colour == "speed");
  DrawErrors(picture, 1520.0, (*answer)->plan.duration_s, played);
  return picture.Write(verb.picture);
}

}  // namespace lambdajet::cli
