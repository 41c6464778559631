// The kinematics house: solves the mechanism for people, programs and the bus.
#include "kinematics/bus/own_hexapod.hpp"
#include "kinematics/bus/pose_door.hpp"
#include "kinematics/rpc/kinematics_service.hpp"
#include "platform/house/house.hpp"
#include "platform/rpc/rpc_server.hpp"

int main(int argc, char** argv) {
  using namespace lambdajet;
  House house("kinematics", "solves the machine's mechanism for people, programs and the bus");
  std::string hexapod_file;
  house.schema().AddPath(
      "hexapod_file", &hexapod_file,
      "a hexapod to answer for as well, alone where no machine description comes; empty: none");
  if (const auto exit_code = house.Open(argc, argv)) {
    return *exit_code;
  }
  auto hexapod = kinematics::ReadOwnHexapod(hexapod_file);
  if (!hexapod.ok()) {
    return house.Refuse(hexapod.status(), 78);
  }
  if (*hexapod == nullptr) {
    house.Require("machine_description");
  }
  kinematics::MachineSlot machine(*std::move(hexapod));
  kinematics::KinematicsRpc rpc(machine);
  house.rpc().Add(rpc, kinematics::v1::KinematicsService::service_full_name());
  auto poses = kinematics::PoseDoor::Open(house.bus(), machine, house.log(), house.metrics(),
                                          [&] { house.Met("machine_description"); });
  if (!poses.ok()) {
    return house.Refuse(poses.status());
  }
  house.OnStop([&] { poses->reset(); });
  return house.Run();
}
