#include <gtest/gtest.h>

#include <random>
#include <set>

#include "foundation/contract/trouble.hpp"
#include "platform/bus/datagram_guard.hpp"
#include "platform/bus/guard_key.hpp"
#include "platform/bus/sample_slots.hpp"
#include "tests/support/temporary_folder.hpp"

namespace lambdajet::test {
namespace {

using Bytes = std::vector<std::uint8_t>;

GuardKey Key(std::uint8_t id, std::uint8_t fill) { return {id, Bytes(32, fill)}; }

Bytes Sealed(DatagramGuard& guard, const Bytes& payload) {
  Bytes sealed;
  guard.Seal(payload, sealed);
  return sealed;
}

TEST(DatagramGuard, OpensWhatItSealed) {
  DatagramGuard here({Key(1, 0xaa)});
  DatagramGuard there({Key(1, 0xaa)});
  std::mt19937_64 numbers(5);
  for (int i = 0; i < 2000; ++i) {
    Bytes payload(numbers() % 1500);
    for (auto& byte : payload) {
      byte = static_cast<std::uint8_t>(numbers());
    }
    const Bytes sealed = Sealed(here, payload);
    ASSERT_EQ(sealed.size(), payload.size() + kGuardOverheadBytes);
    ASSERT_EQ(there.Open(sealed), payload.size());
    ASSERT_TRUE(std::equal(payload.begin(), payload.end(), sealed.begin()));
  }
}

TEST(DatagramGuard, RefusesEveryFlippedBit) {
  DatagramGuard here({Key(1, 0xaa)});
  DatagramGuard there({Key(1, 0xaa)});
  const Bytes sealed = Sealed(here, {'R', 'T', 'P', 'S', 2, 3});
  for (std::size_t bit = 0; bit < 8 * sealed.size(); ++bit) {
    Bytes forged = sealed;
    forged[bit / 8] ^= static_cast<std::uint8_t>(1 << (bit % 8));
    EXPECT_EQ(there.Open(forged), std::nullopt) << bit;
  }
  EXPECT_EQ(there.count(GuardVerdict::kAccepted), 0u);
  EXPECT_EQ(there.Open(sealed), 6u);
}

TEST(DatagramGuard, SaysWhyItRefuses) {
  DatagramGuard here({Key(1, 0xaa)});
  DatagramGuard other_key({Key(1, 0xbb)});
  DatagramGuard other_id({Key(2, 0xaa)});
  DatagramGuard there({Key(1, 0xaa)});
  EXPECT_FALSE(there.Open(Bytes(kGuardOverheadBytes - 1)));
  EXPECT_FALSE(there.Open(Bytes(92)));
  EXPECT_FALSE(there.Open(Sealed(other_key, {1})));
  EXPECT_FALSE(there.Open(Sealed(other_id, {1})));
  const Bytes good = Sealed(here, {1});
  EXPECT_TRUE(there.Open(good));
  EXPECT_FALSE(there.Open(good));
  EXPECT_EQ(there.count(GuardVerdict::kTooShort), 1u);
  EXPECT_EQ(there.count(GuardVerdict::kBadVersion), 1u);
  EXPECT_EQ(there.count(GuardVerdict::kBadTag), 1u);
  EXPECT_EQ(there.count(GuardVerdict::kUnknownKey), 1u);
  EXPECT_EQ(there.count(GuardVerdict::kReplayed), 1u);
  EXPECT_EQ(there.count(GuardVerdict::kAccepted), 1u);
}

TEST(DatagramGuard, AcceptsBothKeysWhileTheyRotate) {
  DatagramGuard old_one({Key(1, 0xaa), Key(2, 0xbb)});
  DatagramGuard new_one({Key(2, 0xbb), Key(1, 0xaa)});
  EXPECT_TRUE(new_one.Open(Sealed(old_one, {1})));
  EXPECT_TRUE(old_one.Open(Sealed(new_one, {1})));
}

TEST(DatagramGuard, KeepsSendersApart) {
  DatagramGuard there({Key(1, 0xaa)});
  for (int i = 0; i < 600; ++i) {  // more than the table holds
    DatagramGuard sender({Key(1, 0xaa)});
    const Bytes sealed = Sealed(sender, {1});
    ASSERT_TRUE(there.Open(sealed));
    ASSERT_FALSE(there.Open(sealed));
  }
}

// The window against the plain definition: accepted once, and only if among the newest 1024.
TEST(ReplayWindow, AgreesWithItsDefinition) {
  std::mt19937_64 numbers(9);
  for (int round = 0; round < 20; ++round) {
    ReplayWindow window;
    std::set<std::uint64_t> seen;
    std::uint64_t highest = 0;
    std::uint64_t base = numbers() % 100'000 + 5000;
    for (int i = 0; i < 20'000; ++i) {
      base += numbers() % 50 == 0 ? numbers() % 3000 : numbers() % 3;
      const std::uint64_t counter =
          base - std::min<std::uint64_t>(base, numbers() % (i % 3 == 0 ? 1200 : 40));
      const bool fresh = seen.empty() || counter > highest ||
                         (highest - counter < ReplayWindow::kSize && !seen.contains(counter));
      ASSERT_EQ(window.Accept(counter), fresh) << "counter " << counter << " highest " << highest;
      if (fresh) {
        seen.insert(counter);
        highest = std::max(highest, counter);
      }
    }
  }
}

TEST(GuardKeys, AreReadFromAFileThatIsClosedToOthers) {
  const TemporaryFolder folder;
  const std::string hex(64, 'a');
  const auto keys =
      ReadGuardKeys(folder.Write("keys", "# comment\n\n3 " + hex + " # newest\n250 " + hex + "00\n"));
  ASSERT_TRUE(keys.ok()) << keys.status().ToString();
  ASSERT_EQ(keys->size(), 2u);
  EXPECT_EQ((*keys)[0].id, 3);
  EXPECT_EQ((*keys)[1].secret.size(), 33u);
  for (const std::string& bad :
       std::vector<std::string>{"", "1\n", "256 " + hex, "-1 " + hex, "1 " + hex.substr(2), "1 " + hex + "0",
                                "1 " + hex + " more", "1 zz" + hex, "1 " + hex + "\n1 " + hex}) {
    EXPECT_EQ(TroubleReason(ReadGuardKeys(folder.Write("bad", bad)).status()), "BAD_KEY_FILE") << bad;
  }
  EXPECT_EQ(TroubleReason(ReadGuardKeys(folder.Write("open", "1 " + hex, 0604)).status()),
            "KEY_FILE_OPEN_TO_OTHERS");
  EXPECT_EQ(TroubleReason(ReadGuardKeys(folder.File("none")).status()), "NO_SUCH_FILE");
}

TEST(SampleQueue, RefusesWhatDoesNotFitAndKeepsTheOrder) {
  SampleQueue<int> queue(3);
  for (int i = 0; i < 5; ++i) {
    EXPECT_EQ(queue.Put(i, {}), i < 3);
  }
  EXPECT_EQ(queue.dropped(), 2u);
  int sample = -1;
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE(queue.TryTake(sample));
    EXPECT_EQ(sample, i);
  }
  EXPECT_FALSE(queue.TryTake(sample));
}

TEST(LatestSample, GivesEachNewestOnce) {
  LatestSample<int> slot;
  int sample = -1;
  EXPECT_FALSE(slot.TryTakeNew(sample));
  EXPECT_FALSE(slot.Latest());
  slot.Put(1, {});
  slot.Put(2, {});
  ASSERT_TRUE(slot.TryTakeNew(sample));
  EXPECT_EQ(sample, 2);
  EXPECT_FALSE(slot.TryTakeNew(sample));
  EXPECT_EQ(slot.Latest()->first, 2);
}

}  // namespace
}  // namespace lambdajet::test
