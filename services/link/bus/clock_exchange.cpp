#include "link/bus/clock_exchange.hpp"

#include <algorithm>
#include <atomic>
#include <mutex>
#include <optional>
#include <string>

#include "lambdajet/link/v1/header.h"
#include "lambdajet/link/v1/header.schema.hpp"
#include "lambdajet/link/v1/headerPubSubTypes.h"
#include "link/wire/link_wire.hpp"
#include "platform/bus/reader.hpp"
#include "platform/bus/writer.hpp"
#include "platform/process/common_clock.hpp"

namespace lambdajet::link {
namespace {

namespace wire = lambdajet::idl::link::v1;
constexpr std::int64_t kOldest_ns = 5'000'000'000;

}  // namespace

void OffsetFilter::Add(std::int64_t sent_ns, std::int64_t received_ns, std::int64_t answered_ns,
                       std::int64_t arrived_ns) {
  const std::int64_t trip_ns = (arrived_ns - sent_ns) - (answered_ns - received_ns);
  if (trip_ns <= 0) {
    return;  // stamps that cannot be: a clock stepped in between
  }
  const std::int64_t twice_ns = (received_ns - sent_ns) + (answered_ns - arrived_ns);
  exchanges_[count_++ % kExchanges] = {arrived_ns, 0.5e-9 * static_cast<double>(twice_ns),
                                       1e-9 * static_cast<double>(trip_ns)};
}

LinkFigures OffsetFilter::Best(std::int64_t now_ns) const {
  LinkFigures best;
  for (std::size_t i = 0; i < std::min(count_, kExchanges); ++i) {
    const Exchange& exchange = exchanges_[i];
    if (now_ns - exchange.arrived_ns <= kOldest_ns &&
        (best.round_trip_s == 0.0 || exchange.round_trip_s < best.round_trip_s)) {
      best.round_trip_s = exchange.round_trip_s;
      best.clock_offset_s = exchange.offset_s;
    }
  }
  return best;
}

class ClockExchange::Inside {
 public:
  Inside(const Clock& clock, std::uint32_t sender, std::uint64_t session)
      : clock_(clock), sender_(sender), session_(session) {}

  absl::Status Open(Participant& bus) {
    auto ping_writer = Writer<wire::PingPubSubType>::Open(bus, Topic(wire::PING_TOPIC));
    if (!ping_writer.ok()) {
      return ping_writer.status();
    }
    ping_writer_.emplace(std::move(*ping_writer));
    auto pong_writer = Writer<wire::PongPubSubType>::Open(bus, Topic(wire::PONG_TOPIC));
    if (!pong_writer.ok()) {
      return pong_writer.status();
    }
    pong_writer_.emplace(std::move(*pong_writer));
    auto pings = Reader<wire::PingPubSubType>::Open(
        bus, Topic(wire::PING_TOPIC), [this](const wire::Ping& ping, const Arrival&) { Answer(ping); });
    if (!pings.ok()) {
      return pings.status();
    }
    pings_.emplace(std::move(*pings));
    auto pongs = Reader<wire::PongPubSubType>::Open(
        bus, Topic(wire::PONG_TOPIC), [this](const wire::Pong& pong, const Arrival&) { Take(pong); });
    if (!pongs.ok()) {
      return pongs.status();
    }
    pongs_.emplace(std::move(*pongs));
    return absl::OkStatus();
  }

  void Ping() {
    wire::Ping ping;
    const std::int64_t now_ns = clock_.now_ns();
    ToWire({session_, ++pinged_, now_ns}, ping.header());
    ping.sender(sender_);
    ping.sent_ns(now_ns);
    ping_writer_->Write(ping);
    const std::lock_guard lock(mutex_);
    const LinkFigures best = filter_.Best(now_ns);
    offset_s_.store(best.clock_offset_s, std::memory_order_relaxed);
    round_trip_s_.store(best.round_trip_s, std::memory_order_relaxed);
    bound_s_.store(1e-9 * static_cast<double>(ReadKernelClockError().bound_ns), std::memory_order_relaxed);
  }

  LinkFigures figures() const {
    return {bound_s_.load(std::memory_order_relaxed), offset_s_.load(std::memory_order_relaxed),
            round_trip_s_.load(std::memory_order_relaxed)};
  }

 private:
  static TopicSpec Topic(const std::string& name) {
    return {name, idl::schema::k_lambdajet_link_v1_header, "state"};
  }

  void Answer(const wire::Ping& ping) {
    if (ping.sender() == sender_) {
      return;
    }
    wire::Pong pong;
    const std::int64_t now_ns = clock_.now_ns();
    ToWire({session_, ++ponged_, now_ns}, pong.header());
    pong.sender(sender_);
    pong.ping_session(ping.header().session());
    pong.ping_sequence_number(ping.header().sequence_number());
    pong.sent_ns(ping.sent_ns());
    pong.received_ns(now_ns);
    pong.answered_ns(clock_.now_ns());
    pong_writer_->Write(pong);
  }

  void Take(const wire::Pong& pong) {
    const std::int64_t now_ns = clock_.now_ns();
    if (pong.ping_session() == session_) {
      const std::lock_guard lock(mutex_);
      filter_.Add(pong.sent_ns(), pong.received_ns(), pong.answered_ns(), now_ns);
    }
  }

  const Clock& clock_;
  std::uint32_t sender_;
  std::uint64_t session_;
  std::uint64_t pinged_ = 0;
  std::uint64_t ponged_ = 0;
  std::mutex mutex_;
  OffsetFilter filter_;
  std::atomic<double> offset_s_ = 0.0;
  std::atomic<double> round_trip_s_ = 0.0;
  std::atomic<double> bound_s_ = 0.0;
  std::optional<Writer<wire::PingPubSubType>> ping_writer_;
  std::optional<Writer<wire::PongPubSubType>> pong_writer_;
  std::optional<Reader<wire::PingPubSubType>> pings_;  // last: they end before what they write to
  std::optional<Reader<wire::PongPubSubType>> pongs_;
};

ClockExchange::ClockExchange() = default;
ClockExchange::~ClockExchange() = default;

absl::StatusOr<std::unique_ptr<ClockExchange>> ClockExchange::Open(Participant& bus, const Clock& clock,
                                                                   std::uint32_t sender,
                                                                   std::uint64_t session) {
  std::unique_ptr<ClockExchange> exchange(new ClockExchange());
  exchange->inside_ = std::make_unique<Inside>(clock, sender, session);
  if (absl::Status status = exchange->inside_->Open(bus); !status.ok()) {
    return status;
  }
  return exchange;
}

void ClockExchange::Ping() { inside_->Ping(); }
LinkFigures ClockExchange::figures() const { return inside_->figures(); }

}  // namespace lambdajet::link
