#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <thread>

#include "tests/load/latency_histogram.hpp"
#include "tests/load/open_loop.hpp"

namespace lambdajet::load {
namespace {

TEST(LatencyHistogram, IsNeverTooGoodAndRightToTwoPercent) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> exponent(0.0, 10.5);
  LatencyHistogram histogram;
  std::vector<double> values;
  for (int i = 0; i < 20000; ++i) {
    const auto value = static_cast<std::int64_t>(std::pow(10.0, exponent(random)));
    values.push_back(static_cast<double>(value) * 1e-9);
    histogram.Record(value);
  }
  std::sort(values.begin(), values.end());
  for (const double share : {0.001, 0.1, 0.5, 0.9, 0.99, 0.999, 1.0}) {
    const auto rank = static_cast<std::size_t>(std::ceil(share * static_cast<double>(values.size()))) - 1;
    const double found = histogram.Percentile_s(share);
    EXPECT_GE(found, values[rank] * 0.9999999) << share;
    EXPECT_LE(found, values[std::min(rank + 2, values.size() - 1)] * 1.02 + 1e-9) << share;
  }
}

TEST(LatencyHistogram, AddsUp) {
  LatencyHistogram a;
  LatencyHistogram b;
  a.Record(100);
  b.Record(1'000'000);
  b.Record(2'000'000);
  a.Add(b);
  EXPECT_EQ(a.count(), 3U);
  EXPECT_NEAR(a.Percentile_s(0.5), 1e-3, 2e-5);
  EXPECT_NEAR(a.most_s(), 2e-3, 1e-9);
}

// A service that answers nothing for a while must show in the percentiles, although only one question met the pause.
TEST(OpenLoop, CountsTheWaitOfQuestionsThatWereDueDuringAPause) {
  const Measured measured = RunOpenLoop("pause", {1000.0, 0.5, 1000}, [](std::uint64_t n, auto answered) {
    if (n == 100) {
      const auto end = std::chrono::steady_clock::now() + std::chrono::milliseconds(200);
      while (std::chrono::steady_clock::now() < end) {
      }
    }
    answered(absl::OkStatus());
  });
  EXPECT_EQ(measured.latency.count(), 500U);
  EXPECT_GT(measured.latency.Percentile_s(0.8), 0.05);  // some 200 of 500 waited
  EXPECT_EQ(measured.error_count(), 0U);
}

TEST(OpenLoop, CountsTroubleByItsReasonAndWhatItCouldNotSend) {
  const Measured measured = RunOpenLoop("trouble", {2000.0, 0.1, 1000}, [](std::uint64_t n, auto answered) {
    answered(n % 4 == 0 ? absl::UnavailableError("gone") : absl::OkStatus());
  });
  EXPECT_EQ(measured.errors.at("UNAVAILABLE"), 50U);
  EXPECT_EQ(measured.latency.count(), 150U);

  std::vector<std::function<void(const absl::Status&)>> open;
  const Measured stuck = RunOpenLoop("stuck", {1000.0, 0.05, 10}, [&](std::uint64_t n, auto answered) {
    open.push_back(std::move(answered));
    if (n == 9) {
      std::thread([waiting = std::exchange(open, {})] {
        std::this_thread::sleep_for(std::chrono::milliseconds(100));
        for (const auto& answer : waiting) {
          answer(absl::OkStatus());
        }
      }).detach();
    }
  });
  EXPECT_EQ(stuck.errors.at("TOO_MANY_OUTSTANDING"), 40U);
}

}  // namespace
}  // namespace lambdajet::load
