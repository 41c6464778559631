// Fills a house's settings from its YAML file, its environment and its flags.
//
// Model: a flag wins over an environment variable, that over the file, that over the default. `--config FILE`
// (or LAMBDAJET_CONFIG) names the file; `--help` and `--print-config` print and end the program. An unknown
// key is refused with file, line and the nearest known key; a wrong type or range with the value, where it
// stands and what is right. Validity: files up to 1 MiB, no aliases, no duplicate keys. Variables of the
// environment that no setting has are somebody else's and ignored. Threads: start-up only. Errors: all of the
// faults found are told at once, at most 20.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "platform/config/schema.hpp"

namespace lambdajet {

inline constexpr int kExitConfig = 78;  // EX_CONFIG of sysexits.h

struct ConfigSources {
  std::string program;                 // name for messages and --help
  std::string about;                   // one sentence for --help
  std::vector<std::string> arguments;  // without the program's own name
  std::function<std::optional<std::string>(const std::string& name)> environment;
};

// What the program must do next: run on (exit_code empty), or print and end.
struct ConfigOutcome {
  std::optional<int> exit_code;
  std::string out;  // for stdout
  std::string err;  // for stderr
};

ConfigOutcome LoadConfig(ConfigSchema& schema, const ConfigSources& sources);

// The same with the process' own arguments and environment; prints. The exit code, or nothing to run on.
std::optional<int> LoadConfig(ConfigSchema& schema, int argc, const char* const* argv,
                              const std::string& about);

}  // namespace lambdajet
