#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <numeric>
#include <random>
#include <vector>

#include "drive/core/path_clock.hpp"
#include "drive/core/segment_buffer.hpp"
#include "foundation/motion/command_receiver.hpp"
#include "foundation/motion/loop_watch.hpp"
#include "foundation/motion/ring.hpp"
#include "foundation/motion/sequence_guard.hpp"
#include "foundation/motion/silence_watch.hpp"

namespace lambdajet::drive {
namespace {

class Dice {
 public:
  explicit Dice(std::uint64_t seed) : engine_(seed) {}
  double Between(double low, double high) {
    return low + (high - low) * std::uniform_real_distribution<double>(0.0, 1.0)(engine_);
  }
  int Below(int n) { return std::uniform_int_distribution<int>(0, n - 1)(engine_); }

 private:
  std::mt19937_64 engine_;
};

TEST(PathClockLaw, KeepsItsLimitsAndItsRangeUnderRandomWishes) {
  for (std::uint64_t seed = 1; seed <= 50; ++seed) {
    Dice dice(seed);
    const RateLimits limits{dice.Between(0.5, 10.0), dice.Between(5.0, 200.0)};
    PathClock clock;
    clock.StandAt(0.0);
    double last_tau = 0.0;
    double last_rate = 0.0;
    double last_acceleration = 0.0;
    const double dt = 0.001;
    for (int i = 0; i < 20000; ++i) {
      if (dice.Below(150) == 0) {
        clock.Retarget(dice.Below(3) == 0 ? 0.0 : dice.Between(0.0, 1.2), limits);
      }
      clock.Advance(dt);
      ASSERT_GE(clock.rate(), -1e-12) << seed;
      ASSERT_LE(clock.rate(), 1.2 + 1e-12) << seed;
      ASSERT_LE(std::abs(clock.rate_per_s()), limits.acceleration_per_s + 1e-9);
      ASSERT_LE(std::abs(clock.rate_per_s() - last_acceleration), limits.jerk_per_s2 * dt + 1e-9);
      ASSERT_LE(std::abs(clock.rate() - last_rate), limits.acceleration_per_s * dt + 1e-12);
      ASSERT_GE(clock.tau_s(), last_tau - 1e-12) << "the path never runs back by itself";
      last_tau = clock.tau_s();
      last_rate = clock.rate();
      last_acceleration = clock.rate_per_s();
    }
  }
}

TEST(PathClockLaw, GoesWhereItIsToldExactlyAndWithoutOvershoot) {
  Dice dice(7);
  for (int i = 0; i < 5000; ++i) {
    const RateLimits limits{dice.Between(0.5, 10.0), dice.Between(5.0, 200.0)};
    PathClock clock;
    clock.StandAt(0.0);
    clock.RunAt(dice.Between(0.0, 1.2));
    const double from = clock.rate();
    const double to = dice.Between(0.0, 1.2);
    clock.Retarget(to, limits);
    for (int step = 0; step < 100000 && !clock.settled(); ++step) {
      clock.Advance(0.0007);
      ASSERT_GE(clock.rate(), std::min(from, to) - 1e-12);
      ASSERT_LE(clock.rate(), std::max(from, to) + 1e-12);
    }
    ASSERT_TRUE(clock.settled());
    ASSERT_EQ(clock.rate(), to);
    ASSERT_EQ(clock.rate_per_s(), 0.0);
  }
}

TEST(PathClockLaw, TauDoesNotDependOnHowOftenItIsAdvanced) {
  Dice dice(11);
  for (int i = 0; i < 2000; ++i) {
    const RateLimits limits{dice.Between(0.5, 10.0), dice.Between(5.0, 200.0)};
    PathClock coarse;
    coarse.StandAt(3.0);
    coarse.RunAt(dice.Between(0.0, 1.2));
    coarse.Retarget(dice.Between(0.0, 1.2), limits);
    coarse.Advance(dice.Between(0.0, 0.2));
    coarse.Retarget(dice.Between(-0.5, 1.2), limits);
    PathClock fine = coarse;
    const double time = dice.Between(0.0, 2.0);
    coarse.Advance(time);
    for (int step = 0; step < 997; ++step) {
      fine.Advance(time / 997.0);
    }
    ASSERT_NEAR(coarse.tau_s(), fine.tau_s(), 1e-12);
    ASSERT_NEAR(coarse.rate(), fine.rate(), 1e-11);
  }
}

TEST(PathClockLaw, KnowsItsStoppingDistance) {
  Dice dice(13);
  for (int i = 0; i < 2000; ++i) {
    const RateLimits limits{dice.Between(0.5, 10.0), dice.Between(5.0, 200.0)};
    PathClock clock;
    clock.StandAt(0.0);
    clock.RunAt(dice.Between(0.0, 1.2));
    clock.Retarget(dice.Between(0.0, 1.2), limits);
    clock.Advance(dice.Between(0.0, 0.3));
    const double predicted = clock.StoppingTau(limits);
    const double from = clock.tau_s();
    clock.Retarget(0.0, limits);
    clock.Advance(100.0);
    ASSERT_NEAR(clock.tau_s() - from, predicted, 1e-9);
    ASSERT_EQ(clock.rate(), 0.0);
  }
}

// Joined segments of random cubic pieces.
std::vector<Segment> Chain(Dice& dice, std::uint32_t count) {
  std::vector<Segment> chain(count);
  double start = 0.0;
  std::array<double, 3> at{};
  for (std::uint32_t i = 0; i < count; ++i) {
    Segment& s = chain[i];
    s.index = i;
    s.start_s = start;
    s.duration_s = dice.Between(0.005, 0.05);
    int k = 0;
    for (Polynomial* p : {&s.q_mm[0], &s.q_mm[1], &s.s_mm}) {
      p->c = {at[static_cast<std::size_t>(k)],
              dice.Between(1, 100),
              dice.Between(0, 500),
              dice.Between(0, 900),
              0,
              0};
      at[static_cast<std::size_t>(k++)] = p->value(s.duration_s);
    }
    start += s.duration_s;
  }
  return chain;
}

TEST(SegmentBufferLaw, HoldsTheChainInOrderWhateverComes) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Dice dice(seed);
    const std::vector<Segment> chain = Chain(dice, 2000);
    SegmentBuffer buffer({.capacity = 256, .ahead_s = 2.0, .behind_s = 0.5});
    double playing = 0.0;
    int full = 0;
    for (int i = 0; i < 60000 && buffer.next_index() < chain.size(); ++i) {
      // Mostly what is wanted, at times something else.
      const std::uint32_t wanted = buffer.next_index();
      const int off = dice.Below(4) == 0 ? dice.Below(20) - 10 : 0;
      const auto index = static_cast<std::uint32_t>(
          std::clamp(static_cast<int>(wanted) + off, 0, static_cast<int>(chain.size()) - 1));
      const SegmentAnswer answer = buffer.Accept(chain[index], playing);
      if (index != wanted) {
        ASSERT_EQ(answer, index < wanted ? SegmentAnswer::kRepeated : SegmentAnswer::kOutOfOrder);
      } else if (answer == SegmentAnswer::kFull) {
        ++full;
        playing += dice.Between(0.0, 0.3);
        playing = std::min(playing, buffer.end_tau_s());
      } else {
        ASSERT_EQ(answer, SegmentAnswer::kTaken);
      }
      ASSERT_LE(buffer.next_index() - buffer.first_index(), 256u);
      if (buffer.empty()) {
        continue;  // what came first was out of order and refused
      }
      ASSERT_LE(buffer.end_tau_s() - playing, 2.0 + 0.05);
      const std::uint32_t found = buffer.Find(playing, static_cast<std::uint32_t>(dice.Below(3000)));
      ASSERT_TRUE(buffer.Holds(found));
      ASSERT_EQ(buffer.at(found).index, found);
      ASSERT_EQ(buffer.at(found).start_s, chain[found].start_s);
      if (playing < buffer.end_tau_s() && playing >= buffer.first_tau_s()) {
        ASSERT_LE(buffer.at(found).start_s, playing);
        ASSERT_GE(buffer.at(found).start_s + buffer.at(found).duration_s, playing - 1e-9);
      }
    }
    EXPECT_EQ(buffer.next_index(), chain.size());
    EXPECT_GT(full, 10);
  }
}

