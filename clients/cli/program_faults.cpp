#include "clients/cli/program_faults.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

namespace lambdajet::cli {

void TellFaults(const std::string& file, const std::vector<trajectory::ProgramFault>& faults,
                Output& output) {
  nlohmann::json list = nlohmann::json::array();
  for (const trajectory::ProgramFault& fault : faults) {
    const std::string place = file + ":" + std::to_string(fault.line) +
                              (fault.column > 0 ? ":" + std::to_string(fault.column) : "");
    output.Text(place + ": " + std::string(fault.reason) +
                    (fault.word.empty() ? "" : " '" + fault.word + "'") + ": " + fault.message,
                Tone::kBad);
    list.push_back({{"line", fault.line},
                    {"column", fault.column},
                    {"reason", std::string(fault.reason)},
                    {"word", fault.word},
                    {"message", fault.message}});
  }
  output.Json({{"faults", list}});
  if (std::ranges::any_of(faults, [](const auto& fault) { return fault.reason == "AXIS_NOT_DRIVEN"; })) {
    output.Message(
        "a hexapod's program is read with --axes hexapod, and checked, planned and drawn with --hexapod "
        "FILE");
  }
  output.Exit(ExitCode::kRefused);
}

}  // namespace lambdajet::cli
