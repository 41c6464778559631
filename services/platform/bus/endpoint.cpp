#include "platform/bus/endpoint.hpp"

#include <algorithm>
#include <cstring>
#include <fastdds/dds/core/LoanableSequence.hpp>
#include <fastdds/dds/core/policy/QosPolicies.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/DataWriterListener.hpp>
#include <fastdds/dds/publisher/qos/DataWriterQos.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/qos/DataReaderQos.hpp>

#include "foundation/contract/trouble.hpp"
#include "platform/bus/participant_inside.hpp"
#include "platform/process/common_clock.hpp"

namespace lambdajet {

namespace dds = eprosima::fastdds::dds;
using eprosima::fastrtps::Duration_t;
using eprosima::fastrtps::types::ReturnCode_t;

namespace {

constexpr double kLeastDeadlineS = 0.005;  // below it Fast DDS 2.9.1 spins

std::string WireName(const TopicSpec& topic) { return topic.name + "/" + topic.schema_hash; }

Duration_t ToDuration(double seconds) {
  const auto whole = static_cast<std::int32_t>(seconds);
  return {whole, static_cast<std::uint32_t>((seconds - whole) * 1e9)};
}

const char* PolicyName(dds::QosPolicyId_t id) {
  switch (id) {
    case dds::DURABILITY_QOS_POLICY_ID:
      return "durability";
    case dds::DEADLINE_QOS_POLICY_ID:
      return "deadline";
    case dds::OWNERSHIP_QOS_POLICY_ID:
      return "ownership";
    case dds::LIVELINESS_QOS_POLICY_ID:
      return "liveliness";
    case dds::RELIABILITY_QOS_POLICY_ID:
      return "reliability";
    default:
      return "another policy";
  }
}

absl::Status NoSuchProfile(const TopicSpec& topic) {
  return Trouble(absl::StatusCode::kInvalidArgument, "NO_SUCH_PROFILE",
                 "topic " + topic.name + ": the profile file has no profile '" + topic.profile +
                     "'; it has state, setpoint, command, description and event",
                 {{"topic", topic.name}, {"profile", topic.profile}});
}

absl::Status TypeConflict(const TopicSpec& topic) {
  return Trouble(absl::StatusCode::kInvalidArgument, "TOPIC_TYPE_CONFLICT",
                 "topic " + topic.name + " is used in this process with another type",
                 {{"topic", topic.name}});
}

absl::Status NoEndpoint(const TopicSpec& topic) {
  return Trouble(absl::StatusCode::kInternal, "NO_ENDPOINT",
                 "topic " + topic.name + ": the QoS of profile '" + topic.profile + "' is not accepted",
                 {{"topic", topic.name}, {"profile", topic.profile}});
}

void TellIncompatible(Participant::Inside& bus, const TopicSpec& topic, const EndpointEvents& events,
                      dds::QosPolicyId_t policy) {
  if (bus.log != nullptr) {
    bus.log->Warning("qos_incompatible",
                     "another process uses this topic with other QoS, so no sample passes",
                     {{"topic", topic.name}, {"policy", PolicyName(policy)}});
  }
  if (events.incompatible) {
    events.incompatible(PolicyName(policy));
  }
}

}  // namespace

class WriterCore::Inside : public dds::DataWriterListener {
 public:
  Inside(Participant::Inside& bus, const TopicSpec& topic, EndpointEvents events)
      : bus_(bus), spec_(topic), events_(std::move(events)) {
    if (bus.metrics != nullptr) {
      written_ = bus.metrics->AddCounter("lambdajet_bus_samples_written_total", "Samples handed to the bus.",
                                         {{"topic", topic.name}});
      refused_ = bus.metrics->AddCounter("lambdajet_bus_writes_refused_total",
                                         "Samples the bus did not take.", {{"topic", topic.name}});
    }
  }
  ~Inside() override {
    if (writer_ != nullptr) {
      writer_->set_listener(nullptr);
      bus_.publisher->delete_datawriter(writer_);
    }
    if (topic_ != nullptr) {
      bus_.ReleaseTopic(topic_);
    }
  }