TEST(SegmentBufferLaw, RefusesWhatIsNotSound) {
  Dice dice(3);
  const std::vector<Segment> chain = Chain(dice, 3);
  SegmentBuffer buffer({});
  ASSERT_EQ(buffer.Accept(chain[0], 0.0), SegmentAnswer::kTaken);
  Segment bad = chain[1];
  bad.q_mm[1].c[3] = std::nan("");
  EXPECT_EQ(buffer.Accept(bad, 0.0), SegmentAnswer::kNotFinite);
  bad = chain[1];
  bad.duration_s = 0.0;
  EXPECT_EQ(buffer.Accept(bad, 0.0), SegmentAnswer::kNotFinite);
  bad = chain[1];
  bad.q_mm[0].c[0] += 0.01;
  EXPECT_EQ(buffer.Accept(bad, 0.0), SegmentAnswer::kNotJoined);
  bad = chain[1];
  bad.s_mm.c[0] -= 0.01;
  EXPECT_EQ(buffer.Accept(bad, 0.0), SegmentAnswer::kNotJoined);
  bad = chain[1];
  bad.start_s += 1e-4;
  EXPECT_EQ(buffer.Accept(bad, 0.0), SegmentAnswer::kNotJoined);
  EXPECT_EQ(buffer.next_index(), 1u);
  EXPECT_EQ(buffer.Accept(chain[1], 0.0), SegmentAnswer::kTaken);
}

