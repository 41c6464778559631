// Measures the clock offset and the round trip between the two modules by a four-stamp exchange over the link.
//
// Model: a ping carries the time it was sent; the peer's pong adds when it was received and answered; the fourth stamp is
// taken on arrival. Offset = ((t2 - t1) + (t3 - t4))/2, peer minus own; round trip = (t4 - t1) - (t3 - t2). Queues only
// ever lengthen a trip, so of the last 32 exchanges the one with the shortest trip is believed. A measurement older than
// 5 s is none. Units: s. Threads: samples come on the bus' threads; Ping() and figures() from any. Errors: those of
// platform/bus.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>

#include "absl/status/statusor.h"
#include "foundation/motion/link_samples.hpp"

namespace lambdajet {
class Clock;
class Participant;
}  // namespace lambdajet

namespace lambdajet::link {

// The filter alone, for tests.
class OffsetFilter {
 public:
  void Add(std::int64_t sent_ns, std::int64_t received_ns, std::int64_t answered_ns, std::int64_t arrived_ns);
  // Offset and round trip of the shortest recent exchange; round trip 0 if there is none.
  LinkFigures Best(std::int64_t now_ns) const;

 private:
  static constexpr std::size_t kExchanges = 32;
  struct Exchange {
    std::int64_t arrived_ns = 0;
    double offset_s = 0.0;
    double round_trip_s = 0.0;
  };
  std::array<Exchange, kExchanges> exchanges_{};
  std::size_t count_ = 0;
};

class ClockExchange {
 public:
  // `sender`: 1 drive, 2 main motion. The clock outlives the exchange.
  static absl::StatusOr<std::unique_ptr<ClockExchange>> Open(Participant& bus, const Clock& clock,
                                                             std::uint32_t sender, std::uint64_t session);
  ~ClockExchange();

  void Ping();                  // about ten times a second
  LinkFigures figures() const;  // never waits for the bus

 private:
  class Inside;
  ClockExchange();
  std::unique_ptr<Inside> inside_;
};

}  // namespace lambdajet::link