  absl::Status Start(dds::TypeSupport type) {
    dds::DataWriterQos qos;
    if (bus_.publisher->get_datawriter_qos_from_profile(spec_.profile, qos) != ReturnCode_t::RETCODE_OK) {
      return NoSuchProfile(spec_);
    }
    if (spec_.deadline_s) {
      qos.deadline().period = ToDuration(std::max(*spec_.deadline_s, kLeastDeadlineS));
    }
    topic_ = bus_.AcquireTopic(WireName(spec_), type);
    if (topic_ == nullptr) {
      return TypeConflict(spec_);
    }
    writer_ = bus_.publisher->create_datawriter(topic_, qos, this);
    return writer_ != nullptr ? absl::OkStatus() : NoEndpoint(spec_);
  }

  bool Write(const void* sample) {
    const bool taken =
        writer_->write(const_cast<void*>(sample));  // 2.9.1 takes a plain pointer and only reads
    (taken ? written_ : refused_).Increment();
    return taken;
  }

  void on_publication_matched(dds::DataWriter*, const dds::PublicationMatchedStatus& status) override {
    matched_.store(status.current_count);
    if (events_.matched) {
      events_.matched(status.current_count);
    }
  }
  void on_offered_incompatible_qos(dds::DataWriter*,
                                   const dds::OfferedIncompatibleQosStatus& status) override {
    TellIncompatible(bus_, spec_, events_, status.last_policy_id);
  }

  int matched() const { return matched_.load(); }
  bool WaitForAcknowledgments(double most_s) {
    return writer_->wait_for_acknowledgments(ToDuration(most_s)) == ReturnCode_t::RETCODE_OK;
  }

 private:
  Participant::Inside& bus_;
  const TopicSpec spec_;
  const EndpointEvents events_;
  Counter written_;
  Counter refused_;
  dds::Topic* topic_ = nullptr;
  dds::DataWriter* writer_ = nullptr;
  std::atomic<int> matched_ = 0;
};

WriterCore::WriterCore() = default;
WriterCore::~WriterCore() = default;

absl::StatusOr<std::unique_ptr<WriterCore>> WriterCore::Open(Participant& participant, const TopicSpec& topic,
                                                             dds::TopicDataType* type,
                                                             EndpointEvents events) {
  const dds::TypeSupport support(type);
  std::unique_ptr<WriterCore> core(new WriterCore);
  core->inside_ = std::make_unique<Inside>(participant.inside(), topic, std::move(events));
  if (absl::Status status = core->inside_->Start(support); !status.ok()) {
    return status;
  }
  return core;
}

bool WriterCore::Write(const void* sample) { return inside_->Write(sample); }
int WriterCore::matched() const { return inside_->matched(); }
bool WriterCore::WaitForAcknowledgments(double most_s) { return inside_->WaitForAcknowledgments(most_s); }

class ReaderCore::Inside : public dds::DataReaderListener {
 public:
  Inside(Participant::Inside& bus, const TopicSpec& topic, OnSample on_sample, EndpointEvents events)
      : bus_(bus), spec_(topic), on_sample_(std::move(on_sample)), events_(std::move(events)) {
    if (bus.metrics != nullptr) {
      const MetricLabels labels{{"topic", topic.name}};
      read_ = bus.metrics->AddCounter("lambdajet_bus_samples_read_total", "Samples that arrived.", labels);
      lost_ =
          bus.metrics->AddCounter("lambdajet_bus_samples_lost_total", "Samples known to be missing.", labels);
      missed_ = bus.metrics->AddCounter("lambdajet_bus_deadlines_missed_total", "Deadlines no sample kept.",
                                        labels);
    }
  }
  ~Inside() override {
    if (reader_ != nullptr) {
      reader_->set_listener(nullptr);
      bus_.subscriber->delete_datareader(reader_);
    }
    if (topic_ != nullptr) {
      bus_.ReleaseTopic(topic_);
    }
    if (sample_ != nullptr) {
      type_->deleteData(sample_);
    }
  }

