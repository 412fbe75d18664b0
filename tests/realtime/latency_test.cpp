// The bookkeeping of lateness; how punctual this machine is, is nobody's business here.
#include "realtime/latency.h"

#include <gmock/gmock.h>

namespace sinerig::realtime {
namespace {

using testing::ElementsAre;
using testing::Pair;

TEST(LatencyHistogram, KnowsItsQuantiles) {
  LatencyHistogram histogram;
  EXPECT_EQ(histogram.quantile_us(0.5), 0.0);
  for (std::int64_t us = 1; us <= 1000; ++us) histogram.add(us * 1000 + 999);
  EXPECT_EQ(histogram.count(), 1000U);
  EXPECT_EQ(histogram.quantile_us(0.5), 500.0);
  EXPECT_EQ(histogram.quantile_us(0.99), 990.0);
  EXPECT_EQ(histogram.quantile_us(0.999), 999.0);
  EXPECT_EQ(histogram.quantile_us(1.0), 1000.0);
  EXPECT_EQ(histogram.max_us(), 1000.999);
}

TEST(LatencyHistogram, KeepsWhatIsEarlyOrOffTheScale) {
  LatencyHistogram histogram;
  histogram.add(-5);
  histogram.add(400'000'000);
  EXPECT_THAT(histogram.filled_bins(), ElementsAre(Pair(0, 1), Pair(99'999, 1)));
  EXPECT_EQ(histogram.max_us(), 400'000.0);
}

TEST(LatencyHistogram, TakesTheBinsOfOthers) {
  LatencyHistogram one;
  one.add_bin(3, 7);
  one.add_bin(8, 0);
  LatencyHistogram both;
  both.add(5'000);
  both.merge(one);
  EXPECT_THAT(both.filled_bins(), ElementsAre(Pair(3, 7), Pair(5, 1)));
  EXPECT_EQ(both.count(), 8U);
  EXPECT_EQ(both.max_us(), 5.0);
}

TEST(Latency, CountsFromTheTimeThatWasAskedFor) {
  const TickGrid grid{1000.0};
  const auto after = [&](std::uint64_t index, std::int64_t lateness_ns) {
    return latency_ns(grid, 7, {.index = index, .lateness = std::chrono::nanoseconds{lateness_ns}});
  };
  EXPECT_EQ(after(8, 250'000), 250'000);
  EXPECT_EQ(after(11, 250'000), 3'250'000) << "three ticks were slept through";
}

TEST(WakeUps, AreAllCounted) {
  LoopThread thread{Settings{}};
  const WakeUps wake_ups = measure_wake_ups(thread, 2000.0, 200);
  EXPECT_EQ(wake_ups.latency.count(), 200U);
  EXPECT_GE(wake_ups.latency.max_us(), wake_ups.latency.quantile_us(0.5));
}

}  // namespace
}  // namespace sinerig::realtime
