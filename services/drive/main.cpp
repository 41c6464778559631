// The drive module's node: carries the sheet under the jet, with the simulated plant for iron.
#include "drive/bus/drive_node.hpp"
#include "link/bus/module_desk.hpp"
#include "platform/house/house.hpp"
#include "simulated_plant/bus/simulated_modules.hpp"

int main(int argc, char** argv) {
  using namespace lambdajet;
  House house("drive", "plays plans on the path clock and moves the sheet under the jet");
  drive::NodeConfig config;
  config.Declare(house.schema());
  simulated_plant::PlantOptions plant_options;
  plant_options.Declare(house.schema());
  link::EnterModulePriority();  // before the bus' threads start
  if (const auto exit_code = house.Open(argc, argv)) {
    return *exit_code;
  }
  auto plant = simulated_plant::SimulatedDrive::Open(house.bus(), plant_options);
  if (!plant.ok()) {
    return house.Refuse(plant.status());
  }
  house.Require("control_loop");
  auto node = drive::DriveNode::Open(
      {house.bus(), house.clock(), house.log(), house.metrics()}, config, (*plant)->hardware(),
      [&](const DriveState& state) { (*plant)->Publish(state); }, [&] { house.Met("control_loop"); });
  if (!node.ok()) {
    return house.Refuse(node.status());
  }
  house.EverySecond([&] { (*node)->UpdateMetrics(); });
  house.OnStop([&] { node->reset(); });
  return house.Run();
}
