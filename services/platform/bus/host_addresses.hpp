// Turns the names of interfaces and hosts into IPv4 addresses.
//
// Errors: INVALID_ARGUMENT BAD_INTERFACE for an interface this host has not, BAD_PEER for a host that has no address.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"

namespace lambdajet {

bool IsLoopback(const std::string& address);  // 127.0.0.0/8

// Each entry an address of this host or an interface's name; addresses come back.
absl::StatusOr<std::vector<std::string>> InterfaceAddresses(const std::vector<std::string>& interfaces);

// Each entry an address or a host's name.
absl::StatusOr<std::vector<std::string>> PeerAddresses(const std::vector<std::string>& peers);

}  // namespace lambdajet
