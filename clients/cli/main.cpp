#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>

#include "clients/cli/verbs.hpp"

using namespace lambdajet::cli;

int main(int count, char** words) {
  Output output(stdout, stderr);
  CLI::App app("lambdajet: ask the open-base water-jet machine and its calculations.");
  app.footer(kExitCodesHelp);
  app.fallthrough();
  app.require_subcommand(1);
  app.add_flag("--json", output.options().json, "one JSON value (or one per line) instead of text");
  app.add_flag("--quiet", output.options().quiet, "no messages, no progress");

  const auto noun = [&](const char* name, const char* what, auto... add) {
    CLI::App* sub = app.add_subcommand(name, what)->require_subcommand(1);
    (add(*sub, output), ...);
  };
  noun("kinematics", "poses, sliders, singularities, workspace", AddKinematicsVerbs);
  noun("trajectory", "part programs, plans, idle motion", AddTrajectoryVerbs);
  noun("calibration", "measuring, identification, versions", AddCalibrationVerbs);
  noun("accuracy", "predicted contour error, budget, error map", AddAccuracyVerbs);
  noun("inspection", "the contour really cut against the drawing", AddInspectionVerbs);

  try {
    app.parse(count, words);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : static_cast<int>(ExitCode::kUsage);
  }
  return static_cast<int>(output.exit_code());
}
