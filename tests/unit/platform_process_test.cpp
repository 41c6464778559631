#include <gtest/gtest.h>
#include <pthread.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <atomic>
#include <cstdlib>
#include <new>
#include <random>
#include <thread>

#include "foundation/contract/trouble.hpp"
#include "platform/process/atomic_file.hpp"
#include "platform/process/common_clock.hpp"
#include "platform/process/kept_text.hpp"
#include "platform/process/periodic_loop.hpp"
#include "platform/process/stop_signal.hpp"
#include "tests/support/temporary_folder.hpp"

namespace {
std::atomic<long> allocations = 0;
}

void* operator new(std::size_t size) {
  ++allocations;
  if (void* memory = std::malloc(size)) {
    return memory;
  }
  throw std::bad_alloc();
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

namespace lambdajet::test {
namespace {

TEST(StopSignal, HearsATermAndNothingElse) {
  const StopSignal stop;
  EXPECT_EQ(stop.WaitFor(std::chrono::milliseconds(1)), std::nullopt);
  StopSignal::Request();
  EXPECT_EQ(stop.WaitFor(std::chrono::seconds(10)), SIGTERM);
}

TEST(StopSignal, IsBlockedInThreadsStartedLater) {
  const StopSignal stop;
  std::thread([] {
    sigset_t set;
    pthread_sigmask(SIG_BLOCK, nullptr, &set);
    EXPECT_TRUE(sigismember(&set, SIGTERM));
    EXPECT_TRUE(sigismember(&set, SIGINT));
  }).join();
}

TEST(CommonClock, NeverRunsBackwards) {
  CommonClock clock;
  std::int64_t last = clock.now_ns();
  for (int i = 0; i < 10'000; ++i) {
    const std::int64_t now = clock.now_ns();
    ASSERT_GE(now, last);
    last = now;
  }
}

TEST(CommonClock, FollowsASmallCorrectionSlowlyAndWholly) {
  CommonClock clock({.step_threshold_ns = 1'000'000, .slew_ppm = 50.0});
  std::int64_t monotonic = MonotonicNow();
  const std::int64_t offset = clock.FromMonotonic(monotonic) - monotonic;
  std::int64_t followed = 0;
  for (int second = 0; second < 20; ++second) {
    monotonic += 1'000'000'000;
    const ClockCorrection correction = clock.Follow(monotonic, monotonic + offset + 500'000);
    EXPECT_FALSE(correction.step);
    EXPECT_LE(std::abs(correction.followed_ns), 50'000 + 2'000);  // the first second is a little longer
    followed += correction.followed_ns;
  }
  EXPECT_EQ(followed, 500'000);
  EXPECT_EQ(clock.FromMonotonic(0), offset + 500'000);
}

TEST(CommonClock, ReportsAStepAndDoesNotFollowIt) {
  std::mt19937_64 numbers(3);
  for (int i = 0; i < 1000; ++i) {
    CommonClock clock;
    const std::int64_t monotonic = MonotonicNow() + 1'000'000'000;
    const std::int64_t before = clock.FromMonotonic(monotonic);
    const auto jump = static_cast<std::int64_t>(numbers() % 3'600'000'000'000) + 1'000'001;
    const std::int64_t signed_jump = i % 2 == 0 ? jump : -jump;
    const ClockCorrection correction = clock.Follow(monotonic, before + signed_jump);
    EXPECT_TRUE(correction.step);
    EXPECT_EQ(correction.difference_ns, signed_jump);
    EXPECT_EQ(clock.FromMonotonic(monotonic), before);
  }
}

TEST(CommonClock, TurnsItsTimeIntoTheGridsAndBack) {
  const CommonClock clock;
  EXPECT_EQ(clock.ToMonotonic(clock.FromMonotonic(123'456'789)), 123'456'789);
}

TEST(PeriodicLoop, KeepsToTheGridAndCountsWhatItMisses) {
  PeriodicLoop loop({.period_ns = 1'000'000});
  std::atomic<bool> stop = false;
  std::int64_t last_tick = 0;
  std::uint64_t last_number = 0;
  bool first = true;
  bool held_up = false;
  loop.Run(stop, [&](const CycleTime& time) {
    EXPECT_EQ(time.tick_ns % 1'000'000, 0);
    EXPECT_GE(time.woke_ns, time.tick_ns);
    if (!first) {
      EXPECT_EQ(time.tick_ns - last_tick, static_cast<std::int64_t>(time.number - last_number) * 1'000'000);
    }
    first = false;
    last_tick = time.tick_ns;
    last_number = time.number;
    if (time.number >= 20 && !held_up) {
      held_up = true;
      while (MonotonicNow() < time.tick_ns + 5'500'000) {  // an overrun by design
      }
    }
    stop = time.number >= 60;
  });
  EXPECT_GE(loop.overruns(), 1u);
  EXPECT_GE(loop.skipped_ticks(), 4u);
  EXPECT_LE(loop.cycles(), last_number + 1);
  EXPECT_GE(loop.cycles() + loop.skipped_ticks(), last_number + 1);
}

TEST(PeriodicLoop, AllocatesNothingInACycle) {
  PeriodicLoop loop({.period_ns = 200'000});
  std::atomic<bool> stop = false;
  long before = 0;
  long after = 0;
  loop.Run(stop, [&](const CycleTime& time) {
    before = time.number < 2 ? allocations.load() : before;
    after = allocations.load();
    stop = time.number >= 200;
  });
  EXPECT_EQ(after, before);
}

TEST(PeriodicLoop, SaysWhatTheHostRefuses) {
  std::thread([] {
    const RealTimeGrant grant = PeriodicLoop({.cpu = 1000}).EnterRealTime();
    EXPECT_FALSE(grant.pinned);
    EXPECT_NE(grant.refused.find("not pinned"), std::string::npos);
    EXPECT_TRUE(PeriodicLoop({}).EnterRealTime().refused.empty());
  }).join();
}

TEST(AtomicFile, ReplacesWholeAndLeavesNothingBehind) {
  const TemporaryFolder folder;
  const std::string path = folder.File("state");
  ASSERT_TRUE(WriteFileAtomically(path, "old").ok());
  ASSERT_TRUE(WriteFileAtomically(path, std::string(100'000, 'x')).ok());
  EXPECT_EQ(*ReadWholeFile(path, 1 << 20), std::string(100'000, 'x'));
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 1);
}

TEST(KeptText, IsReadBackWhereverItIsKept) {
  std::string text(3u << 20, 'x');
  text[70000] = '\0';
  const KeptText in_memory(text, text.size()), in_file(text, text.size() - 1);
  EXPECT_FALSE(in_memory.in_file());
  EXPECT_TRUE(in_file.in_file());
  for (const KeptText* kept : {&in_memory, &in_file, &in_file}) {
    EXPECT_EQ(kept->size(), text.size());
    const auto read = kept->Read();
    ASSERT_TRUE(read.ok()) << read.status();
    EXPECT_TRUE(*read == text);
  }
  EXPECT_EQ(*KeptText().Read(), "");
}

TEST(KeptText, StaysInMemoryWhereNoFileIsToBeHad) {
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &before), 0);
  rlimit none = before;
  none.rlim_cur = 0;
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &none), 0);
  const KeptText kept("a text", 0);
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &before), 0);
  EXPECT_FALSE(kept.in_file());
  EXPECT_EQ(*kept.Read(), "a text");
}

TEST(AtomicFile, SaysWhatIsInTheWay) {
  const TemporaryFolder folder;
  EXPECT_EQ(TroubleReason(WriteFileAtomically(folder.File("no/such/folder"), "x")), "NO_SUCH_FILE");
  EXPECT_EQ(TroubleReason(WriteFileAtomically("/dev/full/x", "x")), "NO_SUCH_FILE");
  EXPECT_EQ(TroubleReason(ReadWholeFile(folder.path(), 10).status()), "NOT_A_FILE");
  const std::string file = folder.Write("large", std::string(11, 'x'));
  EXPECT_EQ(TroubleReason(ReadWholeFile(file, 10).status()), "FILE_TOO_LARGE");
  ASSERT_EQ(mkfifo(folder.File("fifo").c_str(), 0600), 0);
  EXPECT_EQ(TroubleReason(ReadWholeFile(folder.File("fifo"), 10).status()), "NOT_A_FILE");
}

}  // namespace
}  // namespace lambdajet::test
