#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <string>
#include <vector>

#include "clients/cli/service_verbs.hpp"
#include "clients/cli/verbs.hpp"

using namespace lambdajet::cli;

namespace {

// Where a noun or verb is missing or unknown: which there are. Else the library's own words.
std::string Complaint(const CLI::App* app, const CLI::Error& error) {
  const std::vector<std::string> unknown = app->remaining(true);
  std::string path = "lambdajet";
  while (!app->get_subcommands().empty()) {
    app = app->get_subcommands().front();
    path += " " + app->get_name();
  }
  if (error.get_name() != "RequiredError" || app->get_require_subcommand_min() == 0) {
    return "lambdajet: " + std::string(error.what()) + "\n`" + path + " --help` says what is right\n";
  }
  std::string there;
  for (const CLI::App* one : app->get_subcommands([](const CLI::App*) { return true; })) {
    there += (there.empty() ? "" : ", ") + one->get_name();
  }
  return (unknown.empty() ? path + " needs one more word: "
                          : path + ": there is no '" + unknown.front() + "', but ") +
         there + "\n";
}

}  // namespace

int main(int count, char** words) {
  Output output(stdout, stderr);
  Connections connections;
  CLI::App app("lambdajet: ask the open-base water-jet machine and its calculations.", "lambdajet");
  app.footer(kExitCodesHelp);
  app.failure_message(Complaint);
  app.fallthrough();
  app.require_subcommand(1);
  app.add_flag("--json", output.options().json, "one JSON value (or one per line) instead of text");
  app.add_flag("--quiet", output.options().quiet, "no messages, no progress");
  connections.AddOptions(app);
  const auto noun = [&](const char* name, const char* what) -> CLI::App& {
    return *app.add_subcommand(name, what)->require_subcommand(1);
  };
  CLI::App& trajectory =
      noun("trajectory", "part programs and drawings, plans, pictures; on files, and of the service");
  CLI::App& calibration = noun("calibration", "measuring, identification, versions");
  CLI::App& accuracy = noun("accuracy", "predicted contour error, budget, error map");
  CLI::App& inspection = noun("inspection", "the contour really cut against the drawing");
  AddKinematicsVerbs(noun("kinematics", "poses, sliders, singularities, workspace"), output);
  AddTrajectoryVerbs(trajectory, output);
  AddDrawingVerbs(trajectory, output);
  AddTrajectoryServiceVerbs(trajectory, output, connections);
  AddCalibrationVerbs(calibration, output);
  AddCalibrationServiceVerbs(calibration, output, connections);
  AddAccuracyVerbs(accuracy, output);
  AddAccuracyServiceVerbs(accuracy, output, connections);
  AddInspectionVerbs(inspection, output);
  AddInspectionServiceVerbs(inspection, output, connections);
  AddJobVerbs(noun("job", "jobs of the cell: submit, start, follow, report"), output, connections);
  AddMachineVerbs(noun("machine", "both modules and every veto; reset"), output, connections);
  try {
    app.parse(count, words);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : static_cast<int>(ExitCode::kUsage);
  }
  return static_cast<int>(output.exit_code());
}
