#include "trajectory/rpc/submitted_program.hpp"

#include <algorithm>

#include "platform/rpc/argument_checks.hpp"
#include "trajectory/core/toolpath/program_text.hpp"
#include "trajectory/drawing/dxf_file.hpp"

namespace lambdajet::trajectory {
namespace {

using type::v1::ProgramFormat;
using type::v1::ToolpathSettings;

constexpr std::size_t kMostNames = 1000;
constexpr std::size_t kMostFaults = 100;
constexpr double kRightAngle_rad = 1.5707963267948966;
constexpr double kLeastLeadAngle_rad = 0.0872;
constexpr double kMostTurn_rad = 7.0;
constexpr double kFarthest_mm = 1e6;

// Takes settings over, each inside its range; what is not given keeps its default.
class SettingsReader {
 public:
  explicit SettingsReader(const ToolpathSettings& wire) : wire_(wire) {}

  absl::StatusOr<DrawingSettings> Read() {
    ReadLengths();
    ReadTimes();
    ReadContours();
    ReadLists();
    ReadKinds();
    ReadPlace();
    return checks_.ok() ? absl::StatusOr<DrawingSettings>(settings_) : checks_.status();
  }

 private:
  void Take(bool given, const char* field, double value, double least, double most, const char* unit,
            double& to) {
    if (given) {
      checks_.InRange(std::string("toolpath.") + field, value, least, most, unit);
      to = value;
    }
  }

  void ReadLengths() {
    ToolpathOptions& t = settings_.toolpath;
    settings_.kerf_given = wire_.has_kerf_mm();
    Take(wire_.has_kerf_mm(), "kerf_mm", wire_.kerf_mm(), 0.0, 10.0, "mm", t.kerf_mm);
    Take(wire_.has_lead_mm(), "lead_mm", wire_.lead_mm(), 0.1, 100.0, "mm", t.lead_mm);
    Take(wire_.has_lead_angle_rad(), "lead_angle_rad", wire_.lead_angle_rad(), kLeastLeadAngle_rad,
         kRightAngle_rad + 1e-6, "rad", t.lead_angle_rad);
    Take(wire_.has_overlap_mm(), "overlap_mm", wire_.overlap_mm(), 0.0, 50.0, "mm", t.overlap_mm);
    Take(wire_.has_pierce_clearance_mm(), "pierce_clearance_mm", wire_.pierce_clearance_mm(), 0.0, 20.0, "mm",
         t.pierce_clearance_mm);
    Take(wire_.has_tab_spacing_mm(), "tab_spacing_mm", wire_.tab_spacing_mm(), 1.0, 1e5, "mm",
         t.tab_spacing_mm);
    Take(wire_.has_tab_mm(), "tab_mm", wire_.tab_mm(), 0.05, 20.0, "mm", t.tab_mm);
    checks_.InRange("toolpath.tab_count", wire_.tab_count(), 0, 1000);
    t.tab_count = static_cast<int>(wire_.tab_count());
  }

  void ReadTimes() {
    ToolpathOptions& t = settings_.toolpath;
    Take(wire_.has_pierce_time_s(), "pierce_time_s", wire_.pierce_time_s(), 0.0, 600.0, "s", t.pierce_time_s);
    const auto feed = [this](bool given, const char* field, double value, double& to) {
      Take(given, field, value, 0.01, 2000.0, "mm/s", to);
    };
    feed(wire_.has_pierce_feed_mm_per_s(), "pierce_feed_mm_per_s", wire_.pierce_feed_mm_per_s(),
         t.pierce_feed_mm_per_s);
    feed(wire_.has_feed_mm_per_s(), "feed_mm_per_s", wire_.feed_mm_per_s(), t.feed_mm_per_s);
    feed(wire_.has_mark_feed_mm_per_s(), "mark_feed_mm_per_s", wire_.mark_feed_mm_per_s(),
         t.mark_feed_mm_per_s);
  }

