#include <gtest/gtest.h>

#include <atomic>

#include "foundation/contract/trouble.hpp"
#include "platform/bus/participant.hpp"
#include "platform/bus/reader.hpp"
#include "platform/bus/sample_slots.hpp"
#include "platform/bus/writer.hpp"
#include "tests/bus/plain_sample.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/eventually.hpp"
#include "tests/support/private_domain.hpp"
#include "tests/support/temporary_folder.hpp"

namespace lambdajet::test {
namespace {

using PlainWriter = Writer<PlainSamplePubSubType>;
using PlainReader = Reader<PlainSamplePubSubType>;

constexpr char kKey[] = "7 000102030405060708090a0b0c0d0e0f101112131415161718191a1b1c1d1e1f\n";
constexpr char kOtherKey[] = "7 ff0102030405060708090a0b0c0d0e0f101112131415161718191a1b1c1d1e1f\n";

class Bus : public ::testing::Test {
 protected:
  BusOptions Options(const std::string& house, const std::string& key = kKey) {
    BusOptions options;
    options.house = house;
    options.partition = "machine-a";
    options.domain = domain_.number();
    options.peers_per_host = 64;  // Fast DDS numbers the participants of a process on and on
    options.profile_file = SourceDir() + "/deploy/dds/profiles.xml";
    if (!key.empty()) {
      options.key_file = folder_.Write(house + ".key", key);
    }
    return options;
  }

  std::unique_ptr<Participant> Join(const BusOptions& options) {
    auto participant = Participant::Open(options, nullptr, nullptr);
    EXPECT_TRUE(participant.ok()) << participant.status().ToString();
    return participant.ok() ? std::move(*participant) : nullptr;
  }

  PlainWriter OpenWriter(Participant& bus, const TopicSpec& topic, EndpointEvents events = {}) {
    auto writer = PlainWriter::Open(bus, topic, std::move(events));
    EXPECT_TRUE(writer.ok()) << writer.status().ToString();
    return std::move(*writer);
  }

  PlainReader OpenReader(Participant& bus, const TopicSpec& topic, SampleQueue<PlainSample>& queue,
                         EndpointEvents events = {}) {
    auto reader = PlainReader::Open(
        bus, topic, [&queue](const PlainSample& s, const Arrival& a) { queue.Put(s, a); }, std::move(events));
    EXPECT_TRUE(reader.ok()) << reader.status().ToString();
    return std::move(*reader);
  }

