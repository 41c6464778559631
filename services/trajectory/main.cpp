#include "platform/bus/participant.hpp"
#include "platform/house/house.hpp"
#include "platform/rpc/rpc_server.hpp"
#include "trajectory/bus/machine_reader.hpp"
#include "trajectory/bus/own_hexapod.hpp"
#include "trajectory/bus/plan_streamer.hpp"
#include "trajectory/rpc/trajectory_rpc.hpp"

int main(int argc, char** argv) {
  using namespace lambdajet;
  House house("trajectory", "reads part programs, plans them and streams them to the modules");
  trajectory::OwnHexapod hexapod(house.schema());
  if (const auto exit_code = house.Open(argc, argv)) {
    return *exit_code;
  }
  if (const absl::Status read = hexapod.Read(); !read.ok()) {
    return house.Refuse(read, 78);
  }
  if (hexapod.model() == nullptr) {
    house.Require("machine_description");
  }
  auto machines = trajectory::MachineReader::Open(house.bus(), house.log(),
                                                  [&house] { house.Met("machine_description"); });
  if (!machines.ok()) {
    return house.Refuse(machines.status());
  }
  auto streamer = trajectory::PlanStreamer::Open(house.bus(), house.clock(), house.metrics());
  if (!streamer.ok()) {
    return house.Refuse(streamer.status());
  }
  trajectory::PlanDesk desk(house.metrics());
  trajectory::TrajectoryRpc rpc(
      [&machines](std::optional<std::uint32_t> version) { return (*machines)->Find(version); },
      {[&streamer](std::shared_ptr<const Plan> plan) { (*streamer)->Start(std::move(plan)); },
       [&streamer](std::uint64_t id) { return (*streamer)->Stop(id); }},
      desk, hexapod.model());
  house.rpc().Add(rpc, trajectory::v1::TrajectoryService::service_full_name());
  house.OnStop([&desk] { desk.CancelAll(); });
  return house.Run();
}