  void ReadContours() {
    ContourOptions& c = settings_.contours;
    Take(wire_.has_unit_mm(), "unit_mm", wire_.unit_mm(), 1e-3, 1e4, "mm", c.unit_mm);
    Take(wire_.has_gap_mm(), "gap_mm", wire_.gap_mm(), 1e-6, 10.0, "mm", c.gap_mm);
    Take(wire_.has_curve_tolerance_mm(), "curve_tolerance_mm", wire_.curve_tolerance_mm(), 1e-5, 1.0, "mm",
         c.curve_tolerance_mm);
  }

  template <typename List>
  void TakeList(const char* field, const List& from, std::vector<std::string>& to) {
    checks_.CountInRange(std::string("toolpath.") + field, static_cast<std::size_t>(from.size()), 0,
                         kMostNames);
    to.assign(from.begin(), from.end());
  }

  void ReadLists() {
    ContourOptions& c = settings_.contours;
    TakeList("cut_layers", wire_.cut_layers(), c.cut_layers);
    TakeList("ignore_layers", wire_.ignore_layers(), c.ignore_layers);
    TakeList("mark_layers", wire_.mark_layers(), c.mark_layers);
    TakeList("ignore_types", wire_.ignore_types(), c.ignore_types);
    checks_.CountInRange("toolpath.skip_parts", static_cast<std::size_t>(wire_.skip_parts_size()), 0,
                         kMostNames);
    for (const std::uint32_t part : wire_.skip_parts()) {
      checks_.InRange("toolpath.skip_parts", part, 1, 1e6);
      settings_.toolpath.skip_parts.push_back(static_cast<int>(std::min(part, 1'000'000u)));
    }
  }

  void ReadKinds() {
    checks_.Require(ToolpathSettings::Lead_IsValid(wire_.lead()), "toolpath.lead", "UNKNOWN_LEAD",
                    std::to_string(wire_.lead()) + " is none of the leads");
    checks_.Require(ToolpathSettings::Pierce_IsValid(wire_.pierce()), "toolpath.pierce", "UNKNOWN_PIERCE",
                    std::to_string(wire_.pierce()) + " is none of the pierces");
    ToolpathOptions& t = settings_.toolpath;
    t.lead = wire_.lead() == ToolpathSettings::LEAD_NONE   ? LeadKind::kNone
             : wire_.lead() == ToolpathSettings::LEAD_LINE ? LeadKind::kLine
                                                           : LeadKind::kArc;
    t.pierce = wire_.pierce() == ToolpathSettings::PIERCE_MOVING        ? PierceKind::kMoving
               : wire_.pierce() == ToolpathSettings::PIERCE_PRE_PIERCED ? PierceKind::kPrePierced
                                                                        : PierceKind::kStationary;
    t.shortest_order = !wire_.keep_drawing_order();
  }

  void ReadPlace() {
    Take(wire_.has_turn_rad(), "turn_rad", wire_.turn_rad(), -kMostTurn_rad, kMostTurn_rad, "rad",
         settings_.turn_rad);
    if (wire_.has_corner_x_w_mm() || wire_.has_corner_y_w_mm()) {
      checks_.InRange("toolpath.corner_x_W_mm", wire_.corner_x_w_mm(), -kFarthest_mm, kFarthest_mm, "mm");
      checks_.InRange("toolpath.corner_y_W_mm", wire_.corner_y_w_mm(), -kFarthest_mm, kFarthest_mm, "mm");
      settings_.corner_W_mm = {wire_.corner_x_w_mm(), wire_.corner_y_w_mm()};
    }
  }

