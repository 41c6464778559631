// The calibration house: plans measuring runs, identifies the machine, and tells everyone the version in force.
#include "calibration/bus/calibration_bus.hpp"
#include "calibration/desk/calibration_desk.hpp"
#include "calibration/rpc/calibration_rpc.hpp"
#include "platform/house/house.hpp"
#include "platform/rpc/rpc_server.hpp"

int main(int argc, char** argv) {
  using namespace lambdajet;
  House house("calibration",
              "plans measuring runs, identifies the machine, and tells everyone the version in force");
  std::string store = "calibration.sqlite";
  std::string machine;
  house.schema().AddPath("store", &store, "looks and versions, a SQLite file");
  house.schema().AddPath("machine", &machine, "machine file that becomes version 0 of a new store");
  if (const auto exit_code = house.Open(argc, argv)) {
    return *exit_code;
  }
  auto desk = calibration::CalibrationDesk::Open(store, machine, house.machine_id(), house.clock());
  if (!desk.ok()) {
    return house.Refuse(desk.status());
  }
  auto bus =
      calibration::CalibrationBus::Open(house.bus(), **desk, house.clock(), house.log(), house.metrics());
  if (!bus.ok()) {
    return house.Refuse(bus.status());
  }
  calibration::CalibrationRpc rpc(**desk);
  house.rpc().Add(rpc, calibration::v1::CalibrationService::service_full_name());
  house.OnStop([&] { (*desk)->Close(); });
  return house.Run();
}
