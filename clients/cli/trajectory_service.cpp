// Part programs and plans over TrajectoryService: check, plan, show, samples.
#include "clients/cli/trajectory_service.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <map>
#include <numbers>

#include "clients/cli/csv.hpp"
#include "clients/cli/feed_report.hpp"
#include "clients/cli/service_verbs.hpp"
#include "clients/cli/text_file.hpp"
#include "clients/cli/tolerance_option.hpp"
#include "foundation/contract/trouble.hpp"
#include "lambdajet/trajectory/v1/trajectory.grpc.pb.h"

namespace lambdajet::cli {
namespace {

namespace trajectory_v1 = trajectory::v1;
using trajectory_v1::TrajectoryService;

constexpr double kPlanning_s = 600.0;
const std::vector<std::string> kSpatialColumns = {"tau_s",
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
                                                  "source_line"};

struct ProgramOptions {
  std::string file;
  FormatOptions format;
  std::string mechanism = "lambda";
  bool compensate = false;
  std::optional<double> tolerance_mm;
  std::vector<std::string> tolerance_lines;
  std::vector<std::string> tolerance_contours;
  std::optional<double> feed_scale;
  std::optional<double> start_from_s_mm;
  std::optional<double> overlap_mm;
  std::optional<std::uint32_t> machine_version;
};

void AddMechanismOption(CLI::App& verb, std::string& mechanism) {
  verb.add_option("--mechanism", mechanism, "the machine that is meant; hexapod: the service's own")
      ->check(CLI::IsMember({"lambda", "hexapod"}))
      ->capture_default_str();
}

trajectory_v1::Mechanism MechanismOf(const std::string& name) {
  return name == "hexapod" ? trajectory_v1::MECHANISM_HEXAPOD : trajectory_v1::MECHANISM_UNSPECIFIED;
}

void AddProgramOptions(CLI::App& verb, ProgramOptions& options) {
  verb.add_option("FILE", options.file, "G-code, CLDATA or DXF; - is standard input")->required();
  AddFormatOptions(verb, options.format);
  AddMechanismOption(verb, options.mechanism);
  verb.add_flag("--compensate", options.compensate, "elastic feed-forward");
  verb.add_option("--tolerance-mm", options.tolerance_mm,
                  "feed from tolerance: as fast as the predicted contour error allows");
  verb.add_option("--tolerance-lines", options.tolerance_lines, "the same for lines, as 20-40=0.05")
      ->check(ToleranceWordFault);
  verb.add_option("--tolerance-contour", options.tolerance_contours, "the same for the n-th cut, as 2=0.05")
      ->check(ToleranceWordFault);
  verb.add_option("--feed-scale", options.feed_scale, "factor on programmed feeds, up to 1.2");
  verb.add_option("--start-from-s-mm", options.start_from_s_mm, "path length already cut");
  verb.add_option("--overlap-mm", options.overlap_mm, "with --start-from-s-mm: back up this far");
  verb.add_option("--machine-version", options.machine_version, "only with this version of the machine");
}

trajectory_v1::PlanOptions ToWire(const ProgramOptions& options) {
  trajectory_v1::PlanOptions wire;
  wire.set_mechanism(MechanismOf(options.mechanism));
  wire.set_compensate(options.compensate);
  if (options.tolerance_mm) wire.set_tolerance_mm(*options.tolerance_mm);
  for (const std::string& text : options.tolerance_lines) {
    const ToleranceWord word = ParseTolerance(text).value_or(ToleranceWord{});
    trajectory_v1::ToleranceWish& wish = *wire.add_tolerances();
    wish.set_tolerance_mm(word.tolerance_mm);
    wish.set_first_line(word.first);
    wish.set_last_line(word.last);
  }
  for (const std::string& text : options.tolerance_contours) {
    const ToleranceWord word = ParseTolerance(text).value_or(ToleranceWord{});
    trajectory_v1::ToleranceWish& wish = *wire.add_tolerances();
    wish.set_tolerance_mm(word.tolerance_mm);
    wish.set_contour(word.first);
  }
  if (options.feed_scale) wire.set_feed_scale(*options.feed_scale);
  if (options.start_from_s_mm) wire.set_start_from_s_mm(*options.start_from_s_mm);
  if (options.overlap_mm) wire.set_overlap_mm(*options.overlap_mm);
  if (options.machine_version) wire.set_machine_version(*options.machine_version);
  return wire;
}

// The file as a request takes it.
template <typename Request>
absl::Status Fill(const std::string& file, const FormatOptions& format, Request& request) {
  const auto program = ReadTextFile(file);
  if (!program.ok()) {
    return program.status();
  }
  request.set_program(*program);
  request.set_format(FormatOf(format, file));
  if (format.toolpath_given) {
    *request.mutable_toolpath() = format.toolpath;
  }
  return absl::OkStatus();
}

void PrintFaults(const google::protobuf::RepeatedPtrField<trajectory_v1::ProgramFault>& faults,
                 Output& output) {
  for (const trajectory_v1::ProgramFault& fault : faults) {
    output.Text(fmt::format("line {}, column {}: {}: {}", fault.line(), fault.column(), fault.reason(),
                            fault.message()),
                Tone::kBad);
  }
}

void PrintSpatial(const trajectory_v1::PlanSummary& plan, Output& output) {
  const trajectory_v1::SpatialSummary& s = plan.spatial();
  output.Table(
      {{"what", "value", "unit"},
       {{"plan", std::to_string(plan.plan_id()), ""},
        {"hexapod", plan.model_version().machine_id(), ""},
        {"duration without gates", Fixed(plan.duration_s(), 2), "s"},
        {"gates", Fixed(plan.gate_time_s(), 2), "s"},
        {"feed moves", Fixed(plan.cutting_time_s(), 2), "s"},
        {"path, turns as shifts", Fixed(plan.length_mm(), 1), "mm"},
        {"of it feed moves", Fixed(plan.cutting_length_mm(), 1), "mm"},
        {"a turn counts at", Fixed(s.turn_radius_mm(), 1), "mm"},
        {"segments", std::to_string(plan.segment_count()), ""},
        {"gates and events", fmt::format("{} and {}", plan.gate_count(), plan.event_count()), ""},
        {"path tolerance used", Fixed(plan.contour_tolerance_used_mm(), 4), "mm"},
        {"turn tolerance used", Fixed(s.turn_deviation_rad(), 6), "rad"},
        {"struts", fmt::format("{:.1f} to {:.1f}", s.shortest_strut_mm(), s.longest_strut_mm()), "mm"},
        {"singular margin", Fixed(s.singular_margin_ratio(), 3), "mm/mm"}}});
}

void PrintLambda(const trajectory_v1::PlanSummary& plan, Output& output) {
  output.Table({{"what", "value", "unit"},
                {{"plan", std::to_string(plan.plan_id()), ""},
                 {"machine version", std::to_string(plan.model_version().version()), ""},
                 {"duration without gates", Fixed(plan.duration_s(), 2), "s"},
                 {"gates", Fixed(plan.gate_time_s(), 2), "s"},
                 {"cutting", Fixed(plan.cutting_time_s(), 2), "s"},
                 {"path", Fixed(plan.length_mm(), 1), "mm"},
                 {"jet on", Fixed(plan.cutting_length_mm(), 1), "mm"},
                 {"segments", std::to_string(plan.segment_count()), ""},
                 {"gates and events", fmt::format("{} and {}", plan.gate_count(), plan.event_count()), ""},
                 {"compensated", plan.compensated() ? "yes" : "no", ""},
                 {"contour tolerance used", Fixed(plan.contour_tolerance_used_mm(), 4), "mm"},
                 {"predicted 95 % bound", Fixed(plan.predicted_95_mm(), 4), "mm"}}});
}

FeedReport FeedOf(const trajectory_v1::PlanSummary& plan) {
  FeedReport report;
  for (const trajectory_v1::BindingLimit& limit : plan.binding_limits()) {
    report.lengths.push_back({limit.limit(), limit.length_mm()});
  }
  for (const trajectory_v1::SlowStretch& s : plan.slow_stretches()) {
    SlowPlace place{s.line(),  s.from_s_mm(), s.to_s_mm(), s.programmed_mm_per_s(), s.lowest_mm_per_s(),
                    s.limit(), std::nullopt};
    if (s.has_reached_share()) {
      place.reached = {s.nearest(), s.reached_share(), s.at_s_mm(), s.share()};
    }
    report.slow.push_back(std::move(place));
  }
  report.slow_count = plan.slow_stretch_count();
  return report;
}

void PrintSummary(const trajectory_v1::PlanSummary& plan, Output& output) {
  plan.has_spatial() ? PrintSpatial(plan, output) : PrintLambda(plan, output);
  output.Text("");
  TellFeed(FeedOf(plan), output);
  TextTable held{
      {"contour", "lines", "tolerance_mm", "predicted_95_mm", "worst_mm", "at line", "left_mm", "most from"},
      {}};
  for (const trajectory_v1::HeldTolerance& h : plan.held_tolerances()) {
    held.rows.push_back({std::to_string(h.contour()), fmt::format("{}-{}", h.first_line(), h.last_line()),
                         Fixed(h.tolerance_mm(), 3), Fixed(h.predicted_95_mm(), 4), Fixed(h.worst_mm(), 4),
                         std::to_string(h.worst_line()), Fixed(h.margin_mm(), 4), h.worst_source()});
  }
  if (!held.rows.empty()) {
    output.Text(
        fmt::format("\nfeed from tolerance; the limits alone would allow {:.2f} s", plan.fastest_s()));
    output.Table(held);
  }
}

absl::Status Check(const ProgramOptions& options, const Connections& connections, Output& output) {
  trajectory_v1::AdmitProgramRequest request;
  absl::Status status = Fill(options.file, options.format, request);
  if (!status.ok()) {
    return status;
  }
  *request.mutable_options() = ToWire(options);
  trajectory_v1::AdmitProgramResponse response;
  status = connections.Ask<TrajectoryService>("trajectory", &TrajectoryService::Stub::AdmitProgram, request,
                                              response);
  if (!status.ok()) {
    return status;
  }
  PrintJson(response, output);
  PrintFaults(response.faults(), output);
  const bool hexapod = options.mechanism == "hexapod";
  output.Text(
      response.admitted() && hexapod
          ? fmt::format("admitted: {:.1f} mm of feed moves, {:.1f} mm idle (turns counted as their shift)",
                        response.cutting_length_mm(), response.idle_length_mm())
      : response.admitted()
          ? fmt::format("admitted: {:.1f} mm with the jet on, {:.1f} mm off, {} pierces, machine version {}",
                        response.cutting_length_mm(), response.idle_length_mm(), response.pierces(),
                        response.model_version().version())
          : "refused",
      response.admitted() ? Tone::kGood : Tone::kBad);
  output.Exit(response.admitted() ? ExitCode::kOk : ExitCode::kRefused);
  return absl::OkStatus();
}

absl::Status CheckInSteps(const ProgramOptions& options, const Connections& connections, Output& output) {
  trajectory_v1::AdmitProgramRequest request;
  const absl::Status filled = Fill(options.file, options.format, request);
  const auto channel = connections.Open("trajectory");
  if (!filled.ok() || !channel.ok()) {
    return filled.ok() ? channel.status() : filled;
  }
  *request.mutable_options() = ToWire(options);
  TrajectoryService::Stub stub(*channel);
  grpc::ClientContext context;
  SetDeadline(context, kPlanning_s);
  const auto stream = stub.AdmitProgramInSteps(&context, request);
  trajectory_v1::AdmissionStep step;
  bool refused = false;
  while (stream->Read(&step)) {
    if (step.state() == trajectory_v1::AdmissionStep::STATE_RUNNING) {
      output.Progress(step.progress(), step.step());
      continue;
    }
    output.EndProgress();
    PrintJson(step, output);
    refused = step.state() == trajectory_v1::AdmissionStep::STATE_REFUSED;
    output.Text(fmt::format("{:<9} {}", step.step(), refused ? "refused" : "passed"),
                refused ? Tone::kBad : Tone::kGood);
    PrintFaults(step.faults(), output);
    if (step.has_plan() && (step.step() == "ACCURACY" || step.plan().has_spatial())) {
      PrintSummary(step.plan(), output);
    }
  }
  output.Exit(refused ? ExitCode::kRefused : ExitCode::kOk);
  return connections.Named("trajectory", FromWire(stream->Finish()));
}

// Prints what the service sends, piece by piece.
absl::Status Export(const trajectory_v1::ExportRequest& request, const std::string& out,
                    const Connections& connections) {
  const auto channel = connections.Open("trajectory");
  if (!channel.ok()) {
    return channel.status();
  }
  TrajectoryService::Stub stub(*channel);
  grpc::ClientContext context;
  SetDeadline(context, kPlanning_s);
  const auto stream = stub.Export(&context, request);
  trajectory_v1::ExportPiece piece;
  std::string text;
  while (stream->Read(&piece)) {
    text += piece.content();
  }
  const absl::Status status = connections.Named("trajectory", FromWire(stream->Finish()));
  return status.ok() ? WriteTextFile(out, text) : status;
}

absl::Status List(const Connections& connections, Output& output) {
  TextTable table{{"plan", "machine version", "duration s", "jet on mm", "compensated", "predicted 95 % mm"},
                  {}};
  trajectory_v1::ListPlansRequest request;
  trajectory_v1::ListPlansResponse response;
  do {
    request.set_page_token(response.next_page_token());
    const absl::Status status = connections.Ask<TrajectoryService>(
        "trajectory", &TrajectoryService::Stub::ListPlans, request, response);
    if (!status.ok()) {
      return status;
    }
    PrintJson(response, output);
    for (const trajectory_v1::PlanSummary& plan : response.plans()) {
      table.rows.push_back({std::to_string(plan.plan_id()), std::to_string(plan.model_version().version()),
                            Fixed(plan.duration_s(), 2), Fixed(plan.cutting_length_mm(), 1),
                            plan.compensated() ? "yes" : "no",
                            plan.has_spatial() ? "" : Fixed(plan.predicted_95_mm(), 4)});
    }
  } while (!response.next_page_token().empty());
  output.Table(table);
  return absl::OkStatus();
}

absl::Status Show(const trajectory_v1::GetPlanResponse& plan, Output& output) {
  if (output.json()) {
    PrintJson(plan, output);
  } else if (plan.has_summary()) {
    PrintSummary(plan.summary(), output);
  } else {
    PrintFaults(plan.faults(), output);
    output.Text(fmt::format("{:.0f} % {} {} {}", plan.operation().progress() * 100, plan.operation().phase(),
                            plan.operation().reason(), plan.operation().message()));
  }
  const bool failed = plan.operation().state() == type::v1::OPERATION_STATE_FAILED;
  output.Exit(failed ? ExitCode::kRefused : ExitCode::kOk);
  return absl::OkStatus();
}

// Follows a plan to its end with a bar, and shows what became of it.
absl::Status Watch(std::uint64_t plan_id, const Connections& connections, Output& output) {
  const auto channel = connections.Open("trajectory");
  if (!channel.ok()) {
    return channel.status();
  }
  TrajectoryService::Stub stub(*channel);
  grpc::ClientContext context;
  SetDeadline(context, kPlanning_s);
  trajectory_v1::WatchPlanRequest request;
  request.set_plan_id(plan_id);
  const auto stream = stub.WatchPlan(&context, request);
  trajectory_v1::GetPlanResponse plan;
  while (stream->Read(&plan)) {
    if (plan.operation().state() == type::v1::OPERATION_STATE_RUNNING) {
      output.Progress(plan.operation().progress(), plan.operation().phase());
    }
  }
  output.EndProgress();
  const absl::Status status = connections.Named("trajectory", FromWire(stream->Finish()));
  return status.ok() ? Show(plan, output) : status;
}

absl::Status Plan(const ProgramOptions& options, const Connections& connections, Output& output) {
  trajectory_v1::PlanProgramRequest request;
  absl::Status status = Fill(options.file, options.format, request);
  *request.mutable_options() = ToWire(options);
  trajectory_v1::PlanProgramResponse asked;
  if (status.ok()) {
    status = connections.Ask<TrajectoryService>("trajectory", &TrajectoryService::Stub::PlanProgram, request,
                                                asked);
  }
  return status.ok() ? Watch(asked.plan_id(), connections, output) : status;
}

absl::Status Samples(std::uint64_t plan_id, std::optional<double> step_s, const std::string& out,
                     const Connections& connections) {
  PlanPoints points;
  absl::Status status = ReadPlanPoints(connections, plan_id, step_s, points);
  if (!status.ok()) {
    return status;
  }
  const bool spatial = !points.spatial_values.empty();
  const std::vector<std::string> planar = {"tau_s",
                                           "s_mm",
                                           "x_W_mm",
                                           "y_W_mm",
                                           "vx_W_mm_per_s",
                                           "vy_W_mm_per_s",
                                           "ax_W_mm_per_s2",
                                           "ay_W_mm_per_s2",
                                           "actuator_1_mm",
                                           "actuator_2_mm",
                                           "actuator_1_mm_per_s",
                                           "actuator_2_mm_per_s",
                                           "cutting",
                                           "source_line"};
  CsvTable table(spatial ? kSpatialColumns : planar);
  const std::vector<double>& values = spatial ? points.spatial_values : points.values;
  const std::size_t stride = spatial ? kSpatialPointStride : kPlanPointStride;
  for (std::size_t i = 0; i < points.cutting.size(); ++i) {
    const auto first = values.begin() + static_cast<std::ptrdiff_t>(i * stride);
    std::vector<double> row(first, first + static_cast<std::ptrdiff_t>(stride));
    row.push_back(points.cutting[i]);
    row.push_back(points.source_line[i]);
    table.AddRow(row);
  }
  return WriteCsv(out, table);
}

void AddAdmitVerb(CLI::App& noun, Output& output, const Connections& connections) {
  auto stepped = std::make_shared<ProgramOptions>();
  CLI::App* admit = AddServiceVerb(
      noun, "admit", "check step by step, plan and predict: words, place, reach, limits, time, accuracy");
  AddProgramOptions(*admit, *stepped);
  admit->callback([stepped, &output, &connections] {
    if (const absl::Status status = CheckInSteps(*stepped, connections, output); !status.ok())
      output.Fail(status);
  });
}

struct ExportOptions {
  std::string file;
  FormatOptions format;
  std::string mechanism = "lambda";
  std::uint64_t plan_id = 0;
  std::optional<double> step_s;
  std::string as;
  std::string out = "-";
};

absl::Status RunExport(const ExportOptions& options, const Connections& connections) {
  trajectory_v1::ExportRequest request;
  request.set_plan_id(options.plan_id);
  if (options.step_s) request.set_step_s(*options.step_s);
  request.set_format(options.as == "gcode"       ? trajectory_v1::ExportRequest::FORMAT_GCODE
                     : options.as == "cldata"    ? trajectory_v1::ExportRequest::FORMAT_CLDATA
                     : options.as == "canonical" ? trajectory_v1::ExportRequest::FORMAT_CANONICAL
                     : options.as == "samples"   ? trajectory_v1::ExportRequest::FORMAT_SAMPLES_CSV
                     : options.plan_id != 0      ? trajectory_v1::ExportRequest::FORMAT_SAMPLES_CSV
                                                 : trajectory_v1::ExportRequest::FORMAT_CANONICAL);
  if (options.plan_id == 0) {
    trajectory_v1::ListOperationsRequest program;
    if (const absl::Status status = Fill(options.file, options.format, program); !status.ok()) {
      return status;
    }
    request.set_program(program.program());
    request.set_program_format(program.format());
    request.set_mechanism(MechanismOf(options.mechanism));
    if (program.has_toolpath()) {
      *request.mutable_toolpath() = program.toolpath();
    }
  }
  return Export(request, options.out, connections);
}

void AddExportVerb(CLI::App& noun, Output& output, const Connections& connections) {
  auto options = std::make_shared<ExportOptions>();
  CLI::App* exported = AddServiceVerb(
      noun, "export", "a program or a plan as G-code, CLDATA or canonical list, or a plan's points as CSV");
  auto* file = exported->add_option("--program", options->file, "G-code, CLDATA or DXF");
  exported->add_option("--plan", options->plan_id, "a plan in the place of a program")->excludes(file);
  exported->add_option("--as", options->as, "default: canonical of a program, samples of a plan")
      ->check(CLI::IsMember({"gcode", "cldata", "canonical", "samples"}));
  exported->add_option("--step-s", options->step_s, "distance of points in program time; default 0.004");
  exported->add_option("--out", options->out, "file; - is standard output");
  AddFormatOptions(*exported, options->format);
  AddMechanismOption(*exported, options->mechanism);
  exported->callback([options, &output, &connections] { output.Finish(RunExport(*options, connections)); });
}

void AddWatchVerb(CLI::App& noun, Output& output, const Connections& connections) {
  auto plan_id = std::make_shared<std::uint64_t>(0);
  CLI::App* watch = AddServiceVerb(noun, "watch", "follow a plan to its end; then as show");
  watch->add_option("PLAN", *plan_id, "the plan's id")->required();
  watch->callback([plan_id, &output, &connections] {
    if (const absl::Status status = Watch(*plan_id, connections, output); !status.ok()) output.Fail(status);
  });
}

void AddListVerb(CLI::App& noun, Output& output, const Connections& connections) {
  CLI::App* list = AddServiceVerb(noun, "list", "the plans that trajectory has");
  list->callback([&output, &connections] {
    if (const absl::Status status = List(connections, output); !status.ok()) output.Fail(status);
  });
}

// An option that sets a field of the settings.
template <typename Value, typename Set>
CLI::Option* AddSetting(CLI::App& verb, FormatOptions& options, const char* name, const char* what, Set set) {
  return verb
      .add_option_function<Value>(
          name,
          [&options, set](const Value& value) {
            options.toolpath_given = true;
            set(options.toolpath, value);
          },
          what)
      ->group("Drawings");
}

void AddLayerOptions(CLI::App& verb, FormatOptions& options) {
  using Settings = type::v1::ToolpathSettings;
  using Names = std::vector<std::string>;
  AddSetting<Names>(
      verb, options, "--ignore", "layer to leave out, may be given again",
      [](Settings& s, const Names& v) { s.mutable_ignore_layers()->Assign(v.begin(), v.end()); });
  AddSetting<Names>(verb, options, "--cut", "layer to cut, may be given again; none: all others",
                    [](Settings& s, const Names& v) { s.mutable_cut_layers()->Assign(v.begin(), v.end()); });
  AddSetting<Names>(verb, options, "--mark", "layer to scribe along its lines, may be given again",
                    [](Settings& s, const Names& v) { s.mutable_mark_layers()->Assign(v.begin(), v.end()); });
}

}  // namespace

void AddFormatOptions(CLI::App& verb, FormatOptions& options) {
  using Settings = type::v1::ToolpathSettings;
  constexpr double kDegree_rad = std::numbers::pi / 180.0;
  verb.add_option("--format", options.format, "file: as the name of the file ends, or as it begins")
      ->check(CLI::IsMember({"file", "gcode", "flat-gcode", "cldata", "dxf"}))
      ->capture_default_str();
  const auto number = [&](const char* name, const char* what, auto set) {
    AddSetting<double>(verb, options, name, what, set);
  };
  number("--kerf-mm", "width of the cut; default: the machine's",
         [](Settings& s, double v) { s.set_kerf_mm(v); });
  number("--cut-feed-mm-per-s", "of the cut; default 60",
         [](Settings& s, double v) { s.set_feed_mm_per_s(v); });
  number("--lead-mm", "length of a line, radius of an arc; default 4",
         [](Settings& s, double v) { s.set_lead_mm(v); });
  number("--lead-angle-deg", "of a line to the path; default 45",
         [](Settings& s, double v) { s.set_lead_angle_rad(v * kDegree_rad); });
  number("--lead-overlap-mm", "cut again where the path closes; default 1",
         [](Settings& s, double v) { s.set_overlap_mm(v); });
  number("--pierce-time-s", "0: the machine's own", [](Settings& s, double v) { s.set_pierce_time_s(v); });
  number("--tab-mm", "what a tab leaves standing", [](Settings& s, double v) { s.set_tab_mm(v); });
  AddSetting<std::uint32_t>(verb, options, "--tabs", "on each outline",
                            [](Settings& s, std::uint32_t v) { s.set_tab_count(v); });
  number("--turn-deg", "turns the drawing counter-clockwise",
         [](Settings& s, double v) { s.set_turn_rad(v * kDegree_rad); });
  AddSetting<std::string>(verb, options, "--lead", "none, line or arc; default arc",
                          [](Settings& s, const std::string& v) {
                            s.set_lead(v == "none"   ? Settings::LEAD_NONE
                                       : v == "line" ? Settings::LEAD_LINE
                                                     : Settings::LEAD_ARC);
                          })
      ->check(CLI::IsMember({"none", "line", "arc"}));
  AddSetting<std::string>(verb, options, "--pierce", "stationary, moving or pre-pierced",
                          [](Settings& s, const std::string& v) {
                            s.set_pierce(v == "moving"        ? Settings::PIERCE_MOVING
                                         : v == "pre-pierced" ? Settings::PIERCE_PRE_PIERCED
                                                              : Settings::PIERCE_STATIONARY);
                          })
      ->check(CLI::IsMember({"stationary", "moving", "pre-pierced"}));
  AddSetting<std::vector<double>>(verb, options, "--at-mm", "X Y in W of the drawing's lower left corner",
                                  [](Settings& s, const std::vector<double>& v) {
                                    s.set_corner_x_w_mm(v[0]);
                                    s.set_corner_y_w_mm(v[1]);
                                  })
      ->expected(2);
  AddLayerOptions(verb, options);
  verb.add_flag_function(
          "--drawing-order",
          [&options](std::int64_t) {
            options.toolpath_given = true;
            options.toolpath.set_keep_drawing_order(true);
          },
          "keep the drawing's order as far as inner before outer allows")
      ->group("Drawings");
}

type::v1::ProgramFormat FormatOf(const FormatOptions& options, const std::string& file) {
  static const std::map<std::string_view, type::v1::ProgramFormat> kFormats = {
      {"flat-gcode", type::v1::PROGRAM_FORMAT_FLAT_GCODE},
      {"gcode", type::v1::PROGRAM_FORMAT_GCODE},
      {"cldata", type::v1::PROGRAM_FORMAT_CLDATA},
      {"dxf", type::v1::PROGRAM_FORMAT_DXF},
      {"ngc", type::v1::PROGRAM_FORMAT_GCODE},
      {"nc", type::v1::PROGRAM_FORMAT_GCODE},
      {"apt", type::v1::PROGRAM_FORMAT_CLDATA},
      {"cls", type::v1::PROGRAM_FORMAT_CLDATA}};
  std::string word = options.format;
  if (word == "file") {
    const std::size_t dot = file.find_last_of('.');
    word = dot == std::string::npos ? "" : file.substr(dot + 1);
    std::transform(word.begin(), word.end(), word.begin(), [](unsigned char c) { return std::tolower(c); });
  }
  const auto found = kFormats.find(word);
  return found == kFormats.end() ? type::v1::PROGRAM_FORMAT_UNSPECIFIED : found->second;
}

absl::Status ReadPlanPoints(const Connections& connections, std::uint64_t plan_id,
                            std::optional<double> step_s, PlanPoints& points) {
  const auto channel = connections.Open("trajectory");
  if (!channel.ok()) {
    return channel.status();
  }
  TrajectoryService::Stub stub(*channel);
  grpc::ClientContext context;
  SetDeadline(context, connections.timeout_s());
  trajectory_v1::StreamSamplesRequest request;
  request.set_plan_id(plan_id);
  if (step_s) {
    request.set_step_s(*step_s);
  }
  const auto stream = stub.StreamSamples(&context, request);
  trajectory_v1::SampleBatch batch;
  while (stream->Read(&batch)) {
    points.values.insert(points.values.end(), batch.values().begin(), batch.values().end());
    points.spatial_values.insert(points.spatial_values.end(), batch.spatial_values().begin(),
                                 batch.spatial_values().end());
    points.cutting.insert(points.cutting.end(), batch.cutting().begin(), batch.cutting().end());
    points.source_line.insert(points.source_line.end(), batch.source_line().begin(),
                              batch.source_line().end());
  }
  absl::Status status = connections.Named("trajectory", FromWire(stream->Finish()));
  if (status.ok() && ((points.values.size() != points.cutting.size() * kPlanPointStride &&
                       points.spatial_values.size() != points.cutting.size() * kSpatialPointStride) ||
                      points.source_line.size() != points.cutting.size())) {
    return Trouble(absl::StatusCode::kInternal, "BAD_SAMPLES",
                   "trajectory's samples do not have the stride that they should");
  }
  return status;
}

void AddTrajectoryServiceVerbs(CLI::App& noun, Output& output, const Connections& connections) {
  auto checked = std::make_shared<ProgramOptions>();
  CLI::App* check =
      AddServiceVerb(noun, "check", "ask trajectory whether a program can be cut; exit code 4 if not");
  AddProgramOptions(*check, *checked);
  check->callback([checked, &output, &connections] {
    if (const absl::Status status = Check(*checked, connections, output); !status.ok()) output.Fail(status);
  });

  AddAdmitVerb(noun, output, connections);
  AddExportVerb(noun, output, connections);
  AddListVerb(noun, output, connections);
  AddWatchVerb(noun, output, connections);

  auto planned = std::make_shared<ProgramOptions>();
  CLI::App* plan = AddServiceVerb(noun, "plan", "have trajectory plan a program; time, feed, what limits it");
  AddProgramOptions(*plan, *planned);
  plan->callback([planned, &output, &connections] {
    if (const absl::Status status = Plan(*planned, connections, output); !status.ok()) output.Fail(status);
  });

  auto shown = std::make_shared<trajectory_v1::GetPlanRequest>();
  auto shown_id = std::make_shared<std::uint64_t>(0);
  CLI::App* show = AddServiceVerb(noun, "show", "a plan that trajectory has");
  show->add_option("PLAN", *shown_id, "the plan's id")->required();
  show->callback([shown, shown_id, &output, &connections] {
    shown->set_plan_id(*shown_id);
    trajectory_v1::GetPlanResponse response;
    absl::Status status =
        connections.Ask<TrajectoryService>("trajectory", &TrajectoryService::Stub::GetPlan, *shown, response);
    status.Update(status.ok() ? Show(response, output) : absl::OkStatus());
    if (!status.ok()) output.Fail(status);
  });

  auto sampled = std::make_shared<std::uint64_t>(0);
  auto step = std::make_shared<std::optional<double>>();
  auto out = std::make_shared<std::string>("-");
  CLI::App* samples = AddServiceVerb(noun, "samples", "a plan's points over time as CSV");
  samples->add_option("PLAN", *sampled, "the plan's id")->required();
  samples->add_option("--step-s", *step, "distance in program time; default 0.004");
  samples->add_option("--out", *out, "CSV; - is standard output");
  samples->callback([sampled, step, out, &output, &connections] {
    output.Finish(Samples(*sampled, *step, *out, connections));
  });
}

}  // namespace lambdajet::cli
