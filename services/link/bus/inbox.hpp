// Takes the samples of one topic from the bus, refuses unsound ones, and hands the rest to a cyclic loop.
//
// Model: the reader's thread translates (FromWire) into a bounded queue; the loop drains it into a buffer of its own once
// a cycle, without waiting and without allocating. What does not fit is dropped and counted: the link's own sequence
// numbers and watchdogs say what that means. Threads: Drain() from the loop; the counters from any.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "link/wire/link_wire.hpp"
#include "platform/bus/reader.hpp"
#include "platform/bus/sample_slots.hpp"

namespace lambdajet::link {

template <typename Sample, typename PubSubType>
class Inbox {
 public:
  static absl::StatusOr<std::unique_ptr<Inbox>> Open(Participant& bus, const TopicSpec& topic,
                                                     std::size_t capacity) {
    std::unique_ptr<Inbox> inbox(new Inbox(capacity));
    Inbox* self = inbox.get();
    auto reader = Reader<PubSubType>::Open(
        bus, topic, [self](const typename PubSubType::type& wire, const Arrival& arrival) {
          if (FromWire(wire, self->translated_)) {
            self->queue_.Put(self->translated_, arrival);
          } else {
            self->refused_.fetch_add(1, std::memory_order_relaxed);
          }
        });
    if (!reader.ok()) {
      return reader.status();
    }
    inbox->reader_.emplace(std::move(*reader));
    return inbox;
  }

  std::span<const Sample> Drain() {
    std::size_t count = 0;
    while (count < drained_.size() && queue_.TryTake(drained_[count])) {
      ++count;
    }
    return std::span<const Sample>(drained_.data(), count);
  }

  std::uint64_t refused() const { return refused_.load(std::memory_order_relaxed) + queue_.dropped(); }
  int matched() const { return reader_->matched(); }

 private:
  explicit Inbox(std::size_t capacity) : queue_(capacity), drained_(capacity) {}

  SampleQueue<Sample> queue_;
  std::vector<Sample> drained_;
  Sample translated_;  // the reader's thread only
  std::atomic<std::uint64_t> refused_ = 0;
  std::optional<Reader<PubSubType>> reader_;  // last: no sample comes after it is gone
};

}  // namespace lambdajet::link
