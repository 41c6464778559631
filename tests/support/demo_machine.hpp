// The demonstration machine as designed, for tests of the modules.
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <string>

#include "foundation/machine/machine_description.hpp"
#include "platform/machine_file/machine_file.hpp"

namespace lambdajet::tests {

inline MachineDescription DemoMachine() {
  const auto machine =
      ReadMachineFile(std::string(std::getenv("LAMBDAJET_SOURCE_DIR")) + "/deploy/config/machine.yaml");
  EXPECT_TRUE(machine.ok()) << machine.status().ToString();
  return *machine;
}

}  // namespace lambdajet::tests
