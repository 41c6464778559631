// Says how a house takes part in the bus: domain, partition, interfaces, peers, key and profiles.
//
// Units: in the names. Threads: a value.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace lambdajet {

// What a test does to the datagrams that arrive; all zero is off.
struct LinkFaults {
  double drop_ratio = 0.0;
  double duplicate_ratio = 0.0;
  double delay_ratio = 0.0;
  double delay_s = 0.0;
  std::uint64_t seed = 1;

  bool any() const { return drop_ratio > 0.0 || duplicate_ratio > 0.0 || delay_ratio > 0.0; }
};

struct BusOptions {
  std::string house;      // name of the participant
  std::string partition;  // machine id
  int domain = 42;
  std::vector<std::string> interfaces = {"127.0.0.1"};  // addresses or names (eth0) to use; empty: all
  std::vector<std::string> initial_peers;  // hosts or addresses; empty: multicast, or this host if loopback
  std::string key_file;                    // empty: no guard
  bool allow_unguarded = false;            // beyond loopback without a key
  std::string profile_file = "deploy/dds/profiles.xml";
  int peers_per_host = 16;  // processes looked for on each initial peer
  LinkFaults faults;
};

}  // namespace lambdajet
