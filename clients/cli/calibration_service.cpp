// Measuring, identification and versions over CalibrationService: plan, verify, runs, identify, activate, versions, show, diff.
#include <fmt/format.h>

#include <chrono>
#include <thread>

#include "clients/cli/csv.hpp"
#include "clients/cli/service_verbs.hpp"
#include "clients/cli/text_file.hpp"
#include "foundation/contract/trouble.hpp"
#include "lambdajet/calibration/v1/calibration.grpc.pb.h"

namespace lambdajet::cli {
namespace {

namespace calibration_v1 = calibration::v1;
using calibration_v1::CalibrationService;

constexpr auto kPoll = std::chrono::milliseconds(100);
constexpr char kCalibrationService[] = "calibration";

std::string Author() {
  const char* user = std::getenv("USER");
  return user == nullptr || user[0] == '\0' ? "lambdajet" : user;
}

void PrintChanges(const google::protobuf::RepeatedPtrField<calibration_v1::ParameterChange>& changes,
                  Output& output) {
  TextTable table{{"parameter", "unit", "before", "sigma", "after", "sigma", "change"}, {}};
  for (const calibration_v1::ParameterChange& change : changes) {
    table.rows.push_back({change.name(), change.unit(), Fixed(change.before(), 6),
                          Fixed(change.before_sigma(), 6), Fixed(change.after(), 6),
                          Fixed(change.after_sigma(), 6), Fixed(change.after() - change.before(), 6)});
  }
  output.Table(table);
}

// With --json the answer holds the program, so that it is written to a file only.
absl::Status WriteProgram(const std::string& out, const std::string& program, const Output& output) {
  return output.json() && out == "-" ? absl::OkStatus() : WriteTextFile(out, program);
}

absl::Status PlanRun(const calibration_v1::PlanMeasuringRunRequest& request, const std::string& out,
                     const Connections& connections, Output& output) {
  calibration_v1::PlanMeasuringRunResponse response;
  absl::Status status = connections.Ask<CalibrationService>(
      kCalibrationService, &CalibrationService::Stub::PlanMeasuringRun, request, response);
  if (!status.ok()) {
    return status;
  }
  PrintJson(response, output);
  output.Message(response.expectation());
  return WriteProgram(out, response.program(), output);
}

absl::Status Verify(std::uint64_t plan_id, const std::string& program, std::optional<std::uint32_t> looks,
                    const Connections& connections, Output& output) {
  if (!program.empty()) {
    calibration_v1::PlanVerificationRequest request;
    if (looks) {
      request.set_looks(*looks);
    }
    calibration_v1::PlanVerificationResponse response;
    const absl::Status status = connections.Ask<CalibrationService>(
        kCalibrationService, &CalibrationService::Stub::PlanVerification, request, response);
    if (!status.ok()) {
      return status;
    }
    PrintJson(response, output);
    return WriteProgram(program, response.program(), output);
  }
  calibration_v1::VerifyBaseRequest request;
  request.set_plan_id(plan_id);
  calibration_v1::VerifyBaseResponse response;
  const absl::Status status = connections.Ask<CalibrationService>(
      kCalibrationService, &CalibrationService::Stub::VerifyBase, request, response);
  if (!status.ok()) {
    return status;
  }
  PrintJson(response, output);
  const bool pass = response.verdict() == "PASS";
  output.Text(fmt::format("{}: {}", response.verdict(), response.message()),
              pass ? Tone::kGood : Tone::kWarning);
  output.Text(
      fmt::format("chi-square {:.2f} with {} degrees of freedom, p {:.4f}; shift {:.3f}, {:.3f} mm, turn "
                  "{:.6f} rad, rms {:.4f} mm",
                  response.chi_square(), response.degrees_of_freedom(), response.p_value(),
                  response.shift_x_mm(), response.shift_y_mm(), response.turn_rad(), response.rms_mm()));
  output.Exit(pass ? ExitCode::kOk : ExitCode::kPrecondition);
  return absl::OkStatus();
}

absl::Status Runs(std::uint64_t plan_id, const Connections& connections, Output& output) {
  if (plan_id != 0) {
    calibration_v1::GetRunRequest request;
    request.set_plan_id(plan_id);
    calibration_v1::GetRunResponse response;
    const absl::Status status = connections.Ask<CalibrationService>(
        kCalibrationService, &CalibrationService::Stub::GetRun, request, response);
    if (!status.ok()) {
      return status;
    }
    if (output.json()) {
      PrintJson(response, output);
      return status;
    }
    CsvTable table(
        {"mark", "exposure_ns", "seen", "x_C_mm", "y_C_mm", "gate", "actuator_1_mm", "actuator_2_mm"});
    for (const calibration_v1::Look& look : response.looks()) {
      const auto actuator = [&](int i) {
        return i < look.actuator_position_mm_size() ? Shortest(look.actuator_position_mm(i)) : "";
      };
      table.AddRow(std::vector<std::string>{std::to_string(look.mark()), std::to_string(look.exposure_ns()),
                                            look.seen() ? "1" : "0", Shortest(look.x_c_mm()),
                                            Shortest(look.y_c_mm()), std::to_string(look.gate()), actuator(0),
                                            actuator(1)});
    }
    return WriteCsv("-", table);
  }
  calibration_v1::ListRunsRequest request;
  request.set_page_size(100);
  calibration_v1::ListRunsResponse response;
  const absl::Status status = connections.Ask<CalibrationService>(
      kCalibrationService, &CalibrationService::Stub::ListRuns, request, response);
  if (!status.ok()) {
    return status;
  }
  PrintJson(response, output);
  TextTable table{{"plan", "looks", "unseen"}, {}};
  for (const calibration_v1::Run& run : response.runs()) {
    table.rows.push_back(
        {std::to_string(run.plan_id()), std::to_string(run.looks()), std::to_string(run.unseen())});
  }
  output.Table(table);
  return status;
}

void PrintResult(const calibration_v1::IdentificationResult& result, Output& output) {
  if (output.json()) {
    return PrintJson(result, output);
  }
  PrintChanges(result.parameters(), output);
  output.Text(
      fmt::format("version {}: rms {:.4f} mm before, {:.4f} after, {:.4f} on looks kept out; chi-square "
                  "{:.1f} with {} degrees of freedom, rank {}",
                  result.version(), result.rms_before_mm(), result.rms_after_mm(), result.rms_hold_out_mm(),
                  result.chi_square(), result.degrees_of_freedom(), result.rank()));
  output.Text(fmt::format(
      "expected place of the jet, 95 %, worst over the sheet: {:.4f} mm; stiffness at the tool {:.2f} N/mm",
      result.place_bound_95_mm(), result.stiffness_n_per_mm()));
  for (const std::string& weak : result.weak_directions()) {
    output.Text("cannot be told: " + weak, Tone::kWarning);
  }
  for (const std::string& outlier : result.outliers()) {
    output.Text("outlier: " + outlier, Tone::kWarning);
  }
}

absl::Status Activate(std::uint32_t version, const std::string& author, const Connections& connections,
                      Output& output) {
  calibration_v1::ActivateVersionRequest request;
  request.set_version(version);
  request.set_author(author.empty() ? Author() : author);
  calibration_v1::ActivateVersionResponse response;
  const absl::Status status = connections.Ask<CalibrationService>(
      kCalibrationService, &CalibrationService::Stub::ActivateVersion, request, response);
  if (status.ok()) {
    PrintJson(response, output);
    output.Text(fmt::format("active: version {} {}", response.model_version().version(),
                            response.model_version().hash()),
                Tone::kGood);
  }
  return status;
}

absl::Status Identify(std::uint64_t plan_id, const std::string& author, bool activate,
                      const Connections& connections, Output& output) {
  calibration_v1::StartIdentificationRequest request;
  request.set_plan_id(plan_id);
  request.set_author(author.empty() ? Author() : author);
  calibration_v1::StartIdentificationResponse started;
  absl::Status status = connections.Ask<CalibrationService>(
      kCalibrationService, &CalibrationService::Stub::StartIdentification, request, started);
  calibration_v1::GetIdentificationRequest get;
  get.set_operation_id(started.operation().id());
  while (status.ok()) {
    calibration_v1::GetIdentificationResponse now;
    status = connections.Ask<CalibrationService>(kCalibrationService,
                                                 &CalibrationService::Stub::GetIdentification, get, now);
    if (status.ok() && now.operation().state() != type::v1::OPERATION_STATE_RUNNING) {
      output.EndProgress();
      if (!now.has_result()) {
        output.Fail(ExitCode::kRefused, now.operation().reason(), now.operation().message());
        return absl::OkStatus();
      }
      PrintResult(now.result(), output);
      return activate ? Activate(now.result().version(), author, connections, output) : absl::OkStatus();
    }
    output.Progress(now.operation().progress(), now.operation().phase());
    std::this_thread::sleep_for(kPoll);
  }
  return status;
}

absl::Status Versions(const Connections& connections, Output& output) {
  calibration_v1::ListVersionsRequest request;
  request.set_page_size(100);
  calibration_v1::ListVersionsResponse response;
  const absl::Status status = connections.Ask<CalibrationService>(
      kCalibrationService, &CalibrationService::Stub::ListVersions, request, response);
  if (!status.ok()) {
    return status;
  }
  PrintJson(response, output);
  TextTable table{{"version", "active", "parent", "author", "created", "run", "hash"}, {}};
  for (const calibration_v1::Version& version : response.versions()) {
    table.rows.push_back({std::to_string(version.model_version().version()), version.active() ? "*" : "",
                          std::to_string(version.parent()), version.author(), version.created(),
                          std::to_string(version.run_plan_id()), version.model_version().hash()});
  }
  output.Table(table);
  return status;
}

absl::Status ShowVersion(std::optional<std::uint32_t> version, bool yaml, const Connections& connections,
                         Output& output) {
  calibration_v1::GetVersionRequest request;
  if (version) {
    request.set_version(*version);
  }
  calibration_v1::GetVersionResponse response;
  const absl::Status status = connections.Ask<CalibrationService>(
      kCalibrationService, &CalibrationService::Stub::GetVersion, request, response);
  if (!status.ok()) {
    return status;
  }
  PrintJson(response, output);
  if (yaml) {
    output.Text(response.machine_yaml());
    return status;
  }
  output.Text(fmt::format("version {} of {} by {} on {}{}", response.version().model_version().version(),
                          response.version().model_version().machine_id(), response.version().author(),
                          response.version().created(), response.version().active() ? ", active" : ""));
  PrintChanges(response.parameters(), output);
  return status;
}

absl::Status Diff(std::uint32_t before, std::uint32_t after, const Connections& connections, Output& output) {
  calibration_v1::DiffVersionsRequest request;
  request.set_before(before);
  request.set_after(after);
  calibration_v1::DiffVersionsResponse response;
  const absl::Status status = connections.Ask<CalibrationService>(
      kCalibrationService, &CalibrationService::Stub::DiffVersions, request, response);
  if (status.ok()) {
    PrintJson(response, output);
    PrintChanges(response.parameters(), output);
  }
  return status;
}

void AddMeasuring(CLI::App& noun, Output& output, const Connections& connections) {
  auto request = std::make_shared<calibration_v1::PlanMeasuringRunRequest>();
  auto looks = std::make_shared<std::optional<std::uint32_t>>();
  auto pierces = std::make_shared<std::optional<std::uint32_t>>();
  auto skip = std::make_shared<bool>(false);
  auto out = std::make_shared<std::string>("-");
  CLI::App* plan =
      AddServiceVerb(noun, "plan", "a part program that measures what identification needs; run it as a job");
  plan->add_option("--looks", *looks, "looks at marks, 4 to 60; default 16");
  plan->add_option("--trial-pierces", *pierces, "for the jet offset, 0 to 10; default 3");
  plan->add_flag("--skip-elasticity", *skip, "leave the elastic part out");
  plan->add_option("--out", *out, "G-code; - is standard output");
  plan->callback([=, &output, &connections] {
    if (*looks) request->set_looks(**looks);
    if (*pierces) request->set_trial_pierces(**pierces);
    request->set_skip_elasticity(*skip);
    output.Finish(PlanRun(*request, *out, connections, output));
  });

  auto plan_id = std::make_shared<std::uint64_t>(0);
  auto program = std::make_shared<std::string>();
  auto few = std::make_shared<std::optional<std::uint32_t>>();
  CLI::App* verify = AddServiceVerb(
      noun, "verify", "--program FILE writes the short program; after its job, --plan ID gives the verdict");
  auto* by_plan =
      verify->add_option("--plan", *plan_id, "the plan that the job ran; exit code 6 unless PASS");
  auto* by_program =
      verify->add_option("--program", *program, "where to write the short program; - is standard output");
  by_plan->excludes(by_program);
  verify->add_option("--looks", *few, "looks at marks, 2 to 12; default 3");
  verify->require_option(1, 2);
  verify->callback([=, &output, &connections] {
    if (const absl::Status status = Verify(*plan_id, *program, *few, connections, output); !status.ok())
      output.Fail(status);
  });

  auto run = std::make_shared<std::uint64_t>(0);
  CLI::App* runs = AddServiceVerb(noun, "runs", "measuring runs; with --plan one run's looks as CSV");
  runs->add_option("--plan", *run, "the plan that took it");
  runs->callback([=, &output, &connections] { output.Finish(Runs(*run, connections, output)); });
}

void AddIdentifying(CLI::App& noun, Output& output, const Connections& connections) {
  auto plan_id = std::make_shared<std::uint64_t>(0);
  auto author = std::make_shared<std::string>();
  auto activate = std::make_shared<bool>(false);
  CLI::App* identify =
      AddServiceVerb(noun, "identify", "identify the machine from a measuring run; makes a version");
  identify->add_option("--plan", *plan_id, "the plan of the measuring run")->required();
  identify->add_option("--author", *author, "for the record; default: $USER");
  identify->add_flag("--activate", *activate, "make it the active version at once");
  identify->callback([=, &output, &connections] {
    if (const absl::Status status = Identify(*plan_id, *author, *activate, connections, output); !status.ok())
      output.Fail(status);
  });

  auto version = std::make_shared<std::uint32_t>(0);
  auto by = std::make_shared<std::string>();
  CLI::App* activating =
      AddServiceVerb(noun, "activate", "make a version the active one; an older one rolls back");
  activating->add_option("VERSION", *version, "which")->required();
  activating->add_option("--author", *by, "for the record; default: $USER");
  activating->callback(
      [=, &output, &connections] { output.Finish(Activate(*version, *by, connections, output)); });
}

void AddVersions(CLI::App& noun, Output& output, const Connections& connections) {
  AddServiceVerb(noun, "versions", "versions, newest first")->callback([&] {
    output.Finish(Versions(connections, output));
  });

  auto shown = std::make_shared<std::optional<std::uint32_t>>();
  auto yaml = std::make_shared<bool>(false);
  CLI::App* show = AddServiceVerb(noun, "show", "a version with its change against its parent");
  show->add_option("VERSION", *shown, "default: the active one");
  show->add_flag("--yaml", *yaml, "the machine file of this version");
  show->callback(
      [=, &output, &connections] { output.Finish(ShowVersion(*shown, *yaml, connections, output)); });

  auto before = std::make_shared<std::uint32_t>(0);
  auto after = std::make_shared<std::uint32_t>(0);
  CLI::App* diff = AddServiceVerb(noun, "diff", "two versions, parameter by parameter");
  diff->add_option("BEFORE", *before, "from")->required();
  diff->add_option("AFTER", *after, "to")->required();
  diff->callback([=, &output, &connections] { output.Finish(Diff(*before, *after, connections, output)); });
}

}  // namespace

void AddCalibrationServiceVerbs(CLI::App& noun, Output& output, const Connections& connections) {
  AddMeasuring(noun, output, connections);
  AddIdentifying(noun, output, connections);
  AddVersions(noun, output, connections);
}

}  // namespace lambdajet::cli
