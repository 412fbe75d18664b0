#include "drivers/can/time_stamps.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <random>
#include <utility>

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

// Frames every millisecond, seen 0.2 ms after they arrived; a wall clock that somebody sets.
struct Stamped {
  static constexpr std::int64_t wall_began_ns = 1'700'000'000'000'000'000;
  static constexpr std::int64_t delay_ns = 200'000;

  std::int64_t offset_ns = wall_began_ns;
  std::int64_t now_ns = 5'000'000'000;
  ArrivalTimes arrival_times{{.monotonic_ns = now_ns, .realtime_offset_ns = offset_ns}};

  Stamps stamps(bool by_adapter) const {
    return {.kernel_ns = now_ns + delay_ns + offset_ns,
            .adapter_ns = by_adapter ? now_ns + 3'000'000'000 : 0};
  }
  // What is said of a frame with these stamps that is received now.
  std::int64_t time_of(const Stamps& stamps) {
    return arrival_times.of(stamps, {.monotonic_ns = now_ns, .realtime_offset_ns = offset_ns});
  }
  // A frame, received half a millisecond later; its age in the end.
  std::int64_t error_of_a_frame(bool by_adapter) {
    const std::int64_t arrived_ns = now_ns + delay_ns;
    const Stamps given = stamps(by_adapter);
    now_ns += 500'000;
    const std::int64_t time_ns = time_of(given);
    arrival_times.queue_is_empty();
    now_ns += 500'000;
    return time_ns - arrived_ns;
  }
};

TEST(ArrivalTimes, AreTheKernelsStampsInMonotonicTime) {
  Stamped bus;
  for (int n = 0; n < 100; ++n) ASSERT_EQ(bus.error_of_a_frame(false), 0);
  bus.offset_ns += 300'000;
  EXPECT_EQ(bus.error_of_a_frame(false), 0) << "two readings may be that far apart";
}

TEST(ArrivalTimes, OutlastAStepOfTheWallClock) {
  for (const double step_s : {3600.0, -3600.0, 0.03, -0.03, 0.002}) {
    for (const bool by_adapter : {false, true}) {
      Stamped bus;
      for (int n = 0; n < 3000; ++n) bus.error_of_a_frame(by_adapter);
      // Two frames wait, one stamped by the clock as it was, one by the clock as it is.
      const std::int64_t first_ns = bus.now_ns + Stamped::delay_ns;
      const Stamps before = bus.stamps(by_adapter);
      bus.now_ns += 1'000'000;
      bus.offset_ns += std::llround(step_s * 1e9);
      const Stamps after = bus.stamps(by_adapter);
      bus.now_ns += 500'000;
      for (const auto& [stamps, arrived_ns] :
           {std::pair{before, first_ns}, std::pair{after, first_ns + 1'000'000}}) {
        const std::int64_t time_ns = bus.time_of(stamps);
        EXPECT_EQ(time_ns, by_adapter ? arrived_ns : bus.now_ns) << step_s;
      }
      bus.arrival_times.queue_is_empty();
      for (int n = 0; n < 3000; ++n)
        ASSERT_EQ(bus.error_of_a_frame(by_adapter), 0) << step_s << ' ' << n;
    }
  }
}

// A poll takes so many frames at most: the rest were stamped by the old clock, too.
TEST(ArrivalTimes, DoubtEveryFrameThatWaitedWhileTheClockWasSet) {
  Stamped bus;
  bus.error_of_a_frame(false);
  const Stamps waiting = bus.stamps(false);
  bus.offset_ns += 3'600'000'000'000;
  for (int n = 0; n < 1000; ++n) {
    bus.now_ns += 1'000;
    ASSERT_EQ(bus.time_of(waiting), bus.now_ns);
  }
}

TEST(ArrivalTimes, BeginWithTheClockAsItWasWhenTheSocketWasOpened) {
  Stamped bus;
  const Stamps waiting = bus.stamps(false);
  bus.now_ns += 1'000'000;
  bus.offset_ns += 30'000'000;
  EXPECT_EQ(bus.time_of(waiting), bus.now_ns);
}

TEST(ArrivalTimes, AreTheTimeOfReceiptWithoutAStamp) {
  Stamped bus;
  EXPECT_EQ(bus.time_of({}), bus.now_ns);
}

TEST(Clocks, AreReadTogether) {
  const auto wall_ns = [] {
    timespec time{};
    clock_gettime(CLOCK_REALTIME, &time);
    return std::int64_t{time.tv_sec} * 1'000'000'000 + time.tv_nsec;
  };
  const std::int64_t before_ns = monotonic_ns();
  const std::int64_t wall_before_ns = wall_ns();
  const Clocks clocks = read_clocks();
  const std::int64_t wall_after_ns = wall_ns();
  const std::int64_t after_ns = monotonic_ns();
  EXPECT_GE(clocks.monotonic_ns, before_ns);
  EXPECT_LE(clocks.monotonic_ns, after_ns);
  // Right to what the readings themselves took, however long that was.
  EXPECT_GE(clocks.realtime_offset_ns, wall_before_ns - after_ns);
  EXPECT_LE(clocks.realtime_offset_ns, wall_after_ns - before_ns);
}

}  // namespace
}  // namespace sinerig::can
