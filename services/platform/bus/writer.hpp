// Writes the samples of one topic.
//
// Model: a RAII value over a DataWriter. PubSubType is what fastddsgen generates beside the type, e.g. StatePubSubType.
// Write() never waits: it is false when the sample could not be taken (the bounded history of a `setpoint` topic is full
// of samples that a reader has not acknowledged; try the same sample again later), and lambdajet_bus_writes_refused_total
// counts it.
// Threads: Write() from any. Cost: a few microseconds; a `state` sample is sent from the caller's thread.
// Errors: INVALID_ARGUMENT NO_SUCH_PROFILE or TOPIC_TYPE_CONFLICT, INTERNAL NO_ENDPOINT.
// Example:
//   auto writer = Writer<StatePubSubType>::Open(*bus, {STATE_TOPIC, idl::schema::k_lambdajet_drive_v1_state, "state"});
#pragma once

#include <memory>
#include <utility>

#include "platform/bus/endpoint.hpp"

namespace lambdajet {

template <typename PubSubType>
class Writer {
 public:
  using Sample = typename PubSubType::type;

  static absl::StatusOr<Writer> Open(Participant& participant, const TopicSpec& topic,
                                     EndpointEvents events = {}) {
    auto core = WriterCore::Open(participant, topic, new PubSubType(), std::move(events));
    if (!core.ok()) {
      return core.status();
    }
    return Writer(std::move(*core));
  }

  bool Write(const Sample& sample) { return core_->Write(&sample); }
  int matched() const { return core_->matched(); }  // readers now

  // True when every matched reader has all that was written (reliable topics).
  bool WaitForAcknowledgments(double most_s) { return core_->WaitForAcknowledgments(most_s); }

 private:
  explicit Writer(std::unique_ptr<WriterCore> core) : core_(std::move(core)) {}
  std::unique_ptr<WriterCore> core_;
};

}  // namespace lambdajet
