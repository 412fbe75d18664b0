#include "drivers/can/time_stamps.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <random>

#include <gtest/gtest.h>

namespace sinerig::can {
namespace {

// An adapter whose counter began 3 s before the host's clock and runs 80 ppm fast, seen through
// delays of 150 us and more, as USB gives.
struct Adapter {
  double drift = 80e-6;
  double mean_delay_ns = 400'000.0;
  std::mt19937_64 random{7};

  std::int64_t counter_at(std::int64_t true_ns) const {
    return true_ns + 3'000'000'000 + std::llround(drift * static_cast<double>(true_ns));
  }
  std::int64_t seen_at(std::int64_t true_ns) {
    std::exponential_distribution<double> extra(1.0 / mean_delay_ns);
    return true_ns + 150'000 + std::llround(extra(random));
  }
};

TEST(CounterFit, FollowsOffsetAndDriftThroughRandomDelays) {
  Adapter adapter;
  CounterFit fit;
  double worst_ns = 0.0;
  for (std::int64_t frame = 0; frame < 60'000; ++frame) {
    const std::int64_t true_ns = frame * 1'000'000;
    const std::int64_t stamp_ns =
        fit.to_monotonic(adapter.counter_at(true_ns), adapter.seen_at(true_ns));
    if (frame < 20'000) continue;
    const auto error_ns = static_cast<double>(stamp_ns - true_ns) - 150'000.0;
    worst_ns = std::max(worst_ns, std::abs(error_ns));
  }
  EXPECT_LT(worst_ns, 5000.0) << "the delays themselves spread by 400 us";
}

TEST(CounterFit, IsNeverLaterThanTheFrameWasSeen) {
  Adapter adapter;
  CounterFit fit;
  for (std::int64_t frame = 0; frame < 5000; ++frame) {
    const std::int64_t true_ns = frame * 1'000'000;
    const std::int64_t seen_ns = adapter.seen_at(true_ns);
    ASSERT_LE(fit.to_monotonic(adapter.counter_at(true_ns), seen_ns), seen_ns);
  }
}

// Adapters set their counters by the wall clock when the interface comes up: a few hours of drift
// are some 0.1 s.
TEST(CounterFit, BeginsAnewWhenTheCounterIsReset) {
  for (const double jump_s : {-7.0, 0.3, 0.03, 5.0}) {
    Adapter adapter;
    CounterFit fit;
    std::int64_t true_ns = 0;
    for (; true_ns < 5'000'000'000; true_ns += 1'000'000)
      fit.to_monotonic(adapter.counter_at(true_ns), adapter.seen_at(true_ns));
    const std::int64_t jump_ns = std::llround(jump_s * 1e9);
    for (std::int64_t end_ns = true_ns + 10'000'000'000; true_ns < end_ns; true_ns += 1'000'000) {
      const std::int64_t stamp_ns =
          fit.to_monotonic(adapter.counter_at(true_ns) + jump_ns, adapter.seen_at(true_ns));
      ASSERT_NEAR(static_cast<double>(stamp_ns), static_cast<double>(true_ns), 10e6) << jump_s;
    }
  }
}

// A counter that falls back by less than the time without frames looks like frames that are late.
TEST(CounterFit, BeginsAnewWhenEveryFrameComesLate) {
  for (const bool told : {false, true}) {
    Adapter adapter;
    CounterFit fit;
    std::int64_t true_ns = 0;
    for (; true_ns < 5'000'000'000; true_ns += 1'000'000)
      fit.to_monotonic(adapter.counter_at(true_ns), adapter.seen_at(true_ns));
    if (told) fit.restart();
    true_ns += 2'000'000'000;
    const std::int64_t known_ns = true_ns + (told ? 0 : 250'000'000);
    for (std::int64_t end_ns = true_ns + 10'000'000'000; true_ns < end_ns; true_ns += 1'000'000) {
      const std::int64_t stamp_ns =
          fit.to_monotonic(adapter.counter_at(true_ns) - 288'000'000, adapter.seen_at(true_ns));
      if (true_ns < known_ns) continue;
      ASSERT_NEAR(static_cast<double>(stamp_ns), static_cast<double>(true_ns), 10e6) << told;
    }
  }
}

// What the fit is for: a host that was busy hands over many late frames at once.
TEST(CounterFit, KeepsItsLineWhileTheHostIsBusy) {
  Adapter adapter;
  CounterFit fit;
  std::int64_t true_ns = 0;
  for (; true_ns < 20'000'000'000; true_ns += 1'000'000)
    fit.to_monotonic(adapter.counter_at(true_ns), adapter.seen_at(true_ns));
  const std::int64_t handed_over_ns = true_ns + 150'000'000;
  for (; true_ns < handed_over_ns; true_ns += 1'000'000) {
    const std::int64_t stamp_ns = fit.to_monotonic(adapter.counter_at(true_ns), handed_over_ns);
    ASSERT_LE(std::abs(static_cast<double>(stamp_ns - true_ns) - 150'000.0), 5000.0 + 150'000.0);
  }
}

TEST(TimeStamps, OffsetToTheWallClockIsRepeatable) {
  const std::int64_t first_ns = realtime_offset_ns();
  const std::int64_t second_ns = realtime_offset_ns();
  EXPECT_LT(std::abs(second_ns - first_ns), 1'000'000'000);
  EXPECT_GT(first_ns, 0) << "the wall clock began before the machine did";
}

}  // namespace
}  // namespace sinerig::can