  const ToolpathSettings& wire_;
  DrawingSettings settings_;
  ArgumentChecks checks_;
};

absl::Status CheckText(const std::string& program, bool drawing) {
  ArgumentChecks checks;
  checks.NonEmpty("program", program);
  checks.Require(program.size() <= kMostProgramBytes, "program", "PROGRAM_TOO_LARGE",
                 "the program has " + std::to_string(program.size()) + " bytes; at most " +
                     std::to_string(kMostProgramBytes) + " are taken");
  if (checks.ok() && !drawing) {
    checks.Text("program", program, kMostProgramBytes);
  }
  return checks.status();
}

absl::Status CheckFormat(ProgramFormat format, bool has_toolpath) {
  ArgumentChecks checks;
  checks.Require(type::v1::ProgramFormat_IsValid(format), "format", "UNKNOWN_FORMAT",
                 std::to_string(format) + " is none of the formats");
  checks.Require(!has_toolpath || format == type::v1::PROGRAM_FORMAT_DXF, "toolpath", "TOOLPATH_NOT_WANTED",
                 "settings of a toolpath are for drawings, PROGRAM_FORMAT_DXF");
  return checks.status();
}

ProgramFault FaultOf(const Finding& finding) {
  const std::string place = finding.entity.empty()
                                ? ""
                                : EntityText(finding) + " at X" + std::to_string(finding.at_mm.x()) + " Y" +
                                      std::to_string(finding.at_mm.y()) + ": ";
  return {finding.line, 0, finding.reason, finding.entity, place + finding.message};
}

void AddBlocking(const std::vector<Finding>& findings, std::vector<ProgramFault>& faults) {
  for (const Finding& finding : findings) {
    if (finding.blocks && faults.size() < kMostFaults) {
      faults.push_back(FaultOf(finding));
    }
  }
}

MadeProgram ProgramOfDrawing(const std::string& dxf, const DrawingSettings& settings) {
  MadeProgram made;
  const Drawing drawing = ReadDxf(dxf);
  ContourSet contours = FindContours(drawing, settings.contours);
  if (settings.corner_W_mm || settings.turn_rad != 0.0) {
    PlaceContours(contours, settings.turn_rad, settings.corner_W_mm.value_or(Eigen::Vector2d::Zero()));
  }
  AddBlocking(contours.findings, made.faults);
  if (made.faults.empty()) {
    const Toolpath toolpath = MakeToolpath(drawing, contours, settings.toolpath);
    AddBlocking(toolpath.findings, made.faults);
    if (made.faults.empty()) {
      made.text = ProgramText(contours, toolpath, settings.toolpath, "drawing");
    }
  }
  return made;
}

}  // namespace

absl::StatusOr<SubmittedProgram> FromWire(const std::string& program, ProgramFormat format, bool has_toolpath,
                                          const ToolpathSettings& toolpath) {
  const bool drawing = format == type::v1::PROGRAM_FORMAT_DXF;
  if (const absl::Status status = CheckFormat(format, has_toolpath); !status.ok()) {
    return status;
  }
  if (const absl::Status status = CheckText(program, drawing); !status.ok()) {
    return status;
  }
  SubmittedProgram submitted;
  if (drawing) {
    auto settings = SettingsReader(toolpath).Read();
    if (!settings.ok()) {
      return settings.status();
    }
    submitted.drawing = std::move(*settings);
  } else if (format == type::v1::PROGRAM_FORMAT_FLAT_GCODE) {
    submitted.notation = ProgramNotation::kFlatGcode;
  } else if (format != type::v1::PROGRAM_FORMAT_UNSPECIFIED &&
             LooksLikeCldata(program) != (format == type::v1::PROGRAM_FORMAT_CLDATA)) {
    // Named otherwise than it looks; where both agree the plan is that of a request that names no format.
    submitted.notation =
        format == type::v1::PROGRAM_FORMAT_CLDATA ? ProgramNotation::kCldata : ProgramNotation::kGcode;
  }
  submitted.text = program;
  return submitted;
}

MadeProgram MakeProgram(SubmittedProgram submitted, const MachineDescription* machine) {
  if (!submitted.drawing) {
    return {std::move(submitted.text), submitted.notation, {}};
  }
  if (machine != nullptr && !submitted.drawing->kerf_given) {
    submitted.drawing->toolpath.kerf_mm = machine->process.kerf_width_mm;
  }
  MadeProgram made = ProgramOfDrawing(submitted.text, *submitted.drawing);
  if (!made.faults.empty()) {
    made.text = std::move(submitted.text);
  }
  return made;
}

}  // namespace lambdajet::trajectory