  PrivateDomain domain_;
  TemporaryFolder folder_;
};

const TopicSpec kSetpoint{"test/setpoint", "abc123", "setpoint"};
const TopicSpec kState{"test/state", "abc123", "state"};
const TopicSpec kDescription{"test/description", "abc123", "description"};

TEST_F(Bus, CarriesEverySampleInOrder) {
  auto here = Join(Options("here"));
  auto there = Join(Options("there"));
  SampleQueue<PlainSample> queue(1000);
  auto reader = OpenReader(*there, kSetpoint, queue);
  auto writer = OpenWriter(*here, kSetpoint);
  ASSERT_TRUE(Eventually([&] { return writer.matched() == 1 && reader.matched() == 1; }));
  for (std::uint64_t i = 0; i < 1000; ++i) {
    ASSERT_TRUE(Eventually([&] { return writer.Write({i, {1, 2, 3}}); })) << i;
  }
  ASSERT_TRUE(Eventually([&] { return queue.size() == 1000; })) << queue.size();
  PlainSample sample;
  for (std::uint64_t i = 0; i < 1000; ++i) {
    ASSERT_TRUE(queue.TakeWithin(kPatience, sample));
    EXPECT_EQ(sample.number, i);
    EXPECT_EQ(sample.bytes, (std::vector<std::uint8_t>{1, 2, 3}));
  }
}

TEST_F(Bus, CarriesSamplesLargerThanADatagram) {
  auto here = Join(Options("here"));
  auto there = Join(Options("there"));
  SampleQueue<PlainSample> queue(4);
  auto reader = OpenReader(*there, kDescription, queue);
  auto writer = OpenWriter(*here, kDescription);
  ASSERT_TRUE(Eventually([&] { return writer.matched() == 1 && reader.matched() == 1; }));
  PlainSample large{1, std::vector<std::uint8_t>(190'000)};
  for (std::size_t i = 0; i < large.bytes.size(); ++i) {
    large.bytes[i] = static_cast<std::uint8_t>(i * 31);
  }
  ASSERT_TRUE(writer.Write(large));
  PlainSample arrived;
  ASSERT_TRUE(queue.TakeWithin(kPatience, arrived));
  EXPECT_EQ(arrived.bytes, large.bytes);
}

TEST_F(Bus, GivesTheDescriptionToWhoComesLate) {
  auto here = Join(Options("here"));
  auto writer = OpenWriter(*here, kDescription);
  ASSERT_TRUE(writer.Write({41, {}}));
  ASSERT_TRUE(writer.Write({42, {}}));
  auto there = Join(Options("there"));
  SampleQueue<PlainSample> queue(4);
  auto reader = OpenReader(*there, kDescription, queue);
  PlainSample sample;
  ASSERT_TRUE(queue.TakeWithin(kPatience, sample));
  EXPECT_EQ(sample.number, 42u);
}

TEST_F(Bus, NeverMatchesAnotherSchema) {
  auto here = Join(Options("here"));
  auto there = Join(Options("there"));
  SampleQueue<PlainSample> same_queue(4);
  SampleQueue<PlainSample> other_queue(4);
  TopicSpec other = kState;
  other.schema_hash = "def456";
  auto reader_other = OpenReader(*there, other, other_queue);
  auto reader_same = OpenReader(*there, kState, same_queue);
  auto writer = OpenWriter(*here, kState);
  ASSERT_TRUE(Eventually([&] { return reader_same.matched() == 1 && writer.matched() == 1; }));
  EXPECT_TRUE(Throughout(std::chrono::milliseconds(300), [&] { return reader_other.matched() == 0; }));
}

TEST_F(Bus, KeepsMachinesApart) {
  auto here = Join(Options("here"));
  BusOptions options = Options("there");
  options.partition = "machine-b";
  auto there = Join(options);
  SampleQueue<PlainSample> queue(4);
  auto reader = OpenReader(*there, kState, queue);
  auto writer = OpenWriter(*here, kState);
  ASSERT_TRUE(Eventually([&] { return here->peers() == 1 && there->peers() == 1; }));
  EXPECT_TRUE(Throughout(std::chrono::milliseconds(300), [&] { return reader.matched() == 0; }));
}

TEST_F(Bus, HearsNothingUnderAnotherKey) {
  auto here = Join(Options("here"));
  auto there = Join(Options("there", kOtherKey));
  SampleQueue<PlainSample> queue(4);
  auto reader = OpenReader(*there, kState, queue);
  auto writer = OpenWriter(*here, kState);
  ASSERT_TRUE(Eventually([&] { return there->refused_datagrams() >= 5 && here->refused_datagrams() >= 5; }));
  EXPECT_EQ(reader.matched(), 0);
  EXPECT_EQ(writer.matched(), 0);
  EXPECT_EQ(there->peers(), 0);
}

TEST_F(Bus, RefusesTheWriteOfAFullHistoryAtOnce) {
  auto here = Join(Options("here"));
  auto there = Join(Options("there"));
  SampleQueue<PlainSample> queue(1);
  auto reader = OpenReader(*there, kSetpoint, queue);
  auto writer = OpenWriter(*here, kSetpoint);
  ASSERT_TRUE(Eventually([&] { return writer.matched() == 1 && reader.matched() == 1; }));
  LinkFaults deaf;
  deaf.drop_ratio = 1.0;
  there->SetFaults(deaf);  // nothing arrives, so nothing is acknowledged
  int taken = 0;
  std::chrono::steady_clock::duration longest{};
  bool full = false;
  while (!full && taken < 5000) {
    const auto before = std::chrono::steady_clock::now();
    full = !writer.Write({1, {}});
    longest = std::max(longest, std::chrono::steady_clock::now() - before);
    taken += full ? 0 : 1;
  }
  EXPECT_TRUE(full);
  EXPECT_EQ(taken, 512);  // deploy/dds/profiles.xml
  EXPECT_LT(longest, std::chrono::milliseconds(90)) << "default max_blocking_time is 100 ms";
  there->SetFaults({});
  EXPECT_TRUE(Eventually([&] {
    return writer.Write({2, {}});
  })) << "takes samples again when they are acknowledged";
}

TEST_F(Bus, DeliversAllOfASetpointStreamOverALossyLink) {
  auto here = Join(Options("here"));
  auto there = Join(Options("there"));
  SampleQueue<PlainSample> queue(1000);
  auto reader = OpenReader(*there, kSetpoint, queue);
  auto writer = OpenWriter(*here, kSetpoint);
  ASSERT_TRUE(Eventually([&] { return writer.matched() == 1 && reader.matched() == 1; }));
  LinkFaults lossy;
  lossy.drop_ratio = 0.3;
  lossy.duplicate_ratio = 0.2;
  lossy.delay_ratio = 0.2;
  lossy.delay_s = 0.003;
  lossy.seed = 7;
  there->SetFaults(lossy);
  for (std::uint64_t i = 0; i < 300; ++i) {
    ASSERT_TRUE(Eventually([&] { return writer.Write({i, {}}); }));
  }
  ASSERT_TRUE(Eventually([&] { return queue.size() == 300; })) << queue.size();
  PlainSample sample;
  for (std::uint64_t i = 0; i < 300; ++i) {
    ASSERT_TRUE(queue.TakeWithin(kPatience, sample));
    EXPECT_EQ(sample.number, i);
  }
}

TEST_F(Bus, TellsOfAMissedDeadlineAndALostWriter) {
  auto here = Join(Options("here"));
  auto there = Join(Options("there"));
  TopicSpec topic = kState;
  topic.deadline_s = 0.02;
  SampleQueue<PlainSample> queue(1000);
  std::atomic<int> missed = 0;
  EndpointEvents events;
  events.deadline_missed = [&] { ++missed; };
  auto reader = OpenReader(*there, topic, queue, events);
  auto writer = std::make_unique<PlainWriter>(OpenWriter(*here, topic));
  ASSERT_TRUE(Eventually([&] { return writer->matched() == 1 && reader.matched() == 1; }));
  ASSERT_TRUE(Eventually([&] { return writer->Write({1, {}}) && queue.size() > 0; }));
  EXPECT_TRUE(Eventually([&] { return missed > 0; }));
  EXPECT_TRUE(Eventually([&] { return reader.alive() == 1; }));
  LinkFaults cut;
  cut.drop_ratio = 1.0;
  there->SetFaults(cut);
  EXPECT_TRUE(Eventually([&] { return reader.alive() == 0; }));
}

TEST_F(Bus, ReportsQosThatDoesNotFit) {
  auto here = Join(Options("here"));
  auto there = Join(Options("there"));
  TopicSpec strict = kState;
  strict.deadline_s = 0.01;
  SampleQueue<PlainSample> queue(4);
  std::mutex mutex;
  std::string policy;
  EndpointEvents events;
  events.incompatible = [&](const std::string& name) {
    const std::lock_guard lock(mutex);
    policy = name;
  };
  auto reader = OpenReader(*there, strict, queue, events);
  auto writer = OpenWriter(*here, kState);
  ASSERT_TRUE(Eventually([&] {
    const std::lock_guard lock(mutex);
    return !policy.empty();
  }));
  EXPECT_EQ(policy, "deadline");
}

TEST_F(Bus, RefusesToLeaveTheHostWithoutAKey) {
  BusOptions options = Options("here", "");
  options.interfaces.clear();
  const auto refused = Participant::Open(options, nullptr, nullptr);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(TroubleReason(refused.status()), "NO_KEY");
  EXPECT_FALSE(Join(Options("here", ""))->guarded());
}

TEST_F(Bus, SaysWhatIsWrongWithItsSettings) {
  BusOptions options = Options("here");
  options.interfaces = {"no-such-interface"};
  EXPECT_EQ(TroubleReason(Participant::Open(options, nullptr, nullptr).status()), "BAD_INTERFACE");
  options = Options("here");
  options.key_file = folder_.Write("open.key", kKey, 0644);
  EXPECT_EQ(TroubleReason(Participant::Open(options, nullptr, nullptr).status()), "KEY_FILE_OPEN_TO_OTHERS");
  options.key_file = folder_.Write("bad.key", "7 00ff\n");
  EXPECT_EQ(TroubleReason(Participant::Open(options, nullptr, nullptr).status()), "BAD_KEY_FILE");
  auto bus = Join(Options("there"));
  EXPECT_EQ(TroubleReason(PlainWriter::Open(*bus, {"test/x", "abc", "no-such"}).status()), "NO_SUCH_PROFILE");
}

}  // namespace
}  // namespace lambdajet::test
