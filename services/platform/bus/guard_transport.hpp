// Stands between UDP and the RTPS parser: seals what goes out, lets in only what DatagramGuard accepts.
//
// Model: a ChainingTransport over UDPv4. One malformed datagram aborts a Fast DDS 2.9.1 process, so nothing reaches the
// parser unchecked. Without keys it passes everything. It is also where tests lose, double and delay datagrams
// (LinkFaults): that happens to what arrives, behind the check.
// Threads: as Fast DDS calls it.
#pragma once

#include <fastdds/rtps/transport/ChainingTransport.h>

#include <atomic>
#include <memory>

#include "platform/bus/bus_options.hpp"
#include "platform/bus/datagram_guard.hpp"

namespace lambdajet {

// What a participant and its transport share: the guard (null: none) and the faults in force.
class GuardState {
 public:
  GuardState(std::unique_ptr<DatagramGuard> guard, const LinkFaults& faults);
  ~GuardState();

  DatagramGuard* guard() const { return guard_.get(); }
  void SetFaults(const LinkFaults& faults);

  // How many times an arriving datagram is to be passed on now (0, 1 or 2), and whether late.
  struct Fate {
    int copies = 1;
    double delay_s = 0.0;
  };
  Fate Draw();

 private:
  class Dice;
  std::unique_ptr<DatagramGuard> guard_;
  std::atomic<bool> faulty_ = false;
  std::unique_ptr<Dice> dice_;
};

std::shared_ptr<eprosima::fastdds::rtps::TransportDescriptorInterface> MakeGuardedTransport(
    std::shared_ptr<eprosima::fastdds::rtps::TransportDescriptorInterface> low_level,
    std::shared_ptr<GuardState> state);

}  // namespace lambdajet
