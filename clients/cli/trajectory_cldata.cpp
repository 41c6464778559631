// CLDATA: any program written as CLDATA, a program verified, the grinding program of a pilger die made.
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>

#include "clients/cli/picture_option.hpp"
#include "clients/cli/pilger_die_file.hpp"
#include "clients/cli/program_faults.hpp"
#include "clients/cli/program_file.hpp"
#include "clients/cli/text_file.hpp"
#include "clients/cli/trajectory_cldata_pictures.hpp"
#include "clients/cli/verbs.hpp"
#include "trajectory/core/part_program/cldata_verification.hpp"
#include "trajectory/core/part_program/cldata_writer.hpp"
#include "trajectory/core/part_program/read_program.hpp"

namespace lambdajet::cli {
namespace {

using trajectory::ProgramVerification;
using trajectory::VerifyArgument;

constexpr double kDegPerRad = 180.0 / std::numbers::pi;
constexpr std::size_t kMostBreaksTold = 20;
constexpr char kProgramFile[] = "G-code or CLDATA file; - is standard input";

struct CldataVerb {
  std::string file;
  std::string out;
  std::string picture;
  std::string argument = "auto";
  std::string axes = "xy";
};

// A program that tilts its tool is read for six axes; whether a machine can cut it is asked by `check`.
trajectory::PartProgram ReadAnyProgram(const std::string& text, const std::string& axes) {
  trajectory::ReadOptions options;
  options.cldata.axes = options.gcode.axes = AxesOf(axes);
  options.cldata.tool_angles = ToolAnglesOf(axes);
  trajectory::PartProgram program = ReadPartProgram(text, options);
  const auto needs_axes = [](const trajectory::ProgramFault& f) { return f.reason == "AXIS_NOT_DRIVEN"; };
  if (std::any_of(program.faults.begin(), program.faults.end(), needs_axes)) {
    options.cldata.axes = trajectory::kSixAxes;
    program = ReadPartProgram(text, options);
  }
  return program;
}

absl::Status WriteAsCldata(const CldataVerb& verb, Output& output) {
  const auto text = ReadProgramFile(verb.file);
  if (!text.ok()) {
    return text.status();
  }
  const trajectory::PartProgram program = ReadAnyProgram(*text, verb.axes);
  if (!program.faults.empty()) {
    TellFaults(verb.file, program.faults, output);
    return absl::OkStatus();
  }
  const std::size_t name = verb.file.find_last_of('/') + 1;
  const trajectory::CldataText cldata =
      WriteCldata(program.operations, verb.file.substr(name), {}, ToolAnglesOf(verb.axes));
  if (!cldata.faults.empty()) {
    TellFaults(verb.file, cldata.faults, output);
    return absl::OkStatus();
  }
  return WriteTextFile(verb.out, cldata.text);
}

std::string BreakName(int order) {
  static constexpr std::array<const char*, 3> kNames = {"value", "first derivative", "second derivative"};
  return kNames[static_cast<std::size_t>(order)];
}

nlohmann::json VerificationJson(const ProgramVerification& v) {
  nlohmann::json series = nlohmann::json::array(), breaks = nlohmann::json::array();
  for (const auto& s : v.series) {
    series.push_back({{"coordinate", s.name}, {"peak_first", s.peak_first}, {"peak_second", s.peak_second}});
  }
  for (const auto& b : v.breaks) {
    breaks.push_back({{"line", b.line},
                      {"coordinate", v.series[b.coordinate].name},
                      {"order", b.order},
                      {"argument", b.argument},
                      {"size", b.size}});
  }
  return {{"argument", v.over == VerifyArgument::kTurn ? "turn_rad" : "path_mm"},
          {"points", v.arguments.size()},
          {"series", series},
          {"breaks", breaks}};
}

void TellVerification(const ProgramVerification& v, Output& output) {
  const bool turn = v.over == VerifyArgument::kTurn;
  output.Text(std::to_string(v.arguments.size()) + " points over " + (turn ? "C, rad" : "path length, mm") +
              ", " + std::to_string(v.begins.size()) + " pieces");
  TextTable peaks{{"coordinate", "peak of first derivative", "peak of second derivative", "breaks: value",
                   "first", "second"},
                  {}};
  for (std::size_t k = 0; k < v.series.size(); ++k) {
    std::array<int, 3> count{};
    for (const auto& b : v.breaks) {
      count[static_cast<std::size_t>(b.order)] += b.coordinate == k ? 1 : 0;
    }
    peaks.rows.push_back({v.series[k].name, Fixed(v.series[k].peak_first, 6),
                          Fixed(v.series[k].peak_second, 6), std::to_string(count[0]),
                          std::to_string(count[1]), std::to_string(count[2])});
  }
  output.Table(peaks);
  if (v.breaks.empty()) {
    output.Text("no breaks", Tone::kGood);
    return;
  }
  TextTable table{{"line", "coordinate", "break of", turn ? "C, deg" : "path, mm", "size"}, {}};
  for (std::size_t i = 0; i < std::min(v.breaks.size(), kMostBreaksTold); ++i) {
    const auto& b = v.breaks[i];
    table.rows.push_back({std::to_string(b.line), v.series[b.coordinate].name, BreakName(b.order),
                          Fixed(b.argument * (turn ? kDegPerRad : 1.0), 3), Shortest(b.size)});
  }
  output.Text("the first " + std::to_string(table.rows.size()) + " of " + std::to_string(v.breaks.size()) +
              " breaks:");
  output.Table(table);
}

absl::Status Verify(const CldataVerb& verb, Output& output) {
  const auto text = ReadProgramFile(verb.file);
  if (!text.ok()) {
    return text.status();
  }
  const trajectory::PartProgram program = ReadAnyProgram(*text, verb.axes);
  if (!program.faults.empty()) {
    TellFaults(verb.file, program.faults, output);
    return absl::OkStatus();
  }
  const VerifyArgument argument = verb.argument == "turn"   ? VerifyArgument::kTurn
                                  : verb.argument == "path" ? VerifyArgument::kPathLength
                                                            : VerifyArgument::kByContent;
  const ProgramVerification verification = VerifyProgram(program.operations, argument);
  TellVerification(verification, output);
  output.Json(VerificationJson(verification));
  return verb.picture.empty() ? absl::OkStatus() : DrawVerification(verification, verb.picture);
}

// How often each law was chosen for each coordinate, its highest peak, and how far that is from the bound.
void TellIdle(const trajectory::PilgerProgram& program, Output& output) {
  static constexpr std::array<const char*, 3> kAxes = {"X, mm", "Z, mm", "A, rad"};
  TextTable table{{"idle", "law", "zones", "highest peak", "of the bound", "jump at joins", "because"}, {}};
  for (std::size_t k = 0; k < 3; ++k) {
    std::map<std::string, std::array<double, 4>> laws;
    std::map<std::string, std::string> reasons;
    for (std::size_t i = 0; i + 1 < program.passes.size(); ++i) {
      const auto& motion = program.passes[i].idle[k];
      const std::string name(IdleKindName(motion.choice.law.kind));
      auto& row = laws[name];
      row[0] += 1.0;
      if (motion.choice.law.peak_acceleration >= row[1]) {
        row[1] = motion.choice.law.peak_acceleration;
        row[2] = motion.choice.peak_to_bound_ratio();
      }
      row[3] = std::max(row[3], motion.acceleration_jump);
      reasons[name] = motion.choice.reason;
    }
    for (const auto& [name, row] : laws) {
      table.rows.push_back({kAxes[k], name, Fixed(row[0], 0), Fixed(row[1], 4), Fixed(row[2], 3),
                            Fixed(row[3], 6), reasons[name]});
    }
  }
  output.Table(table);
}

// The other half of the turn must be free of material as far down as the wheel comes there.
void TellLowest(const trajectory::PilgerProgram& program, Output& output) {
  double cutting_mm = 1e9, idle_mm = 1e9;
  for (const auto& point : program.points) {
    double& lowest_mm = point.cutting ? cutting_mm : idle_mm;
    lowest_mm = std::min(lowest_mm, point.z_mm);
  }
  if (idle_mm < cutting_mm) {
    output.Text("idle zones bring the wheel's centre down to Z " + Fixed(idle_mm, 2) + " mm, " +
                    Fixed(cutting_mm - idle_mm, 2) +
                    " mm nearer to the axis than any cut: nothing may stand there",
                Tone::kWarning);
  }
}

nlohmann::json PilgerJson(const trajectory::PilgerProgram& p, const ProgramVerification& v) {
  nlohmann::json idle = nlohmann::json::array();
  for (std::size_t i = 0; i + 1 < p.passes.size(); ++i) {
    nlohmann::json laws = nlohmann::json::array();
    for (const auto& motion : p.passes[i].idle) {
      laws.push_back({{"law", std::string(IdleKindName(motion.choice.law.kind))},
                      {"peak", motion.choice.law.peak_acceleration},
                      {"bound", motion.choice.bound},
                      {"jump", motion.acceleration_jump},
                      {"reason", std::string(motion.choice.reason)}});
    }
    idle.push_back(laws);
  }
  return {{"passes", p.passes.size()},
          {"points", p.points.size()},
          {"largest_scallop_mm", p.largest_scallop_mm},
          {"largest_profile_radius_mm", p.largest_profile_radius_mm},
          {"idle", idle},
          {"verification", VerificationJson(v)}};
}

absl::Status Pilger(const CldataVerb& verb, Output& output) {
  const auto file = ReadPilgerDie(verb.file);
  if (!file.ok()) {
    return file.status();
  }
  const trajectory::PilgerProgram program = [&] {
    LongWork planning(output, "planning passes");
    return PlanPilgerDie(file->die, [&planning](double ratio) { planning.At(ratio); });
  }();
  if (program.refusal != trajectory::PilgerRefusal::kNone) {
    TellFaults(verb.file, {{0, 0, PilgerRefusalName(program.refusal), file->name, program.message}}, output);
    return absl::OkStatus();
  }
  const auto operations = OperationsOf(program, file->die);
  const trajectory::CldataText cldata = WriteCldata(
      operations, file->name,
      {"WHEEL CENTRE AND AXIS IN THE FRAME OF THE DIE, X ALONG ITS AXIS",
       std::to_string(program.passes.size()) + " PASSES, WHEEL " + Shortest(file->die.wheel.radius_mm) +
           " MM, PROFILE " + Shortest(file->die.wheel.profile_radius_mm) + " MM"});
  // What is verified is what was written.
  const trajectory::PartProgram written = ReadAnyProgram(cldata.text, "rotary-head");
  if (!cldata.faults.empty() || !written.faults.empty()) {
    TellFaults(verb.file, cldata.faults.empty() ? written.faults : cldata.faults, output);
    return absl::OkStatus();
  }
  const ProgramVerification verification = VerifyProgram(written.operations, VerifyArgument::kTurn);
  output.Text(std::to_string(program.passes.size()) + " passes, " + std::to_string(program.points.size()) +
              " points, " + Fixed(static_cast<double>(program.passes.size()) * file->die.turn_s / 60.0, 1) +
              " min; highest crest " + Fixed(program.largest_scallop_mm, 5) + " mm of " +
              Fixed(file->die.scallop_mm, 5) + " allowed; profile radius up to " +
              Fixed(program.largest_profile_radius_mm, 2) + " mm would fit");
  TellLowest(program, output);
  TellIdle(program, output);
  TellVerification(verification, output);
  output.Json(PilgerJson(program, verification));
  absl::Status status = verb.out.empty() ? absl::OkStatus() : WriteTextFile(verb.out, cldata.text);
  if (status.ok() && !verb.picture.empty()) {
    status = DrawPilger(program, file->die, verb.picture);
  }
  return status;
}

CLI::App* AddVerb(CLI::App& noun, Output& output, const char* name, const char* what, const char* file,
                  const std::shared_ptr<CldataVerb>& verb, absl::Status (*work)(const CldataVerb&, Output&)) {
  CLI::App* app = noun.add_subcommand(name, what);
  app->add_option("FILE", verb->file, file)->required();
  app->callback([verb, work, &output] {
    if (const absl::Status status = work(*verb, output);
        !status.ok()) {  // faults have set their own exit code
      output.Fail(status);
    }
  });
  return app;
}

}  // namespace

void AddCldataVerbs(CLI::App& noun, Output& output) {
  const auto convert = std::make_shared<CldataVerb>();
  convert->out = "-";
  CLI::App* cldata = AddVerb(noun, output, "cldata", "a program in any notation, written as CLDATA",
                             kProgramFile, convert, WriteAsCldata);
  cldata->add_option("--out", convert->out, "CLDATA file; - is standard output");
  AddAxesOption(*cldata, convert->axes);
  const auto verified = std::make_shared<CldataVerb>();
  CLI::App* verify = AddVerb(noun, output, "verify",
                             "position and both derivatives of every coordinate, and where they break",
                             kProgramFile, verified, Verify);
  AddPictureOption(*verify, "--picture", verified->picture, "of every coordinate with both derivatives");
  verify->add_option("--argument", verified->argument, "what the coordinates are drawn over")
      ->check(CLI::IsMember({"auto", "path", "turn"}))
      ->capture_default_str();
  AddAxesOption(*verify, verified->axes);
  const auto made = std::make_shared<CldataVerb>();
  CLI::App* pilger =
      AddVerb(noun, output, "pilger", "the four-axis grinding program of a pilger die",
              "YAML of the die, as deploy/parts/pilger_die/die.yaml; - is standard input", made, Pilger);
  pilger->add_option("--out", made->out, "CLDATA file");
  AddPictureOption(*pilger, "--picture", made->picture, "of groove, passes and axes");
}

}  // namespace lambdajet::cli
