// The cell house: jobs from MES and CAM, led through both modules, written down.
#include "cell/bus/machine_link.hpp"
#include "cell/desk/cell_config.hpp"
#include "cell/rpc/cell_service.hpp"
#include "cell/rpc/planner.hpp"
#include "platform/house/house.hpp"
#include "platform/rpc/rpc_server.hpp"

int main(int argc, char** argv) {
  using namespace lambdajet;
  House house("cell",
              "takes jobs from MES and CAM, leads both modules through them, and writes everything down");
  cell::CellConfig config;
  config.Declare(house.schema());
  if (const auto exit_code = house.Open(argc, argv)) {
    return *exit_code;
  }
  const std::uint64_t session = cell::NewSession();
  auto desk = cell::JobDesk::Open(config.store, house.clock(), session);
  if (!desk.ok()) {
    return house.Refuse(desk.status());
  }
  auto planner = cell::Planner::Open(**desk, config);
  if (!planner.ok()) {
    return house.Refuse(planner.status());
  }
  auto machine = cell::MachineLink::Open(house.bus(), **desk, house.clock(), session, house.machine_id());
  if (!machine.ok()) {
    return house.Refuse(machine.status());
  }
  cell::CellDoor door(**desk, house.clock());
  house.rpc().Add(door, cell::v1::CellService::service_full_name());
  house.OnStop([&] { (*desk)->Close(); });
  house.OnStop([&] { door.Close(); });
  return house.Run();
}
