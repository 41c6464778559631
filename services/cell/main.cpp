#include <random>

#include "cell/bus/machine_link.hpp"
#include "cell/desk/job_desk.hpp"
#include "cell/rpc/cell_service.hpp"
#include "cell/rpc/planner.hpp"
#include "cell/store/journal.hpp"
#include "platform/house/house.hpp"
#include "platform/rpc/channel.hpp"
#include "platform/rpc/rpc_server.hpp"

using namespace lambdajet;

int main(int argc, char** argv) {
  House house("cell",
              "takes jobs from MES and CAM, leads both modules through them, and writes everything down");
  std::string store = "cell.sqlite";
  ChannelOptions trajectory;
  trajectory.address = "127.0.0.1:50053";
  house.schema().Add("store", &store, "the journal, a SQLite file");
  house.schema().Add("trajectory.address", &trajectory.address, "where the trajectory service listens");
  house.schema().Add("trajectory.ca_file", &trajectory.ca_file,
                     "PEM to trust trajectory's certificate; empty: plaintext");
  house.schema().Add("trajectory.certificate_file", &trajectory.certificate_file,
                     "the cell's own certificate towards trajectory");
  house.schema().Add("trajectory.key_file", &trajectory.key_file, "its key");
  if (const auto exit_code = house.Open(argc, argv)) return *exit_code;

  auto journal = cell::Journal::Open(store);
  if (!journal.ok()) return house.Refuse(journal.status());
  const auto channel = OpenChannel(trajectory);
  if (!channel.ok()) return house.Refuse(channel.status());
  const std::uint64_t session =
      (static_cast<std::uint64_t>(std::random_device()()) << 32U) | std::random_device()();
  cell::JobDesk desk(std::move(*journal), house.clock(), session);
  if (const absl::Status taken = desk.TakeUp(); !taken.ok()) return house.Refuse(taken);
  cell::Planner planner(desk, *channel);
  auto machine = cell::MachineLink::Open(house.bus(), desk, house.clock(), session, house.machine_id());
  if (!machine.ok()) return house.Refuse(machine.status());
  cell::CellDoor door(desk, house.clock());
  house.rpc().Add(door, cell::v1::CellService::service_full_name());
  house.OnStop([&] {
    door.Close();
    desk.Close();
  });
  return house.Run();
}
