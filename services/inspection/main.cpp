// The inspection house: the judge of the simulated machine's cuts.
#include "inspection/bus/truth_reader.hpp"
#include "inspection/recording/recorder.hpp"
#include "inspection/rpc/inspection_rpc.hpp"
#include "platform/house/house.hpp"
#include "platform/rpc/rpc_server.hpp"

int main(int argc, char** argv) {
  using namespace lambdajet;
  House house("inspection",
              "joins the simulated machine's truth into the cut and compares it with the drawing");
  if (const auto exit_code = house.Open(argc, argv)) {
    return *exit_code;
  }
  inspection::Recorder recorder;
  auto truth = inspection::TruthReader::Open(house.bus(), recorder);
  if (!truth.ok()) {
    return house.Refuse(truth.status());
  }
  inspection::InspectionRpc rpc(recorder);
  house.rpc().Add(rpc, inspection::v1::InspectionService::service_full_name());
  house.OnStop([&] { truth->reset(); });
  return house.Run();
}
