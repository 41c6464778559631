// The settings that every house has.
#pragma once

#include <string>

#include "platform/bus/bus_options.hpp"
#include "platform/config/schema.hpp"
#include "platform/rpc/rpc_server.hpp"

namespace lambdajet {

struct CommonConfig {
  std::string machine_id = "demo-1";
  std::string log_level = "info";
  std::string announce_file;
  std::string metrics_address = "127.0.0.1:0";
  RpcOptions rpc;
  BusOptions bus;

  void Declare(ConfigSchema& schema);
};

}  // namespace lambdajet
