// Answers the hexapod's half of `lambdajet kinematics` from files: poses, lengths, singularities, workspace, service area,
// and their pictures.
//
// Model: kinematics/core/hexapod*.hpp and service_area.hpp. A row of the table in is a row of the table out, with its reason.
// Frames: poses are the tool's in the base M, angles Krylov's (foundation/geometry/pose.hpp). Units: in the columns.
// Errors: those of the files; BAD_HEXAPOD_FILE, BAD_WORKSPACE, BAD_SERVICE_AREA. Threads: one.
#pragma once

#include <CLI/App.hpp>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "clients/cli/output.hpp"
#include "kinematics/core/hexapod_workspace.hpp"
#include "kinematics/core/service_area.hpp"

namespace lambdajet::cli {

struct PoseTables {
  std::string machine;  // path
  std::string in = "-";
  std::string out = "-";
};

absl::Status SolveHexapodInverse(const PoseTables& files, Output& output);
absl::Status SolveHexapodForward(const PoseTables& files, Output& output);
absl::Status TabulateHexapodJacobian(const PoseTables& files, Output& output);
absl::Status TabulateHexapodSingularity(const PoseTables& files, Output& output);

struct HexapodWorkspaceOptions {
  std::string machine;
  std::string out = "-";
  std::vector<double> z_mm;      // heights of the slices; none: nine over the struts' reach
  std::vector<double> tilt_rad;  // the tool must be served at each of these tilts about x, both ways
  double step_mm = 10.0;
};
absl::Status CutHexapodWorkspace(const HexapodWorkspaceOptions& options, Output& output);

// The paper's base set with `name=number` settings in it.
absl::StatusOr<kinematics::ServiceAreaMachine> ServiceMachineOf(const std::vector<std::string>& settings);
// A box about home that holds every reachable tool place; tilts as in HexapodWorkspaceOptions.
kinematics::HexapodWorkspaceRequest WorkspaceRequestFor(const kinematics::Hexapod& hexapod, double step_mm,
                                                        const std::vector<double>& tilt_rad);

void AddServiceAreaVerb(CLI::App& noun, Output& output);
// Verbs `hexapod`, `service-area` and `sweeps` of `draw`.
void AddHexapodPictures(CLI::App& draw, Output& output);

}  // namespace lambdajet::cli
