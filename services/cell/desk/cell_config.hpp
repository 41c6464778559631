// Declares the cell's own settings.
//
// Threads: start-up only.
#pragma once

#include <string>

#include "platform/config/schema.hpp"

namespace lambdajet::cell {

struct CellConfig {
  std::string store = "cell.sqlite";
  std::string trajectory_address = "127.0.0.1:50053";
  std::string trajectory_ca_file;
  std::string trajectory_certificate_file;
  std::string trajectory_key_file;

  void Declare(ConfigSchema& schema) {
    schema.Add("store", &store, "the journal, a SQLite file");
    schema.Add("trajectory.address", &trajectory_address, "where the trajectory service listens");
    schema.Add("trajectory.ca_file", &trajectory_ca_file,
               "PEM to trust trajectory's certificate; empty: plaintext");
    schema.Add("trajectory.certificate_file", &trajectory_certificate_file,
               "the cell's own certificate towards trajectory");
    schema.Add("trajectory.key_file", &trajectory_key_file, "its key");
  }
};

}  // namespace lambdajet::cell
