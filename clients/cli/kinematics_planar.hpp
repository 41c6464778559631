// Answers the lambda's half of `lambdajet kinematics` from files: poses, sliders, Jacobians, singularities, workspace, sweep,
// geometry optimisation, and their pictures.
//
// Model: kinematics/core/lambda_mechanism.hpp, workspace.hpp, swept_collision.hpp, kinematics/optimisation. The machine file
// is that of platform/machine_file; a row of the table in is a row of the table out, with its reason.
// Frames: x_D_mm, y_D_mm is the origin of E in D; actuators are encoder readings. Units: in the columns.
// Errors: those of the files; BAD_MODE, BAD_ZONE, BAD_BODY, BAD_PICTURE_RANGE. Threads: one.
#pragma once

#include <CLI/App.hpp>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "clients/cli/output.hpp"
#include "kinematics/core/lambda_mechanism.hpp"

namespace lambdajet::cli {

struct PlanarTables {
  std::string machine;  // path
  std::string in = "-";
  std::string out = "-";
  std::string mode;  // "++", "+-", "-+", "--"; empty: the machine's own
};

absl::Status SolvePlanarInverse(const PlanarTables& files, Output& output);
absl::Status SolvePlanarForward(const PlanarTables& files, Output& output);
absl::Status TabulatePlanarJacobian(const PlanarTables& files, Output& output);
absl::Status TabulatePlanarSingularity(const PlanarTables& files, Output& output);

struct PlanarWorkspaceOptions {
  std::string machine;
  std::string out = "-";
  std::string mode;
  double tolerance_mm = 0.1;
};
absl::Status TracePlanarWorkspace(const PlanarWorkspaceOptions& options, Output& output);

// The machine file's mechanism, on another working mode if one is named.
absl::StatusOr<kinematics::LambdaMechanism> ReadMechanism(const std::string& path, const std::string& mode);

void AddOptimiseVerb(CLI::App& noun, Output& output);
void AddSweepVerb(CLI::App& noun, Output& output);
// Verbs `pose`, `workspace` and `determinant` of `draw`.
void AddPlanarPictures(CLI::App& draw, Output& output);

}  // namespace lambdajet::cli
