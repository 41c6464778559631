// Starts the real processes of one cell for a test: own DDS domain, free ports, a folder of their own.
#pragma once

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/support/child_process.hpp"
#include "tests/support/private_domain.hpp"
#include "tests/support/temporary_folder.hpp"

namespace lambdajet::test {

// A free port for a process that must come back under the same one, from the block that belongs to a reserved domain. The
// kernel's own choice could be given to somebody else before the process takes it.
inline int FreePort(int domain, int from_port) {
  constexpr int kBegin = 20000, kPerDomain = 16;  // the same in deploy/main_job/cell_processes.py
  for (int port = std::max(from_port, kBegin + kPerDomain * domain);
       port < kBegin + kPerDomain * (domain + 1); ++port) {
    const int file = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    const int on = 1;
    setsockopt(file, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    const bool free = bind(file, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0;
    close(file);
    if (free) {
      return port;
    }
  }
  throw std::runtime_error("no free port");
}

class CellProcesses {
 public:
  // Starts a house, also again after it has ended; same port, same files. A module's truth is the shipped plant, or another file.
  ChildProcess& Start(const std::string& house, const std::string& plant = ShippedPlant()) {
    houses_[house] = std::make_unique<ChildProcess>(Options(house, plant));
    return *houses_[house];
  }
  // Starts them all and waits until each has announced itself.
  void StartAll(const std::vector<std::string>& houses) {
    for (const std::string& house : houses) {
      Start(house);
    }
    for (const std::string& house : houses) {
      ASSERT_TRUE(at(house).WaitUntilReady()) << house << ": " << at(house).err();
    }
  }
  static std::string ShippedPlant() { return SourceDir() + "/deploy/plants/shipped.yaml"; }
  ChildProcess& at(const std::string& house) { return *houses_.at(house); }
  void Kill(const std::string& house) {
    at(house).Signal(SIGKILL);
    at(house).WaitForExit();
  }
  std::string address(const std::string& house) { return "127.0.0.1:" + std::to_string(Port(house)); }
  std::string File(const std::string& name) const { return folder_.File(name); }
  int domain() const { return domain_.number(); }

  // The last words of every house, for a failing test.
  std::string Words() {
    std::string words;
    for (const auto& [house, child] : houses_) {
      const std::string all = child->err();
      words += "--- " + house + (child->running() ? "" : " (ended)") + "\n" +
               all.substr(all.size() > 3000 ? all.size() - 3000 : 0);
    }
    return words;
  }

 private:
  int Port(const std::string& house) {
    const auto found = ports_.find(house);
    if (found != ports_.end()) {
      return found->second;
    }
    next_port_ = 1 + FreePort(domain_.number(), next_port_);
    return ports_[house] = next_port_ - 1;
  }

  ChildOptions Options(const std::string& house, const std::string& plant) {
    ChildOptions options;
    options.program = house;
    options.announce_file = folder_.File(house + ".announce.json");
    options.arguments = {"--config=" + SourceDir() + "/deploy/config/loopback.yaml",
                         "--bus.domain=" + std::to_string(domain_.number()),
                         "--rpc.address=" + address(house)};
    const auto add = [&](const std::string& argument) { options.arguments.push_back(argument); };
    if (house == "calibration") {
      add("--machine=" + SourceDir() + "/deploy/config/machine.yaml");
      add("--store=" + folder_.File("calibration.sqlite"));
    } else if (house == "cell") {
      add("--store=" + folder_.File("cell.sqlite"));
      add("--trajectory.address=" + address("trajectory"));
    } else if (house == "drive" || house == "main_motion") {
      add("--plant=" + plant);
      add("--seed=7");
      // A virtual host may stand still for a tenth of a second; what the deadlines do is not what these tests are about.
      add("--watch.overruns_allowed=100");
      add(house == "drive" ? "--link.peer_deadline_s=0.5" : "--link.drive_deadline_s=0.5");
      if (house == "drive") {
        add("--control.setpoint_lead_s=0.2");
      }
    }
    return options;
  }

  TemporaryFolder folder_;
  PrivateDomain domain_;
  std::map<std::string, int> ports_;
  int next_port_ = 0;
  std::map<std::string, std::unique_ptr<ChildProcess>> houses_;
};

}  // namespace lambdajet::test
