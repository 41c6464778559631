// The main-motion module's node: pump, jet, abrasive and camera, with the simulated plant for iron.
#include "link/bus/module_desk.hpp"
#include "main_motion/bus/main_motion_node.hpp"
#include "platform/house/house.hpp"
#include "simulated_plant/bus/simulated_modules.hpp"

int main(int argc, char** argv) {
  using namespace lambdajet;
  House house("main_motion",
              "follows the drive and makes the jet do its part, each thing at its own instant");
  main_motion::NodeConfig config;
  config.Declare(house.schema());
  simulated_plant::PlantOptions plant_options;
  plant_options.Declare(house.schema());
  link::EnterModulePriority();  // before the bus' threads start
  if (const auto exit_code = house.Open(argc, argv)) {
    return *exit_code;
  }
  auto plant = simulated_plant::SimulatedMainMotion::Open(house.bus(), plant_options);
  if (!plant.ok()) {
    return house.Refuse(plant.status());
  }
  house.Require("control_loop");
  auto node = main_motion::MainMotionNode::Open(
      {house.bus(), house.clock(), house.log(), house.metrics()}, config, (*plant)->hardware(),
      [&] { (*plant)->Refresh(); }, [&](const MainMotionState& state) { (*plant)->Publish(state); },
      [&] { house.Met("control_loop"); });
  if (!node.ok()) {
    return house.Refuse(node.status());
  }
  house.EverySecond([&] { (*node)->UpdateMetrics(); });
  house.OnStop([&] { node->reset(); });
  return house.Run();
}
