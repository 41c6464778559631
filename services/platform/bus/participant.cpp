#include "platform/bus/participant.hpp"

#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastrtps/utils/IPLocator.h>
#include <unistd.h>

#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/log/Log.hpp>
#include <fastdds/dds/publisher/qos/PublisherQos.hpp>
#include <fastdds/dds/subscriber/qos/SubscriberQos.hpp>

#include "foundation/contract/trouble.hpp"
#include "platform/bus/guard_key.hpp"
#include "platform/bus/host_addresses.hpp"
#include "platform/bus/participant_inside.hpp"

namespace lambdajet {

namespace dds = eprosima::fastdds::dds;
namespace rtps = eprosima::fastdds::rtps;
using eprosima::fastrtps::rtps::IPLocator;
using eprosima::fastrtps::rtps::Locator_t;
using eprosima::fastrtps::types::ReturnCode_t;

namespace {

constexpr char kParticipantProfile[] = "lambdajet";
constexpr std::uint32_t kSocketBufferBytes = 1 << 20;
constexpr std::uint32_t kMessageBytes = 65500;

bool OnlyLoopback(const std::vector<std::string>& addresses) {
  for (const std::string& address : addresses) {
    if (!IsLoopback(address)) {
      return false;
    }
  }
  return !addresses.empty();
}

absl::StatusOr<std::unique_ptr<DatagramGuard>> MakeGuard(const BusOptions& options, bool loopback, Log* log) {
  if (!options.key_file.empty()) {
    auto keys = ReadGuardKeys(options.key_file);
    if (!keys.ok()) {
      return keys.status();
    }
    return std::make_unique<DatagramGuard>(std::move(*keys));
  }
  if (!loopback && !options.allow_unguarded) {
    return Trouble(absl::StatusCode::kFailedPrecondition, "NO_KEY",
                   "the bus leaves this host but bus.key_file is empty: name a key file, or say "
                   "bus.allow_unguarded: true where anyone on the network may stop the machine");
  }
  if (log != nullptr) {
    log->Warning(
        "bus_unguarded",
        "THE BUS IS NOT GUARDED: any process that can send a datagram here can stop or steer this machine; "
        "name a key file in bus.key_file",
        {{"loopback_only", loopback}});
  }
  return std::unique_ptr<DatagramGuard>();
}

}  // namespace

Participant::Inside::~Inside() {
  if (participant == nullptr) {
    return;
  }
  participant->set_listener(nullptr);
  participant->delete_contained_entities();
  dds::DomainParticipantFactory::get_instance()->delete_participant(participant);
}

absl::Status Participant::Inside::LoadProfiles() {
  auto* factory = dds::DomainParticipantFactory::get_instance();
  dds::DomainParticipantQos qos;
  // Profiles are the library's, for the whole process: a second participant finds them loaded.
  if (factory->get_participant_qos_from_profile(kParticipantProfile, qos) == ReturnCode_t::RETCODE_OK) {
    return absl::OkStatus();
  }
  if (access(options.profile_file.c_str(), R_OK) != 0) {
    return Trouble(absl::StatusCode::kNotFound, "NO_PROFILE_FILE",
                   "bus.profile_file: cannot read " + options.profile_file +
                       "; deploy/dds/profiles.xml is the one to name",
                   {{"path", options.profile_file}});
  }
  if (factory->load_XML_profiles_file(options.profile_file) != ReturnCode_t::RETCODE_OK ||
      factory->get_participant_qos_from_profile(kParticipantProfile, qos) != ReturnCode_t::RETCODE_OK) {
    return Trouble(absl::StatusCode::kInvalidArgument, "BAD_PROFILE_FILE",
                   "bus.profile_file: " + options.profile_file +
                       " is not a profile file with a participant profile '" + kParticipantProfile + "'",
                   {{"path", options.profile_file}});
  }
  return absl::OkStatus();
}

absl::Status Participant::Inside::AddTransport(dds::DomainParticipantQos& qos,
                                               const std::vector<std::string>& own) {
  auto udp = std::make_shared<rtps::UDPv4TransportDescriptor>();
  udp->sendBufferSize = kSocketBufferBytes;
  udp->receiveBufferSize = kSocketBufferBytes;
  udp->maxMessageSize = kMessageBytes;
  udp->non_blocking_send = true;  // a full socket buffer loses a datagram; it never stops a loop
  udp->interfaceWhiteList = own;
  udp->maxInitialPeersRange = static_cast<std::uint32_t>(options.peers_per_host);
  auto made = MakeGuard(options, OnlyLoopback(own), log);
  if (!made.ok()) {
    return made.status();
  }
  guard = std::make_shared<GuardState>(std::move(*made), options.faults);
  qos.transport().use_builtin_transports = false;
  qos.transport().user_transports = {MakeGuardedTransport(udp, guard)};
  return absl::OkStatus();
}

absl::Status Participant::Inside::AddPeers(dds::DomainParticipantQos& qos, bool loopback) {
  std::vector<std::string> peers_wanted = options.initial_peers;
  if (peers_wanted.empty() && loopback) {
    peers_wanted = {"127.0.0.1"};
  }
  const auto addresses = PeerAddresses(peers_wanted);
  if (!addresses.ok()) {
    return addresses.status();
  }
  for (const std::string& address : *addresses) {
    Locator_t locator;  // port 0: the well-known ports of the first `peers_per_host` participants there
    locator.kind = LOCATOR_KIND_UDPv4;
    IPLocator::setIPv4(locator, address);
    qos.wire_protocol().builtin.initialPeersList.push_back(locator);
  }
  qos.wire_protocol().builtin.avoid_builtin_multicast = !addresses->empty();
  if (loopback) {
    // An own unicast metatraffic locator keeps Fast DDS from opening a multicast one.
    Locator_t locator;
    locator.kind = LOCATOR_KIND_UDPv4;
    IPLocator::setIPv4(locator, "127.0.0.1");
    qos.wire_protocol().builtin.metatrafficUnicastLocatorList.push_back(locator);
  }
  return absl::OkStatus();
}

absl::Status Participant::Inside::Start(const BusOptions& wanted) {
  options = wanted;
  dds::Log::SetVerbosity(dds::Log::Kind::Error);
  if (absl::Status status = LoadProfiles(); !status.ok()) {
    return status;
  }
  auto* factory = dds::DomainParticipantFactory::get_instance();
  dds::DomainParticipantQos qos;
  factory->get_participant_qos_from_profile(kParticipantProfile, qos);
  qos.name(options.house);
  const auto own = InterfaceAddresses(options.interfaces);
  if (!own.ok()) {
    return own.status();
  }
  if (absl::Status status = AddTransport(qos, *own); !status.ok()) {
    return status;
  }
  if (absl::Status status = AddPeers(qos, OnlyLoopback(*own)); !status.ok()) {
    return status;
  }
  participant = factory->create_participant(static_cast<dds::DomainId_t>(options.domain), qos, this,
                                            dds::StatusMask::none());
  dds::PublisherQos publisher_qos = dds::PUBLISHER_QOS_DEFAULT;
  dds::SubscriberQos subscriber_qos = dds::SUBSCRIBER_QOS_DEFAULT;
  publisher_qos.partition().push_back(options.partition.c_str());
  subscriber_qos.partition().push_back(options.partition.c_str());
  if (participant != nullptr) {
    publisher = participant->create_publisher(publisher_qos);
    subscriber = participant->create_subscriber(subscriber_qos);
  }
  if (publisher == nullptr || subscriber == nullptr) {
    return Trouble(absl::StatusCode::kUnavailable, "NO_PARTICIPANT",
                   "cannot join the bus in domain " + std::to_string(options.domain) +
                       ": its UDP ports are taken or may not be opened (domains are 0 to 232)",
                   {{"domain", std::to_string(options.domain)}});
  }
  return absl::OkStatus();
}

dds::Topic* Participant::Inside::AcquireTopic(const std::string& name, dds::TypeSupport type) {
  const std::lock_guard lock(topics_mutex_);
  auto* description = participant->lookup_topicdescription(name);
  dds::Topic* topic = nullptr;
  if (description != nullptr) {
    topic = description->get_type_name() == type.get_type_name() ? static_cast<dds::Topic*>(description)
                                                                 : nullptr;
  } else if (type.register_type(participant) == ReturnCode_t::RETCODE_OK) {
    topic = participant->create_topic(name, type.get_type_name(), dds::TOPIC_QOS_DEFAULT);
  }
  topic_users_[name] += topic != nullptr ? 1 : 0;
  return topic;
}

void Participant::Inside::ReleaseTopic(dds::Topic* topic) {
  const std::lock_guard lock(topics_mutex_);
  const std::string name = topic->get_name();
  if (--topic_users_[name] == 0) {
    topic_users_.erase(name);
    participant->delete_topic(topic);
  }
}

void Participant::Inside::on_participant_discovery(
    dds::DomainParticipant*, eprosima::fastrtps::rtps::ParticipantDiscoveryInfo&& info) {
  using eprosima::fastrtps::rtps::ParticipantDiscoveryInfo;
  const std::string name = info.info.m_participantName.to_string();
  if (info.status == ParticipantDiscoveryInfo::DISCOVERED_PARTICIPANT) {
    peers.fetch_add(1);
  } else if (info.status == ParticipantDiscoveryInfo::REMOVED_PARTICIPANT ||
             info.status == ParticipantDiscoveryInfo::DROPPED_PARTICIPANT) {
    peers.fetch_sub(1);
  } else {
    return;
  }
  peers_gauge.Set(peers.load());
  if (log != nullptr) {
    const bool found = info.status == ParticipantDiscoveryInfo::DISCOVERED_PARTICIPANT;
    const bool lost = info.status == ParticipantDiscoveryInfo::DROPPED_PARTICIPANT;
    log->Info(found ? "peer_found" : "peer_gone",
              found ? "a process has joined the bus"
                    : (lost ? "a process has not been heard for its lease" : "a process has left the bus"),
              {{"peer", name}, {"peers", peers.load()}});
  }
}

Participant::Participant() : inside_(std::make_unique<Inside>()) {}
Participant::~Participant() = default;

absl::StatusOr<std::unique_ptr<Participant>> Participant::Open(const BusOptions& options, Log* log,
                                                               Metrics* metrics) {
  std::unique_ptr<Participant> self(new Participant);
  self->inside_->log = log;
  self->inside_->metrics = metrics;
  if (metrics != nullptr) {
    self->inside_->peers_gauge = metrics->AddGauge("lambdajet_bus_peers", "Processes seen on the bus now.");
    for (std::size_t i = 0; i < self->inside_->guard_counters.size(); ++i) {
      self->inside_->guard_counters[i] = metrics->AddCounter(
          "lambdajet_bus_guard_datagrams_total", "Datagrams that arrived, by the guard's verdict.",
          {{"verdict", GuardVerdictName(static_cast<GuardVerdict>(i))}});
    }
  }
  if (absl::Status status = self->inside_->Start(options); !status.ok()) {
    return status;
  }
  return self;
}

bool Participant::guarded() const { return inside_->guard->guard() != nullptr; }
int Participant::peers() const { return inside_->peers.load(); }

std::uint64_t Participant::refused_datagrams() const {
  const DatagramGuard* guard = inside_->guard->guard();
  std::uint64_t sum = 0;
  for (std::size_t i = 1; guard != nullptr && i < static_cast<std::size_t>(GuardVerdict::kCount); ++i) {
    sum += guard->count(static_cast<GuardVerdict>(i));
  }
  return sum;
}

void Participant::UpdateMetrics() {
  const DatagramGuard* guard = inside_->guard->guard();
  for (std::size_t i = 0; guard != nullptr && i < inside_->guard_counters.size(); ++i) {
    const std::uint64_t now = guard->count(static_cast<GuardVerdict>(i));
    inside_->guard_counters[i].Increment(static_cast<double>(now - inside_->guard_reported[i]));
    inside_->guard_reported[i] = now;
  }
}

void Participant::SetFaults(const LinkFaults& faults) { inside_->guard->SetFaults(faults); }

}  // namespace lambdajet