  absl::Status Start(const dds::TypeSupport& type) {
    dds::DataReaderQos qos;
    if (bus_.subscriber->get_datareader_qos_from_profile(spec_.profile, qos) != ReturnCode_t::RETCODE_OK) {
      return NoSuchProfile(spec_);
    }
    if (spec_.deadline_s) {
      qos.deadline().period = ToDuration(std::max(*spec_.deadline_s, kLeastDeadlineS));
    }
    type_ = type;
    sample_ = type_->createData();
    topic_ = bus_.AcquireTopic(WireName(spec_), type);
    if (topic_ == nullptr) {
      return TypeConflict(spec_);
    }
    reader_ = bus_.subscriber->create_datareader(topic_, qos, this);
    return reader_ != nullptr ? absl::OkStatus() : NoEndpoint(spec_);
  }

  void on_data_available(dds::DataReader* reader) override {
    const std::lock_guard lock(take_mutex_);  // two threads of the bus may find data at once
    dds::SampleInfo about;
    while (reader->take_next_sample(sample_, &about) == ReturnCode_t::RETCODE_OK) {
      if (!about.valid_data) {
        continue;
      }
      read_.Increment();
      Arrival arrival;
      arrival.monotonic_ns = MonotonicNow();
      std::memcpy(&arrival.writer, &about.publication_handle.value[8], sizeof arrival.writer);
      std::uint64_t host_half = 0;
      std::memcpy(&host_half, &about.publication_handle.value[0], sizeof host_half);
      arrival.writer ^= host_half * 0x9E3779B97F4A7C15u;
      on_sample_(sample_, arrival);
    }
  }
  void on_subscription_matched(dds::DataReader*, const dds::SubscriptionMatchedStatus& status) override {
    matched_.store(status.current_count);
    if (events_.matched) {
      events_.matched(status.current_count);
    }
  }
  void on_requested_deadline_missed(dds::DataReader*,
                                    const eprosima::fastrtps::RequestedDeadlineMissedStatus&) override {
    missed_.Increment();
    if (events_.deadline_missed) {
      events_.deadline_missed();
    }
  }
  void on_liveliness_changed(dds::DataReader*,
                             const eprosima::fastrtps::LivelinessChangedStatus& status) override {
    alive_.store(status.alive_count);
    if (events_.liveliness_changed) {
      events_.liveliness_changed(status.alive_count);
    }
  }
  void on_requested_incompatible_qos(dds::DataReader*,
                                     const dds::RequestedIncompatibleQosStatus& status) override {
    TellIncompatible(bus_, spec_, events_, status.last_policy_id);
  }
  void on_sample_lost(dds::DataReader*, const dds::SampleLostStatus& status) override {
    lost_.Increment(status.total_count_change);
  }

  int matched() const { return matched_.load(); }
  int alive() const { return alive_.load(); }

 private:
  Participant::Inside& bus_;
  const TopicSpec spec_;
  const OnSample on_sample_;
  const EndpointEvents events_;
  Counter read_;
  Counter lost_;
  Counter missed_;
  dds::TypeSupport type_;
  void* sample_ = nullptr;
  std::mutex take_mutex_;
  dds::Topic* topic_ = nullptr;
  dds::DataReader* reader_ = nullptr;
  std::atomic<int> matched_ = 0;
  std::atomic<int> alive_ = 0;
};

ReaderCore::ReaderCore() = default;
ReaderCore::~ReaderCore() = default;

absl::StatusOr<std::unique_ptr<ReaderCore>> ReaderCore::Open(Participant& participant, const TopicSpec& topic,
                                                             dds::TopicDataType* type, OnSample on_sample,
                                                             EndpointEvents events) {
  const dds::TypeSupport support(type);
  std::unique_ptr<ReaderCore> core(new ReaderCore);
  core->inside_ =
      std::make_unique<Inside>(participant.inside(), topic, std::move(on_sample), std::move(events));
  if (absl::Status status = core->inside_->Start(support); !status.ok()) {
    return status;
  }
  return core;
}

int ReaderCore::matched() const { return inside_->matched(); }
int ReaderCore::alive() const { return inside_->alive(); }

}  // namespace lambdajet
