// The parts of a writer and a reader that do not depend on the sample's type; houses use writer.hpp and reader.hpp.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "platform/bus/participant.hpp"

namespace eprosima::fastdds::dds {
class TopicDataType;
}

namespace lambdajet {

// Which topic, and how. The name on the wire is `name` + "/" + `schema_hash`, so two builds that mean different things
// by one name never match.
struct TopicSpec {
  std::string name;         // logical, as "drive/state"; a constant of the IDL
  std::string schema_hash;  // lambdajet::idl::schema::k_…, from the IDL's .schema.hpp
  std::string profile;      // state, setpoint, command, description or event (deploy/dds/profiles.xml)
  // Longest time between two samples, from the house's settings: the writer promises it, the reader is told when it is
  // not kept. At least 5 ms; a reader matches only writers that promise at least as much.
  std::optional<double> deadline_s = std::nullopt;
};

// What a house may want to be told, on a thread of the bus: hand over and return. Each may be empty.
struct EndpointEvents {
  std::function<void(int matched)> matched = {};                     // other ends matched now
  std::function<void()> deadline_missed = {};                        // reader: no sample for deadline_s
  std::function<void(int alive)> liveliness_changed = {};            // reader: writers alive now
  std::function<void(const std::string& policy)> incompatible = {};  // another end offers or asks other QoS
};

// What a reader knows of a sample beside its content.
struct Arrival {
  std::int64_t monotonic_ns = 0;  // CLOCK_MONOTONIC when the reader handed it over
  std::uint64_t writer = 0;       // tells writers apart
};

class WriterCore {
 public:
  // Takes the type over.
  static absl::StatusOr<std::unique_ptr<WriterCore>> Open(Participant& participant, const TopicSpec& topic,
                                                          eprosima::fastdds::dds::TopicDataType* type,
                                                          EndpointEvents events);
  ~WriterCore();
  bool Write(const void* sample);
  int matched() const;
  bool WaitForAcknowledgments(double most_s);

 private:
  class Inside;
  WriterCore();
  std::unique_ptr<Inside> inside_;
};

class ReaderCore {
 public:
  using OnSample = std::function<void(const void* sample, const Arrival& arrival)>;
  static absl::StatusOr<std::unique_ptr<ReaderCore>> Open(Participant& participant, const TopicSpec& topic,
                                                          eprosima::fastdds::dds::TopicDataType* type,
                                                          OnSample on_sample, EndpointEvents events);
  ~ReaderCore();
  int matched() const;
  int alive() const;

 private:
  class Inside;
  ReaderCore();
  std::unique_ptr<Inside> inside_;
};

}  // namespace lambdajet