TEST(SegmentBufferLaw, BoundsAreNeverBelowWhatTheSegmentDoes) {
  Dice dice(5);
  for (int i = 0; i < 500; ++i) {
    Segment segment;
    segment.duration_s = dice.Between(0.005, 0.3);
    for (Polynomial& p : segment.q_mm) {
      for (double& c : p.c) {
        c = dice.Between(-1000, 1000);
      }
    }
    SegmentBuffer buffer({});
    ASSERT_EQ(buffer.Accept(segment, 0.0), SegmentAnswer::kTaken);
    double velocity = 0.0;
    double acceleration = 0.0;
    for (int k = 0; k <= 200; ++k) {
      for (const Polynomial& p : segment.q_mm) {
        velocity = std::max(velocity, std::abs(p.first(segment.duration_s * k / 200.0)));
        acceleration = std::max(acceleration, std::abs(p.second(segment.duration_s * k / 200.0)));
      }
    }
    ASSERT_GE(buffer.bounds(0).velocity_mm_per_s, velocity * (1.0 - 1e-12));
    ASSERT_GE(buffer.bounds(0).acceleration_mm_per_s2, acceleration * (1.0 - 1e-12));
  }
}

TEST(SequenceGuardLaw, TakesEachNumberOnceAndOnlyUpwards) {
  Dice dice(17);
  SequenceGuard guard;
  std::uint64_t highest = 0;
  std::uint32_t dropped = 0;
  for (int i = 0; i < 5000; ++i) {
    const auto number =
        static_cast<std::uint64_t>(std::max(1, static_cast<int>(highest) + dice.Below(7) - 3));
    const SampleVerdict verdict = guard.Judge({5, number, i});
    EXPECT_EQ(verdict, number > highest ? SampleVerdict::kFresh : SampleVerdict::kOld);
    dropped += verdict == SampleVerdict::kOld ? 1 : 0;
    highest = std::max(highest, number);
  }
  EXPECT_EQ(guard.dropped(), dropped);
  EXPECT_EQ(guard.sequence_number(), highest);
}

TEST(SequenceGuardLaw, TellsARestartFromASecondWriter) {
  SequenceGuard guard;
  EXPECT_EQ(guard.Judge({1, 10, 1000}), SampleVerdict::kFresh);
  EXPECT_EQ(guard.Judge({2, 1, 2000}), SampleVerdict::kRestarted);
  EXPECT_EQ(guard.Judge({1, 11, 1500}), SampleVerdict::kOld) << "late, but made before the restart";
  EXPECT_EQ(guard.Judge({2, 2, 2500}), SampleVerdict::kFresh);
  EXPECT_EQ(guard.Judge({1, 12, 3000}), SampleVerdict::kTwoWriters);
}

TEST(SilenceWatchLaw, TripsAtTheDeadlineAndNotWhenTheWholeHostSlept) {
  constexpr std::int64_t kMs = 1'000'000;
  for (const std::int64_t deadline_ms : {10, 20, 50}) {
    SilenceWatch watch(kMs);
    std::int64_t now = 1000 * kMs;
    for (int i = 0; i < 100; ++i, now += kMs) {
      if (i % 4 == 0) {
        watch.Heard(now);
      }
      ASSERT_FALSE(watch.Turn(now, deadline_ms * kMs));
    }
    const std::int64_t last = now - 4 * kMs;
    // Everything sleeps for a second; the peer speaks 3 ms after the wake-up.
    std::int64_t later = now + 1000 * kMs;
    ASSERT_FALSE(watch.Turn(later, deadline_ms * kMs)) << "one turn is no silence";
    ASSERT_FALSE(watch.Turn(later + kMs, deadline_ms * kMs));
    watch.Heard(later + 2 * kMs);
    ASSERT_FALSE(watch.Turn(later + 3 * kMs, deadline_ms * kMs));
    // Now it is silent while the watcher turns.
    now = later + 3 * kMs;
    while (!watch.Turn(now, deadline_ms * kMs)) {
      now += kMs;
      ASSERT_LT(now, later + 200 * kMs);
    }
    const std::int64_t silent_ms = (now - (later + 2 * kMs)) / kMs;
    EXPECT_GE(silent_ms, deadline_ms);
    EXPECT_LE(silent_ms, deadline_ms + 2);
    EXPECT_GT(last, 0);
  }
}

