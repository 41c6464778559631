// The machine as the cell sees it: state with every veto, reset.
#include <fmt/format.h>

#include "clients/cli/service_verbs.hpp"
#include "lambdajet/cell/v1/cell.grpc.pb.h"

namespace lambdajet::cli {
namespace {

namespace cell_v1 = cell::v1;
using cell_v1::CellService;

void PrintMachine(const cell_v1::MachineState& state, Output& output) {
  if (output.json()) {
    return PrintJson(state, output);
  }
  TextTable table{{"node", "mode", "reason", "age_s"}, {}};
  for (const cell_v1::NodeState& node : state.nodes()) {
    table.rows.push_back({node.name(), node.mode(), node.reason(), Fixed(node.age_s(), 2)});
  }
  output.Table(table);
  output.Text(fmt::format("machine {} version {} {}", state.model_version().machine_id(),
                          state.model_version().version(), state.model_version().hash()));
  if (!state.job_id().empty()) {
    output.Text("job " + state.job_id());
  }
  for (const std::string& veto : state.vetoes()) {
    output.Text("veto " + veto, Tone::kWarning);
  }
  if (state.vetoes_size() == 0) {
    output.Text("may start", Tone::kGood);
  }
}

}  // namespace

void AddMachineVerbs(CLI::App& noun, Output& output, const Connections& connections) {
  noun.add_subcommand("state", "modules, services and every veto; exit code 6 while a start is forbidden")
      ->callback([&] {
        cell_v1::GetMachineStateResponse response;
        const absl::Status status = connections.Ask<CellService>("cell", &CellService::Stub::GetMachineState,
                                                                 cell_v1::GetMachineStateRequest(), response);
        if (!status.ok()) {
          return output.Fail(status);
        }
        PrintMachine(response.state(), output);
        output.Exit(response.state().vetoes_size() == 0 ? ExitCode::kOk : ExitCode::kPrecondition);
      });
  noun.add_subcommand("reset", "reset latched stops and reference both modules; starts no job")
      ->callback([&] {
        cell_v1::ResetMachineResponse response;
        const absl::Status status = connections.Ask<CellService>(
            "cell", &CellService::Stub::ResetMachine, cell_v1::ResetMachineRequest(), response, 120.0);
        if (status.ok()) {
          PrintMachine(response.state(), output);
        }
        output.Finish(status);
      });
}

}  // namespace lambdajet::cli
