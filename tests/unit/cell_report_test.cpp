#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "cell/core/report.hpp"

namespace lambdajet::cell {
namespace {

TEST(Percentile, IsAValueThatTheWantedShareDoesNotExceed) {
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal(0.0, 2.0);
  for (int size = 1; size < 200; ++size) {
    std::vector<double> values(static_cast<std::size_t>(size));
    std::generate(values.begin(), values.end(), [&] { return normal(random); });
    for (const double share : {0.01, 0.5, 0.95, 0.99, 1.0}) {
      const double found = Percentile(values, share);
      const auto below = std::count_if(values.begin(), values.end(), [&](double v) { return v <= found; });
      const auto strictly = std::count_if(values.begin(), values.end(), [&](double v) { return v < found; });
      EXPECT_GE(static_cast<double>(below), share * size - 1e-9);
      EXPECT_LT(static_cast<double>(strictly), share * size + 1e-9);
    }
  }
}

TEST(Percentile, OfNothingIsZero) { EXPECT_EQ(Percentile({}, 0.5), 0.0); }

TEST(DeviationSummary, LooksAtMagnitudesOfEventsInMotionOnly) {
  std::vector<EventDeviation> events;
  for (int i = 1; i <= 100; ++i) {
    events.push_back({0.0, 100.0, i % 2 == 0 ? 0.001 * i : -0.001 * i, 1e-5 * i});
  }
  events.push_back({0.0, 0.0, 50.0, 50.0});  // at standstill a deviation means nothing
  const DeviationSummary summary = Summarise(events);
  EXPECT_DOUBLE_EQ(summary.p50_mm, 0.050);
  EXPECT_DOUBLE_EQ(summary.p99_mm, 0.099);
  EXPECT_DOUBLE_EQ(summary.message_age_p99_s, 99e-5);
}

}  // namespace
}  // namespace lambdajet::cell
