// Introduces the verbs that ask running services; beside verbs.hpp, which has those that work on files.
//
// Threads: start-up only.
#pragma once

#include <CLI/App.hpp>

#include "clients/cli/connections.hpp"
#include "clients/cli/output.hpp"

namespace lambdajet::cli {

void AddJobVerbs(CLI::App& noun, Output& output, const Connections& connections);
void AddMachineVerbs(CLI::App& noun, Output& output, const Connections& connections);
void AddTrajectoryServiceVerbs(CLI::App& noun, Output& output, const Connections& connections);
void AddCalibrationServiceVerbs(CLI::App& noun, Output& output, const Connections& connections);
void AddAccuracyServiceVerbs(CLI::App& noun, Output& output, const Connections& connections);
void AddInspectionServiceVerbs(CLI::App& noun, Output& output, const Connections& connections);

}  // namespace lambdajet::cli
