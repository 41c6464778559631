// Introduces every noun of `lambdajet` with its verbs to the command line.
//
// Model: `lambdajet NOUN VERB`. A noun has two files: NOUN.cpp holds verbs that work on files without any
// service, NOUN_service.cpp verbs that ask a running service. A verb's callback ends with
// output.Finish(status) or Fail(…). Threads: start-up only.
#pragma once

#include <CLI/App.hpp>

#include "clients/cli/output.hpp"

namespace lambdajet::cli {

void AddKinematicsVerbs(CLI::App& noun, Output& output);
void AddTrajectoryVerbs(CLI::App& noun, Output& output);
void AddDrawingVerbs(CLI::App& noun, Output& output);
void AddCldataVerbs(CLI::App& noun, Output& output);  // of the noun trajectory
void AddCalibrationVerbs(CLI::App& noun, Output& output);
void AddAccuracyVerbs(CLI::App& noun, Output& output);
void AddInspectionVerbs(CLI::App& noun, Output& output);

}  // namespace lambdajet::cli
