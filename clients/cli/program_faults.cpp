#include "clients/cli/program_faults.hpp"

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
  output.Exit(ExitCode::kRefused);
}

}  // namespace lambdajet::cli
