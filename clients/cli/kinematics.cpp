#include <memory>
#include <string>
#include <vector>

#include "clients/cli/kinematics_hexapod.hpp"
#include "clients/cli/verbs.hpp"

namespace lambdajet::cli {
namespace {

struct TableVerb {
  PoseTables files;
  std::string mechanism;
};

const std::vector<std::string> kMechanisms = {"hexapod"};

using SolveTable = absl::Status (*)(const PoseTables&, Output&);

void AddTableVerb(CLI::App& noun, Output& output, const char* name, const char* what, SolveTable hexapod) {
  auto options = std::make_shared<TableVerb>();
  CLI::App* verb = noun.add_subcommand(name, what);
  verb->add_option("--machine", options->files.machine, "YAML file of the mechanism")->required();
  verb->add_option("--mechanism", options->mechanism, "what the file describes")
      ->required()
      ->check(CLI::IsMember(kMechanisms));
  verb->add_option("--in", options->files.in, "CSV; - is standard input");
  verb->add_option("--out", options->files.out, "CSV; - is standard output");
  verb->callback([options, hexapod, &output] { output.Finish(hexapod(options->files, output)); });
}

void AddWorkspaceVerb(CLI::App& noun, Output& output) {
  auto options = std::make_shared<HexapodWorkspaceOptions>();
  auto mechanism = std::make_shared<std::string>();
  CLI::App* verb = noun.add_subcommand("workspace", "where the tool may be");
  verb->add_option("--machine", options->machine, "YAML file of the mechanism")->required();
  verb->add_option("--mechanism", *mechanism, "what the file describes")
      ->required()
      ->check(CLI::IsMember(kMechanisms));
  verb->add_option("--out", options->out, "CSV; - is standard output");
  verb->add_option("--z", options->z_mm, "hexapod: heights of the slices, mm");
  verb->add_option("--tilt", options->tilt_rad,
                   "hexapod: tilts about x that must all be served, both ways, rad");
  verb->add_option("--step", options->step_mm, "hexapod: grid of the slices, mm");
  verb->callback([options, mechanism, &output] { output.Finish(CutHexapodWorkspace(*options, output)); });
}

}  // namespace

void AddKinematicsVerbs(CLI::App& noun, Output& output) {
  AddTableVerb(noun, output, "inverse", "actuators for poses", SolveHexapodInverse);
  AddTableVerb(noun, output, "forward", "poses for actuators", SolveHexapodForward);
  AddTableVerb(noun, output, "jacobian", "actuators by pose and by every parameter", TabulateHexapodJacobian);
  AddTableVerb(noun, output, "singularity", "how far poses are from singular ones",
               TabulateHexapodSingularity);
  AddWorkspaceVerb(noun, output);
  AddServiceAreaVerb(noun, output);
  CLI::App* draw =
      noun.add_subcommand("draw", "pictures, SVG or PNG by the file's suffix")->require_subcommand(1);
  AddHexapodPictures(*draw, output);
}

}  // namespace lambdajet::cli
