#include <cstdio>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>
#include <vector>

#include "clients/cli/picture_option.hpp"
#include "clients/cli/program_file.hpp"
#include "clients/cli/text_file.hpp"
#include "clients/cli/trajectory_drawing_picture.hpp"
#include "clients/cli/verbs.hpp"
#include "trajectory/core/part_program/gcode_reader.hpp"
#include "trajectory/core/part_program/gcode_writer.hpp"
#include "trajectory/core/toolpath/program_text.hpp"
#include "trajectory/core/toolpath/start_from_line.hpp"
#include "trajectory/drawing/dxf_file.hpp"

namespace lambdajet::cli {
namespace {

using trajectory::ContourOptions;
using trajectory::ContourSet;
using trajectory::CutKind;
using trajectory::Finding;
using trajectory::LeadKind;
using trajectory::PierceKind;
using trajectory::Toolpath;
using trajectory::ToolpathOptions;

struct ToolpathVerb {
  std::string drawing;
  std::string out, picture, reference;
  std::string units = "file";
  double reference_tolerance_mm = 0.15;
  std::vector<double> at_mm;  // x, y; none: as drawn
  double turn_deg = 0.0;
  double lead_angle_deg = 45.0;
  ContourOptions contours;
  ToolpathOptions toolpath;
};

nlohmann::json FindingJson(const Finding& f) {
  return {{"reason", std::string(f.reason)},
          {"blocks", f.blocks},
          {"layer", f.layer},
          {"entity", f.entity},
          {"line", f.line},
          {"dxf_handle", f.dxf_handle},
          {"x_mm", f.at_mm.x()},
          {"y_mm", f.at_mm.y()},
          {"size_mm", f.size_mm},
          {"message", f.message}};
}

void TellFindings(const std::string& file, const std::vector<Finding>& findings, Output& output) {
  std::map<std::string, int> told;
  constexpr int kMostOfAKind = 20;
  for (const Finding& f : findings) {
    const int count = ++told[std::string(f.reason)];
    if (count > kMostOfAKind) {
      continue;
    }
    const std::string place = file + (f.line > 0 ? ":" + std::to_string(f.line) : "");
    const std::string what = f.entity.empty() ? ""
                                              : " " + EntityText(f) + " at X" + Fixed(f.at_mm.x(), 4) + " Y" +
                                                    Fixed(f.at_mm.y(), 4);
    output.Text(place + ": " + std::string(f.reason) + what + ": " + f.message,
                f.blocks ? Tone::kBad : Tone::kWarning);
  }
  for (const auto& [reason, count] : told) {
    if (count > kMostOfAKind) {
      output.Text("… and " + std::to_string(count - kMostOfAKind) + " more of " + reason, Tone::kWarning);
    }
  }
}

nlohmann::json ToolpathJson(const ContourSet& set, const Toolpath& toolpath,
                            const std::vector<Finding>& findings) {
  nlohmann::json cuts = nlohmann::json::array(), list = nlohmann::json::array();
  for (const trajectory::Cut& cut : toolpath.cuts) {
    cuts.push_back({{"kind", cut.kind == CutKind::kMark   ? "mark"
                             : cut.kind == CutKind::kHole ? "hole"
                                                          : "outline"},
                    {"part", cut.part},
                    {"pierce_x_W_mm", cut.pierce().x()},
                    {"pierce_y_W_mm", cut.pierce().y()},
                    {"length_mm", Length(cut.path)},
                    {"lead_in_mm", Length(cut.lead_in)},
                    {"lead_out_mm", Length(cut.lead_out)},
                    {"tabs", cut.tabs.size()}});
  }
  for (const Finding& f : findings) {
    list.push_back(FindingJson(f));
  }
  return {{"parts", set.part_count},
          {"contours", set.contours.size()},
          {"marks", set.marks.size()},
          {"cuts", cuts},
          {"pierces", toolpath.pierce_count},
          {"cut_mm", toolpath.cut_mm},
          {"idle_mm", toolpath.idle_mm},
          {"drawing_order_idle_mm", toolpath.drawing_idle_mm},
          {"findings", list}};
}

absl::Status WriteResults(const ToolpathVerb& verb, const ContourSet& set, const Toolpath& toolpath,
                          bool blocked) {
  if (!verb.picture.empty()) {
    if (const auto status = DrawToolpath(set, toolpath, verb.toolpath, verb.picture); !status.ok()) {
      return status;
    }
  }
  if (blocked) {
    return absl::OkStatus();
  }
  const std::string name = verb.drawing.substr(verb.drawing.find_last_of('/') + 1);
  if (!verb.out.empty()) {
    if (const auto status = WriteTextFile(verb.out, ProgramText(set, toolpath, verb.toolpath, name));
        !status.ok()) {
      return status;
    }
  }
  return verb.reference.empty()
             ? absl::OkStatus()
             : WriteTextFile(verb.reference, ReferenceDrawingText(set, toolpath, verb.toolpath,
                                                                  name.substr(0, name.find('.')),
                                                                  verb.reference_tolerance_mm));
}

absl::Status MakeToolpathOf(const ToolpathVerb& verb, Output& output) {
  const auto text = ReadTextFile(verb.drawing);
  if (!text.ok()) {
    return text.status();
  }
  const trajectory::Drawing drawing = trajectory::ReadDxf(*text);
  ContourSet set = FindContours(drawing, verb.contours);
  if (!verb.at_mm.empty() || verb.turn_deg != 0.0) {
    const Eigen::Vector2d corner =
        verb.at_mm.empty() ? Eigen::Vector2d(0, 0) : Eigen::Vector2d(verb.at_mm[0], verb.at_mm[1]);
    PlaceContours(set, verb.turn_deg * std::numbers::pi / 180.0, corner);
  }
  const Toolpath toolpath = set.blocked() ? Toolpath{} : MakeToolpath(drawing, set, verb.toolpath);
  const bool blocked = set.blocked() || toolpath.blocked();
  std::vector<Finding> findings = set.findings;
  findings.insert(findings.end(), toolpath.findings.begin(), toolpath.findings.end());
  if (const auto status = WriteResults(verb, set, toolpath, blocked); !status.ok()) {
    return status;
  }
  if (verb.out == "-") {
    return absl::OkStatus();
  }
  TellFindings(verb.drawing, findings, output);
  output.Json(ToolpathJson(set, toolpath, findings));
  if (blocked) {
    output.Exit(ExitCode::kRefused);
    return absl::OkStatus();
  }
  const double gain =
      toolpath.drawing_idle_mm > 0.0 ? 100.0 * (1.0 - toolpath.idle_mm / toolpath.drawing_idle_mm) : 0.0;
  output.Text("parts " + std::to_string(set.part_count) + ", cuts " + std::to_string(toolpath.cuts.size()) +
                  ", pierces " + std::to_string(toolpath.pierce_count) + "; " + Fixed(toolpath.cut_mm, 1) +
                  " mm cut, " + Fixed(toolpath.idle_mm, 1) + " mm idle, " + Fixed(gain, 1) +
                  " % less than in the drawing's order",
              Tone::kGood);
  return absl::OkStatus();
}

void AddContourOptions(CLI::App& app, ToolpathVerb& verb) {
  app.add_option("--units", verb.units, "of the drawing; file: as $INSUNITS says")
      ->check(CLI::IsMember({"file", "mm", "inch"}))
      ->capture_default_str();
  app.add_option("--gap-mm", verb.contours.gap_mm, "ends this near are joined")
      ->check(CLI::Range(1e-6, 10.0))
      ->capture_default_str();
  app.add_option("--curve-tolerance-mm", verb.contours.curve_tolerance_mm,
                 "of ellipses and splines from their arcs")
      ->check(CLI::Range(1e-5, 1.0))
      ->capture_default_str();
  app.add_option("--cut", verb.contours.cut_layers, "layer to cut, may be given again; none: all others");
  app.add_option("--ignore", verb.contours.ignore_layers, "layer to leave out, may be given again");
  app.add_option("--mark", verb.contours.mark_layers, "layer to scribe along its lines, may be given again");
  app.add_option("--ignore-type", verb.contours.ignore_types,
                 "entity type to leave out (TEXT, …), may be given again");
  app.add_option("--at-mm", verb.at_mm, "X Y in W of the drawing's lower left corner; none: as drawn")
      ->expected(2);
  app.add_option("--turn-deg", verb.turn_deg, "turns the drawing counter-clockwise");
}

void AddCutOptions(CLI::App& app, ToolpathVerb& verb) {
  static const std::map<std::string, LeadKind> kLeads = {
      {"none", LeadKind::kNone}, {"line", LeadKind::kLine}, {"arc", LeadKind::kArc}};
  static const std::map<std::string, PierceKind> kPierces = {{"stationary", PierceKind::kStationary},
                                                             {"moving", PierceKind::kMoving},
                                                             {"pre-pierced", PierceKind::kPrePierced}};
  ToolpathOptions& t = verb.toolpath;
  app.add_option("--kerf-mm", t.kerf_mm, "width of the cut")
      ->check(CLI::Range(0.0, 10.0))
      ->capture_default_str();
  app.add_option("--cut-feed-mm-per-s", t.feed_mm_per_s, "of the cut")
      ->check(CLI::Range(0.01, 2000.0))
      ->capture_default_str();
  app.add_option("--lead", t.lead, "none, line or arc")->transform(CLI::CheckedTransformer(kLeads));
  app.add_option("--lead-mm", t.lead_mm, "length of a line, radius of an arc")
      ->check(CLI::Range(0.1, 100.0))
      ->capture_default_str();
  app.add_option("--lead-angle-deg", verb.lead_angle_deg, "of a line to the path")
      ->check(CLI::Range(5.0, 90.0))
      ->capture_default_str();
  app.add_option("--lead-overlap-mm", t.overlap_mm, "cut again where the path closes")
      ->check(CLI::Range(0.0, 50.0))
      ->capture_default_str();
  app.add_option("--pierce", t.pierce, "stationary, moving or pre-pierced")
      ->transform(CLI::CheckedTransformer(kPierces));
  app.add_option("--pierce-time-s", t.pierce_time_s, "0: the machine's own")->check(CLI::Range(0.0, 600.0));
  app.add_option("--pierce-clearance-mm", t.pierce_clearance_mm, "more distance for pierces")
      ->check(CLI::Range(0.0, 20.0));
  app.add_option("--pierce-feed-mm-per-s", t.pierce_feed_mm_per_s, "of a moving pierce")
      ->check(CLI::Range(0.01, 2000.0));
  app.add_option("--tabs", t.tab_count, "tabs on each outline")->check(CLI::Range(0, 1000));
  app.add_option("--tab-spacing-mm", t.tab_spacing_mm, "instead of a number of tabs")
      ->check(CLI::Range(1.0, 1e5));
  app.add_option("--tab-mm", t.tab_mm, "what a tab leaves standing")
      ->check(CLI::Range(0.05, 20.0))
      ->capture_default_str();
  app.add_flag("!--drawing-order", t.shortest_order,
               "keep the drawing's order as far as inner before outer allows");
  app.add_option("--skip-part", t.skip_parts, "number of a part that is not cut, may be given again");
}

// ---- start from a line ----

struct LineVerb {
  std::string program;
  std::string out;
  std::uint32_t line = 1;
};

absl::Status TellLineStart(const LineVerb& verb, Output& output) {
  const auto text = ReadProgramFile(verb.program);
  if (!text.ok()) {
    return text.status();
  }
  const trajectory::PartProgram program = trajectory::ReadGcode(*text);
  if (!program.faults.empty()) {
    const auto& fault = program.faults.front();
    output.Fail(ExitCode::kRefused, fault.reason,
                "line " + std::to_string(fault.line) + ": " + fault.message);
    return absl::OkStatus();
  }
  const trajectory::LineStart start = trajectory::StartFromLine(program.operations, verb.line);
  if (!start.reason.empty()) {
    output.Fail(ExitCode::kRefused, start.reason,
                "nothing is done in line " + std::to_string(verb.line) + " or after it");
    return absl::OkStatus();
  }
  if (!verb.out.empty()) {
    return WriteTextFile(verb.out, trajectory::WriteGcode(start.operations, verb.program + " from line " +
                                                                                std::to_string(verb.line)));
  }
  for (std::size_t i = 0; i < start.operations.size(); ++i) {
    output.Text(FormatOperation(start.operations[i]),
                i < start.restored_count ? Tone::kWarning : Tone::kPlain);
  }
  const trajectory::ModalState& s = start.state;
  output.Json({{"x_W_mm", s.x_W_mm},
               {"y_W_mm", s.y_W_mm},
               {"feed_mm_per_s", s.feed_mm_per_s},
               {"unit_mm", s.unit_mm},
               {"distance_mode", s.distance_g_value},
               {"work_offset", s.work_offset_g_value},
               {"path_tolerance_mm", s.path_tolerance_mm},
               {"jet_on", s.jet_on},
               {"abrasive_on", s.abrasive_on},
               {"abrasive_flow_g_per_min", s.abrasive_flow_g_per_min},
               {"restored_operations", start.restored_count},
               {"operations", start.operations.size()}});
  return absl::OkStatus();
}

}  // namespace

void AddDrawingVerbs(CLI::App& noun, Output& output) {
  const auto verb = std::make_shared<ToolpathVerb>();
  CLI::App* app = noun.add_subcommand(
      "toolpath", "a part program from a DXF drawing: kerf, leads, order; exit code 4 if it cannot be cut");
  app->add_option("FILE", verb->drawing, "DXF file; - is standard input")->required();
  app->add_option("--out", verb->out, "part program; - is standard output");
  AddPictureOption(*app, "--picture", verb->picture, "of drawing and toolpath");
  app->add_option("--reference", verb->reference, "YAML of the finished geometry, for inspection");
  app->add_option("--reference-tolerance-mm", verb->reference_tolerance_mm, "in it")
      ->check(CLI::Range(1e-4, 10.0));
  AddContourOptions(*app, *verb);
  AddCutOptions(*app, *verb);
  app->callback([verb, &output] {
    verb->contours.unit_mm = verb->units == "mm" ? 1.0 : verb->units == "inch" ? 25.4 : 0.0;
    verb->toolpath.lead_angle_rad = verb->lead_angle_deg * std::numbers::pi / 180.0;
    output.Finish(MakeToolpathOf(*verb, output));
  });
  const auto line = std::make_shared<LineVerb>();
  CLI::App* from =
      noun.add_subcommand("from-line", "the modal state at a line, and the operations from there on");
  from->add_option("FILE", line->program, "G-code file; - is standard input")->required();
  from->add_option("LINE", line->line, "first line that is obeyed")->required();
  from->add_option("--out", line->out, "a program of its own that begins there; - is standard output");
  from->callback([line, &output] { output.Finish(TellLineStart(*line, output)); });
}

}  // namespace lambdajet::cli
