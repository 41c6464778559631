// Joins a process to the bus of its machine.
//
// Model: one DomainParticipant a process in a DDS domain, with the machine id as partition; UDP only, data sharing off,
// behind the guard (guard_transport.hpp). Discovery by multicast, or by initial peers where those are named or only
// loopback is used. A peer that is gone is forgotten after 3 s. QoS stands in the profile file.
// Threads: Open() once at start; the rest from any. Writers and readers must be gone before their participant.
// Errors: FAILED_PRECONDITION NO_KEY beyond loopback without a key, those of ReadGuardKeys, NOT_FOUND NO_PROFILE_FILE,
// INVALID_ARGUMENT BAD_INTERFACE or BAD_PEER, UNAVAILABLE NO_PARTICIPANT.
#pragma once

#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "platform/bus/bus_options.hpp"

namespace lambdajet {

class Log;
class Metrics;

class Participant {
 public:
  // `log` and `metrics` may be null; otherwise they outlive the participant.
  static absl::StatusOr<std::unique_ptr<Participant>> Open(const BusOptions& options, Log* log,
                                                           Metrics* metrics);
  ~Participant();
  Participant(const Participant&) = delete;
  Participant& operator=(const Participant&) = delete;

  bool guarded() const;
  int peers() const;  // participants seen now, this one not counted

  // Datagrams that the guard refused, by verdict name; 0 without a guard.
  std::uint64_t refused_datagrams() const;
  // Brings the guard's counts to the metrics; the house calls it about once a second.
  void UpdateMetrics();

  // For tests: loses, doubles and delays arriving datagrams from now on.
  void SetFaults(const LinkFaults& faults);

  class Inside;  // for the endpoints
  Inside& inside() { return *inside_; }

 private:
  Participant();
  std::unique_ptr<Inside> inside_;
};

}  // namespace lambdajet
