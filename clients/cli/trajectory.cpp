#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "clients/cli/csv.hpp"
#include "clients/cli/picture.hpp"
#include "clients/cli/picture_option.hpp"
#include "clients/cli/plan_feed.hpp"
#include "clients/cli/program_faults.hpp"
#include "clients/cli/program_file.hpp"
#include "clients/cli/text_file.hpp"
#include "clients/cli/tolerance_option.hpp"
#include "clients/cli/trajectory_pictures.hpp"
#include "clients/cli/trajectory_spatial.hpp"
#include "clients/cli/verbs.hpp"
#include "foundation/contract/trouble.hpp"
#include "platform/machine_file/machine_file.hpp"
#include "trajectory/core/feed/plan_program.hpp"
#include "trajectory/core/feed/plan_samples.hpp"
#include "trajectory/core/part_program/read_program.hpp"
#include "trajectory/core/tolerance/plan_to_tolerance.hpp"

namespace lambdajet::cli {
namespace {

using trajectory::PlannedProgram;
using trajectory::PlanOptions;
using trajectory::ProgramFault;

constexpr double kDefaultStep_s = 0.004;

struct ProgramVerb {
  std::string program;
  std::string machine = "deploy/config/machine.yaml";
  std::string hexapod;  // set: its file instead of the machine's
  std::string out;
  std::string picture;
  std::string colour = "speed";
  double step_s = kDefaultStep_s;
  double rate_hz = 10000.0;
  double start_from_s_mm = -1.0;
  double tolerance_mm = 0.0;  // 0: none
  std::vector<std::string> tolerance_lines;
  std::vector<std::string> tolerance_contours;
  PlanOptions options;
  std::string axes = "xy";
  trajectory::GcodeOptions reading;
};

absl::Status Canon(const ProgramVerb& verb, Output& output) {
  const auto text = ReadProgramFile(verb.program);
  if (!text.ok()) {
    return text.status();
  }
  trajectory::ReadOptions reading;
  reading.gcode = verb.reading;
  reading.gcode.axes = reading.cldata.axes = AxesOf(verb.axes);
  reading.cldata.tool_angles = ToolAnglesOf(verb.axes);
  if (reading.gcode.kerf_width_mm <= 0.0) {  // not told: the machine's, as it would be cut
    const auto machine = ReadMachineFile(verb.machine);
    reading.gcode.kerf_width_mm = machine.ok() ? machine->process.kerf_width_mm : 0.0;
  }
  const trajectory::PartProgram program = trajectory::ReadPartProgram(*text, reading);
  if (!program.faults.empty()) {
    TellFaults(verb.program, program.faults, output);
    return absl::OkStatus();
  }
  for (const trajectory::Operation& o : program.operations) {
    output.Text(FormatOperation(o));
    if (output.json()) {
      output.Json({{"line", o.line},
                   {"operation", std::string(OperationName(o.kind))},
                   {"x_W_mm", o.x_W_mm},
                   {"y_W_mm", o.y_W_mm},
                   {"z_W_mm", o.z_W_mm},
                   {"a_rad", o.a_rad},
                   {"b_rad", o.b_rad},
                   {"c_rad", o.c_rad},
                   {"plane", 17 + static_cast<int>(o.plane)},
                   {"center_x_W_mm", o.center_x_W_mm},
                   {"center_y_W_mm", o.center_y_W_mm},
                   {"center_z_W_mm", o.center_z_W_mm},
                   {"sweep_rad", o.sweep_rad},
                   {"feed_mm_per_s", o.feed_mm_per_s},
                   {"kerf_offset_mm", o.kerf_offset_mm},
                   {"value", o.value}});
    }
  }
  return absl::OkStatus();
}

SpatialVerb SpatialOf(const ProgramVerb& verb) {
  return {
      verb.program, verb.hexapod, verb.out, verb.picture, verb.colour, verb.step_s, verb.options.feed_scale,
      verb.rate_hz};
}

absl::Status Check(const ProgramVerb& verb, Output& output) {
  if (!verb.hexapod.empty()) {
    return CheckSpatial(SpatialOf(verb), output);
  }
  const auto text = ReadProgramFile(verb.program);
  const auto machine = ReadMachineFile(verb.machine);
  if (!text.ok() || !machine.ok()) {
    return text.ok() ? machine.status() : text.status();
  }
  const trajectory::Admission admission = trajectory::AdmitPartProgram(*text, *machine, verb.options);
  if (!admission.faults.empty()) {
    TellFaults(verb.program, admission.faults, output);
    return absl::OkStatus();
  }
  output.Text("admitted: " + Fixed(admission.cutting_length_mm, 1) + " mm of cuts, " +
                  std::to_string(admission.pierce_count) + " pierces, " + Fixed(admission.idle_length_mm, 1) +
                  " mm idle",
              Tone::kGood);
  output.Json({{"admitted", true},
               {"cutting_length_mm", admission.cutting_length_mm},
               {"idle_length_mm", admission.idle_length_mm},
               {"pierces", admission.pierce_count}});
  return absl::OkStatus();
}

void AddWishes(const ProgramVerb& verb, PlanOptions& options) {
  if (verb.tolerance_mm > 0.0) {
    options.hold.push_back({verb.tolerance_mm});
  }
  for (const std::string& text : verb.tolerance_lines) {
    const ToleranceWord word = ParseTolerance(text).value_or(ToleranceWord{});
    options.hold.push_back({word.tolerance_mm, word.first, word.last, 0});
  }
  for (const std::string& text : verb.tolerance_contours) {
    const ToleranceWord word = ParseTolerance(text).value_or(ToleranceWord{});
    options.hold.push_back({word.tolerance_mm, 0, 0, word.first});
  }
}

// The plan, or nothing after its faults were told.
absl::StatusOr<trajectory::TolerancePlan> PlanFile(const ProgramVerb& verb, Output& output,
                                                   MachineDescription& machine) {
  const auto text = ReadProgramFile(verb.program);
  const auto read = ReadMachineFile(verb.machine);
  if (!text.ok() || !read.ok()) {
    return text.ok() ? read.status() : text.status();
  }
  machine = *read;
  PlanOptions options = verb.options;
  if (verb.start_from_s_mm >= 0.0) {
    options.start_from_s_mm = verb.start_from_s_mm;
  }
  AddWishes(verb, options);
  trajectory::TolerancePlan planned = PlanToTolerance(*text, machine, options, [&output](double ratio) {
    output.Progress(ratio, "planning");
    return true;
  });
  output.EndProgress();
  return planned;
}

nlohmann::json SummaryJson(const PlannedProgram& p) {
  nlohmann::json idle = nlohmann::json::array();
  for (const auto& i : p.idle) {
    idle.push_back({{"line", i.line},
                    {"law", std::string(i.law)},
                    {"reason", std::string(i.reason)},
                    {"duration_s", i.duration_s},
                    {"start_speed_mm_per_s", i.start_speed_mm_per_s},
                    {"peak_acceleration_mm_per_s2", i.peak_acceleration_mm_per_s2}});
  }
  return {{"plan_id", std::to_string(p.plan.id)},
          {"duration_s", p.plan.duration_s},
          {"gate_time_s", p.gate_time_s},
          {"cutting_time_s", p.cutting_time_s},
          {"length_mm", p.plan.length_mm},
          {"cutting_length_mm", p.cutting_length_mm},
          {"segments", p.plan.segments.size()},
          {"gates", p.plan.gates.size()},
          {"events", p.plan.events.size()},
          {"compensated", p.plan.compensated},
          {"contour_deviation_mm", p.contour_deviation_mm},
          {"binding", BindingJson(p.binding)},
          {"slow", SlowJson(p.slow)},
          {"idle", idle}};
}

void TellSummary(const PlannedProgram& p, Output& output) {
  output.Text("plan " + std::to_string(p.plan.id) + ": " + Fixed(p.plan.duration_s, 2) + " s moving, " +
              Fixed(p.gate_time_s, 2) + " s at gates; cutting " + Fixed(p.cutting_length_mm, 1) + " mm in " +
              Fixed(p.cutting_time_s, 2) + " s");
  output.Text(std::to_string(p.plan.segments.size()) + " segments, " + std::to_string(p.plan.gates.size()) +
              " gates, " + std::to_string(p.plan.events.size()) + " events; farthest from the contour " +
              Fixed(p.contour_deviation_mm, 4) + " mm");
  TellFeed(FeedOf(p.binding, p.slow), output);
}

CsvTable SampleTable(const PlannedProgram& p, double step_s) {
  CsvTable table({"tau_s", "s_mm", "x_W_mm", "y_W_mm", "vx_W_mm_per_s", "vy_W_mm_per_s", "ax_W_mm_per_s2",
                  "ay_W_mm_per_s2", "actuator_1_mm", "actuator_2_mm", "actuator_1_mm_per_s",
                  "actuator_2_mm_per_s", "cutting", "source_line"});
  const auto count = static_cast<std::int64_t>(p.plan.duration_s / step_s + 1e-9);
  for (std::int64_t i = 0; i <= count; ++i) {
    const trajectory::FullSample s = SampleAt(p, static_cast<double>(i) * step_s);
    table.AddRow(std::vector<double>{s.jet.tau_s, s.jet.s_mm, s.jet.x_W_mm, s.jet.y_W_mm, s.jet.vx_W_mm_per_s,
                                     s.jet.vy_W_mm_per_s, s.jet.ax_W_mm_per_s2, s.jet.ay_W_mm_per_s2,
                                     s.actuator_mm[0], s.actuator_mm[1], s.actuator_mm_per_s[0],
                                     s.actuator_mm_per_s[1], s.jet.cutting ? 1.0 : 0.0,
                                     static_cast<double>(s.jet.source_line)});
  }
  return table;
}

void TellTolerance(const trajectory::ToleranceReport& report, Output& output) {
  if (!report.asked) {
    return;
  }
  TextTable held{{"contour", "lines", "tolerance mm", "predicted 95 % mm", "worst mm", "at line", "left mm",
                  "most from"},
                 {}};
  nlohmann::json list = nlohmann::json::array();
  for (const trajectory::HeldTolerance& h : report.held) {
    const std::string source(accuracy::SourceName(h.worst_source));
    held.rows.push_back({std::to_string(h.contour),
                         std::to_string(h.first_line) + "-" + std::to_string(h.last_line),
                         Fixed(h.tolerance_mm, 3), Fixed(h.predicted_95_mm, 4), Fixed(h.worst_mm, 4),
                         std::to_string(h.worst_line), Fixed(h.margin_mm, 4), source});
    list.push_back({{"contour", h.contour},
                    {"first_line", h.first_line},
                    {"last_line", h.last_line},
                    {"tolerance_mm", h.tolerance_mm},
                    {"predicted_95_mm", h.predicted_95_mm},
                    {"worst_mm", h.worst_mm},
                    {"worst_line", h.worst_line},
                    {"margin_mm", h.margin_mm},
                    {"worst_source", source}});
  }
  output.Text("feed from tolerance, " + std::to_string(report.plans) +
              " plans tried; the limits alone would allow " + Fixed(report.fastest_s, 2) + " s");
  output.Table(held);
  output.Json({{"held_tolerances", list}, {"fastest_s", report.fastest_s}, {"plans_tried", report.plans}});
}

absl::Status PlanVerb(const ProgramVerb& verb, Output& output) {
  if (!verb.hexapod.empty()) {
    return PlanSpatial(SpatialOf(verb), output);
  }
  MachineDescription machine;
  const auto answer = PlanFile(verb, output, machine);
  if (!answer.ok()) {
    return answer.status();
  }
  const PlannedProgram& planned = answer->planned;
  if (!planned.faults.empty()) {
    TellFaults(verb.program, planned.faults, output);
    return absl::OkStatus();
  }
  if (!verb.out.empty()) {
    if (const absl::Status status = WriteCsv(verb.out, SampleTable(planned, verb.step_s)); !status.ok()) {
      return status;
    }
  }
  if (verb.out != "-") {
    TellSummary(planned, output);
    output.Json(SummaryJson(planned));
    TellTolerance(answer->report, output);
  }
  return absl::OkStatus();
}

absl::Status DrawVerb(const ProgramVerb& verb, Output& output) {
  if (!verb.hexapod.empty()) {
    return DrawSpatial(SpatialOf(verb), output);
  }
  MachineDescription machine;
  const auto answer = PlanFile(verb, output, machine);
  if (!answer.ok()) {
    return answer.status();
  }
  if (!answer->planned.faults.empty()) {
    TellFaults(verb.program, answer->planned.faults, output);
    return absl::OkStatus();
  }
  return DrawPlan(answer->planned, machine, verb.colour, verb.picture);
}

CLI::App* AddProgramVerb(CLI::App& noun, Output& output, const char* name, const char* what,
                         const std::shared_ptr<ProgramVerb>& verb,
                         absl::Status (*work)(const ProgramVerb&, Output&)) {
  CLI::App* app = noun.add_subcommand(name, what);
  app->add_option("FILE", verb->program, "G-code or CLDATA file; - is standard input")->required();
  app->callback([verb, work, &output] {
    if (const absl::Status status = work(*verb, output);
        !status.ok()) {  // faults have set their own exit code
      output.Fail(status);
    }
  });
  return app;
}

void AddMachineOptions(CLI::App& app, const std::shared_ptr<ProgramVerb>& verb) {
  app.add_flag_function(
      "--leave-out-z",
      [verb](std::int64_t) { verb->options.notation = trajectory::ProgramNotation::kFlatGcode; },
      "flat G-code of a post with Z: Z words and tool lengths are read over");
  app.add_option("--machine", verb->machine, "YAML file of the machine")->capture_default_str();
  app.add_option("--hexapod", verb->hexapod, "YAML file of a hexapod, for programs in X Y Z A B C")
      ->excludes("--machine");
}

void AddFeedScale(CLI::App& app, const std::shared_ptr<ProgramVerb>& verb) {
  app.add_option("--feed-scale", verb->options.feed_scale, "factor on programmed feeds, above 0 to 1.2")
      ->check(CLI::Range(1e-6, 1.2));
}

void AddPlanOptions(CLI::App& app, const std::shared_ptr<ProgramVerb>& verb) {
  AddMachineOptions(app, verb);
  app.add_flag("--compensate", verb->options.compensate, "elastic feed-forward");
  app.add_option("--tolerance-mm", verb->tolerance_mm,
                 "feed from tolerance: as fast as the predicted contour error allows")
      ->check(CLI::Range(0.001, 10.0));
  app.add_option("--tolerance-lines", verb->tolerance_lines, "the same for lines, as 20-40=0.05")
      ->check(ToleranceWordFault);
  app.add_option("--tolerance-contour", verb->tolerance_contours, "the same for the n-th cut, as 2=0.05")
      ->check(ToleranceWordFault);
  AddFeedScale(app, verb);
  app.add_option("--start-from-s-mm", verb->start_from_s_mm, "resume: path length already cut");
  app.add_option("--overlap-mm", verb->options.overlap_mm, "resume: backed up by this");
}

}  // namespace

void AddTrajectoryVerbs(CLI::App& noun, Output& output) {
  const auto canon = std::make_shared<ProgramVerb>();
  CLI::App* canon_app =
      AddProgramVerb(noun, output, "canon", "the program's canonical operations, one a line", canon, Canon);
  AddAxesOption(*canon_app, canon->axes);
  canon_app->add_flag("--leave-out-z", canon->reading.leave_out_z,
                      "with xy: Z words of a flat program are read over, not refused");
  canon_app->add_option("--kerf-width-mm", canon->reading.kerf_width_mm,
                        "for G41 and G42 without a width; default: the machine's");
  canon_app->add_option("--machine", canon->machine, "YAML file of the machine")->capture_default_str();
  const auto check = std::make_shared<ProgramVerb>();
  CLI::App* check_app =
      AddProgramVerb(noun, output, "check", "whether a program can be cut; exit code 4 if not", check, Check);
  AddMachineOptions(*check_app, check);
  const auto play = std::make_shared<ProgramVerb>();
  play->hexapod = "deploy/config/hexapod.yaml";
  CLI::App* play_app = AddProgramVerb(
      noun, output, "play", "plays a hexapod's plan through its kinematics: error of the tip, limits, time",
      play, [](const ProgramVerb& verb, Output& to) { return PlaySpatial(SpatialOf(verb), to); });
  play_app->add_option("--hexapod", play->hexapod, "YAML file of the hexapod")->capture_default_str();
  AddFeedScale(*play_app, play);
  play_app->add_option("--rate-hz", play->rate_hz, "cycles a second")
      ->check(CLI::Range(100.0, 100000.0))
      ->capture_default_str();
  AddPictureOption(*play_app, "--picture", play->picture, "of path, struts and errors");
  const auto plan = std::make_shared<ProgramVerb>();
  CLI::App* plan_app =
      AddProgramVerb(noun, output, "plan",
                     "plans a program: time, feed held, what limits it, points over time", plan, PlanVerb);
  AddPlanOptions(*plan_app, plan);
  plan_app->add_option("--out", plan->out, "CSV of points over time; - is standard output");
  plan_app->add_option("--step-s", plan->step_s, "distance of the points")->check(CLI::Range(0.0001, 1.0));
  const auto draw = std::make_shared<ProgramVerb>();
  CLI::App* draw_app =
      AddProgramVerb(noun, output, "draw", "toolpath and profiles over time as SVG or PNG", draw, DrawVerb);
  AddPlanOptions(*draw_app, draw);
  AddPictureOption(*draw_app, "--out", draw->picture, "of the plan")->required();
  draw_app->add_option("--colour", draw->colour, "what the path's colour says")
      ->check(CLI::IsMember({"speed", "limit", "error"}))
      ->capture_default_str();
  AddCldataVerbs(noun, output);
}

}  // namespace lambdajet::cli
