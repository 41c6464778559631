// Reads the samples of one topic.
//
// Model: a RAII value over a DataReader with the listener on the reader itself. Each sample is handed to `on_sample` on
// a thread of the bus, one at a time, in the writer's order: put it in a LatestSample or a SampleQueue (sample_slots.hpp)
// and return. No call comes after the reader is destroyed.
// Threads: as above. Cost: one deserialisation into a sample that the reader keeps.
// Errors: as writer.hpp.
// Example:
//   LatestSample<State> drive_state;
//   auto reader = Reader<StatePubSubType>::Open(*bus, {STATE_TOPIC, k_lambdajet_drive_v1_state, "state"},
//                                               [&](const State& s, const Arrival& a) { drive_state.Put(s, a); });
#pragma once

#include <functional>
#include <memory>
#include <utility>

#include "platform/bus/endpoint.hpp"

namespace lambdajet {

template <typename PubSubType>
class Reader {
 public:
  using Sample = typename PubSubType::type;

  static absl::StatusOr<Reader> Open(Participant& participant, const TopicSpec& topic,
                                     std::function<void(const Sample&, const Arrival&)> on_sample,
                                     EndpointEvents events = {}) {
    auto core = ReaderCore::Open(
        participant, topic, new PubSubType(),
        [callback = std::move(on_sample)](const void* sample, const Arrival& arrival) {
          callback(*static_cast<const Sample*>(sample), arrival);
        },
        std::move(events));
    if (!core.ok()) {
      return core.status();
    }
    return Reader(std::move(*core));
  }

  int matched() const {
    return core_->matched();
  }  // writers now, those that have died but not yet expired included
  int alive() const { return core_->alive(); }  // writers whose liveliness lease holds

 private:
  explicit Reader(std::unique_ptr<ReaderCore> core) : core_(std::move(core)) {}
  std::unique_ptr<ReaderCore> core_;
};

}  // namespace lambdajet
