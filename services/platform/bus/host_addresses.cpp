#include "platform/bus/host_addresses.hpp"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <netdb.h>
#include <netinet/in.h>

#include "foundation/contract/trouble.hpp"

namespace lambdajet {
namespace {

std::string AddressText(const sockaddr* address) {
  char text[INET_ADDRSTRLEN] = "";
  inet_ntop(AF_INET, &reinterpret_cast<const sockaddr_in*>(address)->sin_addr, text, sizeof text);
  return text;
}

}  // namespace

bool IsLoopback(const std::string& address) { return address.starts_with("127."); }

absl::StatusOr<std::vector<std::string>> InterfaceAddresses(const std::vector<std::string>& interfaces) {
  ifaddrs* list = nullptr;
  if (getifaddrs(&list) != 0) {
    return Trouble(absl::StatusCode::kInternal, "NO_INTERFACES", "cannot list this host's interfaces");
  }
  std::vector<std::string> addresses;
  std::string missing;
  std::string known;
  for (const std::string& wanted : interfaces) {
    const std::size_t before = addresses.size();
    for (const ifaddrs* entry = list; entry != nullptr; entry = entry->ifa_next) {
      if (entry->ifa_addr == nullptr || entry->ifa_addr->sa_family != AF_INET) {
        continue;
      }
      const std::string address = AddressText(entry->ifa_addr);
      known += std::string(" ") + entry->ifa_name + "=" + address;
      if (wanted == address || wanted == entry->ifa_name) {
        addresses.push_back(address);
      }
    }
    if (addresses.size() == before) {
      missing = wanted;
      break;
    }
    known.clear();
  }
  freeifaddrs(list);
  if (!missing.empty()) {
    return Trouble(absl::StatusCode::kInvalidArgument, "BAD_INTERFACE",
                   "bus.interfaces: this host has no interface " + missing + "; it has" + known,
                   {{"interface", missing}});
  }
  return addresses;
}

absl::StatusOr<std::vector<std::string>> PeerAddresses(const std::vector<std::string>& peers) {
  std::vector<std::string> addresses;
  for (const std::string& peer : peers) {
    addrinfo hints{};
    hints.ai_family = AF_INET;
    hints.ai_socktype = SOCK_DGRAM;
    addrinfo* found = nullptr;
    const int error = getaddrinfo(peer.c_str(), nullptr, &hints, &found);
    if (error != 0) {
      return Trouble(absl::StatusCode::kInvalidArgument, "BAD_PEER",
                     "bus.initial_peers: no address for " + peer + ": " + gai_strerror(error),
                     {{"peer", peer}});
    }
    addresses.push_back(AddressText(found->ai_addr));
    freeaddrinfo(found);
  }
  return addresses;
}

}  // namespace lambdajet
