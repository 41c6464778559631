// The kinematics house: solves the mechanism for people, programs and the bus.
#include "kinematics/bus/pose_door.hpp"
#include "kinematics/rpc/kinematics_service.hpp"
#include "platform/house/house.hpp"
#include "platform/rpc/rpc_server.hpp"

int main(int argc, char** argv) {
  using namespace lambdajet;
  House house("kinematics", "solves the machine's mechanism for people, programs and the bus");
  if (const auto exit_code = house.Open(argc, argv)) {
    return *exit_code;
  }
  house.Require("machine_description");
  kinematics::MachineSlot machine;
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