TEST(SilenceWatchLaw, NewsThatAlwaysComesLateIsNoNews) {
  constexpr std::int64_t kMs = 1'000'000;
  SilenceWatch watch(kMs);
  bool lost = false;
  for (std::int64_t now = 1000 * kMs; now < 1200 * kMs; now += kMs) {
    watch.Heard(now - 30 * kMs);
    lost = watch.Turn(now, 20 * kMs) || lost;
  }
  EXPECT_TRUE(lost);
}

TEST(LoopWatchLaw, SaysTooManyExactlyWhenSoManyOfTheNewestWereLate) {
  constexpr std::int64_t kPeriod_ns = 1'000'000;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Dice dice(seed);
    const int window = 1 + dice.Below(120), allowed = dice.Below(20);
    LoopWatch watch(kPeriod_ns, static_cast<std::uint32_t>(window), allowed);
    std::vector<int> late;
    std::int64_t now_ns = 5'000'000;
    EXPECT_FALSE(watch.Turn(now_ns)) << "the first cycle is not late";
    for (int i = 0; i < 2000; ++i) {
      late.push_back(dice.Below(8) == 0 ? 1 : 0);
      now_ns += late.back() != 0 ? kPeriod_ns * 3 / 2 + 1 : kPeriod_ns * 3 / 2;
      const auto newest = late.end() - std::min<std::ptrdiff_t>(window, std::ssize(late));
      ASSERT_EQ(watch.Turn(now_ns), std::accumulate(newest, late.end(), 0) > allowed) << seed << ' ' << i;
    }
    EXPECT_EQ(watch.overruns(), std::accumulate(late.begin(), late.end(), 0u));
  }
}

TEST(RingLaw, GivesWhatWasPutInOrderAndTakesNoMoreThanItHolds) {
  Dice dice(3);
  Ring<int, 7> ring;
  std::deque<int> model;
  for (int i = 0; i < 20000; ++i) {
    if (dice.Below(2) == 0) {
      ASSERT_EQ(ring.Put(i), model.size() < 7);
      model.size() < 7 ? model.push_back(i) : void();
    } else {
      const std::optional<int> taken = ring.Take();
      ASSERT_EQ(taken, model.empty() ? std::nullopt : std::optional(model.front()));
      model.empty() ? void() : model.pop_front();
    }
    ASSERT_EQ(ring.empty(), model.empty());
  }
  ring.Clear();
  EXPECT_TRUE(ring.empty());
}

TEST(CommandReceiver, ObeysEachCommandOnceInTimeAndAStopHoweverOld) {
  CommandReceiver receiver(kTargetDrive, 1000);
  CommandReceipt receipt;
  int obeyed = 0;
  const auto tell = [&](std::uint64_t number, Verb verb, std::int64_t made_ns, std::uint32_t target,
                        ModuleReason answer = ModuleReason::kNone) {
    ModuleCommand command;
    command.header = {9, number, made_ns};
    command.target = target;
    command.verb = verb;
    receiver.Take(command, 10'000, receipt, [&](const ModuleCommand&) { return ++obeyed, answer; });
    return receipt.sequence_number == number;
  };
  EXPECT_FALSE(tell(1, Verb::kHold, 9'500, kTargetMainMotion)) << "not for this module";
  EXPECT_TRUE(tell(2, Verb::kHold, 9'500, kTargetDrive | kTargetMainMotion));
  EXPECT_EQ(receipt.answer, CommandAnswer::kDone);
  tell(2, Verb::kHold, 9'500, kTargetDrive);
  EXPECT_EQ(obeyed, 1) << "repeated";
  EXPECT_EQ(receiver.dropped(), 1u);
  EXPECT_TRUE(tell(3, Verb::kHold, 8'999, kTargetDrive));
  EXPECT_EQ(receipt.reason, ModuleReason::kStaleCommand);
  EXPECT_EQ(obeyed, 1);
  EXPECT_TRUE(tell(4, Verb::kStop, 0, kTargetDrive));
  EXPECT_EQ(receipt.answer, CommandAnswer::kDone);
  EXPECT_TRUE(tell(5, Verb::kResume, 9'500, kTargetDrive, ModuleReason::kWrongMode));
  EXPECT_EQ(receipt.answer, CommandAnswer::kRefused);
  EXPECT_EQ(receipt.reason, ModuleReason::kWrongMode);
}

}  // namespace
}  // namespace lambdajet::drive
