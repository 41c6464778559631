#include <memory>
#include <string>
#include <vector>

#include "clients/cli/kinematics_hexapod.hpp"
#include "clients/cli/kinematics_planar.hpp"
#include "clients/cli/verbs.hpp"

namespace lambdajet::cli {
namespace {

struct TableVerb {
  PlanarTables files;
  std::string mechanism = "lambda";
};

const std::vector<std::string> kMechanisms = {"lambda", "hexapod"};
constexpr char kMechanismHelp[] = "what the file describes: lambda (default; a biglide is one) or hexapod";

using SolvePlanarTable = absl::Status (*)(const PlanarTables&, Output&);
using SolveHexapodTable = absl::Status (*)(const PoseTables&, Output&);

void AddTableVerb(CLI::App& noun, Output& output, const char* name, const char* what, SolvePlanarTable planar,
                  SolveHexapodTable hexapod) {
  auto options = std::make_shared<TableVerb>();
  CLI::App* verb = noun.add_subcommand(name, what);
  verb->add_option("--machine", options->files.machine, "YAML file of the mechanism")->required();
  verb->add_option("--mechanism", options->mechanism, kMechanismHelp)->check(CLI::IsMember(kMechanisms));
  verb->add_option("--in", options->files.in, "CSV; - is standard input");
  verb->add_option("--out", options->files.out, "CSV; - is standard output");
  verb->add_option("--mode", options->files.mode,
                   "lambda: working mode ++, +-, -+ or --; default the machine's");
  verb->callback([options, planar, hexapod, &output] {
    const PlanarTables& files = options->files;
    output.Finish(options->mechanism == "lambda" ? planar(files, output)
                                                 : hexapod({files.machine, files.in, files.out}, output));
  });
}

void AddWorkspaceVerb(CLI::App& noun, Output& output) {
  auto planar = std::make_shared<PlanarWorkspaceOptions>();
  auto spatial = std::make_shared<HexapodWorkspaceOptions>();
  auto mechanism = std::make_shared<std::string>("lambda");
  CLI::App* verb = noun.add_subcommand("workspace", "where the tool may be");
  verb->add_option("--machine", planar->machine, "YAML file of the mechanism")->required();
  verb->add_option("--mechanism", *mechanism, kMechanismHelp)->check(CLI::IsMember(kMechanisms));
  verb->add_option("--out", planar->out, "CSV; - is standard output");
  verb->add_option("--mode", planar->mode, "lambda: working mode ++, +-, -+ or --; default the machine's");
  verb->add_option("--tolerance-mm", planar->tolerance_mm, "lambda: of the outline")
      ->check(CLI::Range(0.001, 100.0));
  verb->add_option("--z-mm", spatial->z_mm, "hexapod: heights of the slices");
  verb->add_option("--tilt-rad", spatial->tilt_rad,
                   "hexapod: tilts about x that must all be served, both ways");
  verb->add_option("--step-mm", spatial->step_mm, "hexapod: grid of the slices");
  verb->callback([planar, spatial, mechanism, &output] {
    spatial->machine = planar->machine;
    spatial->out = planar->out;
    output.Finish(*mechanism == "lambda" ? TracePlanarWorkspace(*planar, output)
                                         : CutHexapodWorkspace(*spatial, output));
  });
}

}  // namespace

void AddKinematicsVerbs(CLI::App& noun, Output& output) {
  AddTableVerb(noun, output, "inverse", "actuators for poses", SolvePlanarInverse, SolveHexapodInverse);
  AddTableVerb(noun, output, "forward", "poses for actuators", SolvePlanarForward, SolveHexapodForward);
  AddTableVerb(noun, output, "jacobian", "actuators by pose and by every parameter", TabulatePlanarJacobian,
               TabulateHexapodJacobian);
  AddTableVerb(noun, output, "singularity", "how far poses are from singular ones", TabulatePlanarSingularity,
               TabulateHexapodSingularity);
  AddWorkspaceVerb(noun, output);
  AddServiceAreaVerb(noun, output);
  AddOptimiseVerb(noun, output);
  AddSweepVerb(noun, output);
  CLI::App* draw =
      noun.add_subcommand("draw", "pictures, SVG or PNG by the file's suffix")->require_subcommand(1);
  AddPlanarPictures(*draw, output);
  AddHexapodPictures(*draw, output);
}

}  // namespace lambdajet::cli
