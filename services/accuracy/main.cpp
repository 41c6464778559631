// The accuracy house: predicts how far from the drawing a cut will be, before it and live.
#include "accuracy/bus/live_room.hpp"
#include "accuracy/bus/machine_reader.hpp"
#include "accuracy/rpc/accuracy_rpc.hpp"
#include "platform/house/house.hpp"
#include "platform/rpc/rpc_server.hpp"

int main(int argc, char** argv) {
  using namespace lambdajet;
  House house("accuracy", "predicts how far from the drawing a cut will be, before it and live");
  if (const auto exit_code = house.Open(argc, argv)) {
    return *exit_code;
  }
  house.Require("machine_description");
  auto machines =
      accuracy::MachineReader::Open(house.bus(), house.log(), [&] { house.Met("machine_description"); });
  if (!machines.ok()) {
    return house.Refuse(machines.status());
  }
  auto live = accuracy::LiveRoom::Open(house.bus(), **machines, house.clock());
  if (!live.ok()) {
    return house.Refuse(live.status());
  }
  accuracy::AccuracyRpc rpc([&] { return (*machines)->active(); });
  house.rpc().Add(rpc, accuracy::v1::AccuracyService::service_full_name());
  house.OnStop([&] { live->reset(); });
  return house.Run();
}
