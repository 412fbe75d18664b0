#include "sweep/clock.h"

#include <random>
#include <stdexcept>

#include <gtest/gtest.h>

#include "support/parameters.h"

namespace sinerig {
namespace {

__extension__ using Wide = unsigned __int128;

class TickGridAt : public testing::TestWithParam<std::uint64_t> {};  // millihertz

TEST_P(TickGridAt, TellsTheTimeOfAnyTickToTheNanosecond) {
  const TickGrid grid{static_cast<double>(GetParam()) / 1000.0};
  std::mt19937_64 random{test::seed(3)};
  for (std::uint64_t i = 0; i < test::count(20'000); ++i) {
    const std::uint64_t index = random() >> (20 + random() % 44);
    const Wide exact_ns = Wide{index} * 1'000'000'000'000 / GetParam();
    if (exact_ns > (Wide{1} << 62)) continue;
    ASSERT_EQ(grid.time_ns(index), static_cast<std::int64_t>(exact_ns)) << index;
  }
}

TEST_P(TickGridAt, FindsTheTickOfAnyTime) {
  const TickGrid grid{static_cast<double>(GetParam()) / 1000.0};
  std::mt19937_64 random{test::seed(4)};
  for (std::uint64_t i = 0; i < test::count(20'000); ++i) {
    const std::uint64_t index = random() % 1'000'000'000;
    if (Wide{index} * 1'000'000'000'000 / GetParam() > (Wide{1} << 62)) continue;
    const std::int64_t begins_ns = grid.time_ns(index);
    ASSERT_EQ(grid.index_at(begins_ns), index);
    ASSERT_EQ(grid.index_at(grid.time_ns(index + 1) - 1), index);
    if (index > 0) {
      ASSERT_EQ(grid.index_at(begins_ns - 1), index - 1);
    }
  }
}

TEST_P(TickGridAt, KnowsItsRateAndPeriod) {
  const double rate_hz = static_cast<double>(GetParam()) / 1000.0;
  const TickGrid grid{rate_hz};
  EXPECT_EQ(grid.rate_hz(), rate_hz);
  EXPECT_DOUBLE_EQ(grid.period_s(), 1.0 / rate_hz);
}

INSTANTIATE_TEST_SUITE_P(Rates, TickGridAt,
                         testing::Values(100, 333, 1'000, 44'100'000, 48'001, 1'000'000, 3'000'000,
                                         7'777'777, 22'050'000, 99'999'999, 100'000'000));

TEST(TickGrid, RefusesRatesOutsideOfItsBounds) {
  for (const double rate_hz : {0.0, -1.0, 0.0999, 100'000.001, std::nan("")}) {
    try {
      const TickGrid grid{rate_hz};
      FAIL() << rate_hz;
    } catch (const std::invalid_argument& refused) {
      EXPECT_STREQ(refused.what(), "the loop rate must be between 0.1 Hz and 100 kHz");
    }
  }
}

TEST(TickGrid, RefusesRatesOffTheMillihertzGrid) {
  try {
    const TickGrid grid{1000.0 / 3.0};
    FAIL();
  } catch (const std::invalid_argument& refused) {
    EXPECT_STREQ(refused.what(), "the loop rate must be a whole number of millihertz");
  }
}

TEST(VirtualClock, CountsTicksOnTimeFromZero) {
  VirtualClock clock{TickGrid{3000.0}};
  EXPECT_EQ(clock.now().tick, 0U);
  for (std::uint64_t index = 0; index < 10; ++index) {
    const Tick tick = clock.wait();
    EXPECT_EQ(tick.index, index);
    EXPECT_EQ(tick.lateness.count(), 0);
    EXPECT_EQ(clock.now().tick, index);
    EXPECT_EQ(clock.time_ns(clock.now()), clock.grid().time_ns(index));
  }
}

TEST(MonotonicClock, StaysAtTheFirstTickUntilItIsWaitedFor) {
  const MonotonicClock clock{TickGrid{1000.0}};
  EXPECT_EQ(clock.now().tick, 0U);
  EXPECT_EQ(clock.now().offset_ns, 0);
}

// Asserts on the grid, not on how punctual this machine is.
TEST(MonotonicClock, NeverReturnsBeforeADeadlineAndReportsTheLatenessAgainstTheGrid) {
  MonotonicClock clock{TickGrid{3000.0}};
  EXPECT_EQ(clock.wait().index, 0U);
  std::uint64_t last = 0;
  for (int i = 0; i < 60; ++i) {
    const Tick tick = clock.wait();
    EXPECT_GT(tick.index, last);
    EXPECT_GE(tick.lateness.count(), 0);
    const Instant now = clock.now();
    EXPECT_EQ(now.tick, tick.index);
    EXPECT_GE(now.offset_ns, tick.lateness.count());
    last = tick.index;
  }
}

// An overrun made on purpose: whole periods are skipped, the grid is never re-based.
TEST(MonotonicClock, SkipsWholePeriodsAfterAnOverrunAndKeepsTheGrid) {
  MonotonicClock clock{TickGrid{10'000.0}};
  clock.wait();
  const std::int64_t origin_ns = clock.time_ns(Instant{});
  const Tick before = clock.wait();
  while (clock.now().offset_ns < 1'050'000) {
  }
  const Tick after = clock.wait();
  EXPECT_GE(after.index, before.index + 10);
  EXPECT_LT(after.lateness.count(), 100'000);
  EXPECT_EQ(clock.time_ns(Instant{}), origin_ns);
  EXPECT_EQ(clock.time_ns({.tick = after.index, .offset_ns = 0}),
            origin_ns + clock.grid().time_ns(after.index));
}

}  // namespace
}  // namespace sinerig
