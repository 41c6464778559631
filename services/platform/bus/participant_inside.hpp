// What a participant shares with its endpoints. Private to platform/bus: no house includes it.
#pragma once

#include <array>
#include <atomic>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantListener.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "platform/bus/guard_transport.hpp"
#include "platform/bus/participant.hpp"
#include "platform/telemetry/log.hpp"
#include "platform/telemetry/metrics.hpp"

namespace lambdajet {

class Participant::Inside : public eprosima::fastdds::dds::DomainParticipantListener {
 public:
  ~Inside() override;

  absl::Status Start(const BusOptions& options);

  // Topics are shared by the endpoints of one name and counted; null if the name stands for another type.
  eprosima::fastdds::dds::Topic* AcquireTopic(const std::string& name,
                                              eprosima::fastdds::dds::TypeSupport type);
  void ReleaseTopic(eprosima::fastdds::dds::Topic* topic);

  void on_participant_discovery(eprosima::fastdds::dds::DomainParticipant* participant,
                                eprosima::fastrtps::rtps::ParticipantDiscoveryInfo&& info) override;

  BusOptions options;
  Log* log = nullptr;
  Metrics* metrics = nullptr;
  std::shared_ptr<GuardState> guard;
  eprosima::fastdds::dds::DomainParticipant* participant = nullptr;
  eprosima::fastdds::dds::Publisher* publisher = nullptr;
  eprosima::fastdds::dds::Subscriber* subscriber = nullptr;
  std::atomic<int> peers = 0;
  Gauge peers_gauge;
  std::array<Counter, static_cast<std::size_t>(GuardVerdict::kCount)> guard_counters;
  std::array<std::uint64_t, static_cast<std::size_t>(GuardVerdict::kCount)> guard_reported{};

 private:
  absl::Status LoadProfiles();
  absl::Status AddTransport(eprosima::fastdds::dds::DomainParticipantQos& qos,
                            const std::vector<std::string>& own);
  absl::Status AddPeers(eprosima::fastdds::dds::DomainParticipantQos& qos, bool loopback);

  std::mutex topics_mutex_;
  std::map<std::string, int> topic_users_;
};

}  // namespace lambdajet
