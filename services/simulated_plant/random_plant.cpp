// Writes the truth of a random machine around a description, on standard output:
//   random_plant --machine FILE --seed N > plant.yaml
#include <cstdio>
#include <string>

#include "platform/config/load.hpp"
#include "platform/machine_file/machine_file.hpp"
#include "simulated_plant/core/nominal_plant.hpp"
#include "simulated_plant/plant_file/plant_file.hpp"

int main(int argc, char** argv) {
  using namespace lambdajet;
  std::string machine_file = "deploy/config/machine.yaml";
  int seed = 1;
  ConfigSchema schema;
  schema.AddPath("machine", &machine_file, "the description to draw around");
  schema.Add("seed", &seed, {1, 2'000'000'000}, "the same seed gives the same machine");
  if (const auto exit_code = LoadConfig(schema, argc, argv, "draws a random simulated machine")) {
    return *exit_code;
  }
  const auto machine = ReadMachineFile(machine_file);
  if (!machine.ok()) {
    std::fprintf(stderr, "%s\n", std::string(machine.status().message()).c_str());
    return kExitConfig;
  }
  const auto truth = simulated_plant::RandomPlant(*machine, static_cast<std::uint64_t>(seed));
  std::fputs(simulated_plant::PlantText(truth).c_str(), stdout);
  return 0;
}
