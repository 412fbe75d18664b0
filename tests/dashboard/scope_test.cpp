#include "dashboard/scope.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

namespace sinerig::dashboard {
namespace {

constexpr double rate_hz = 1000.0;

class ScopeTest : public testing::Test {
 protected:
  static GuardSettings limits() {
    GuardSettings settings;
    settings.command_min = -1.0;
    settings.command_max = 1.0;
    settings.channels = {{.min = -unlimited, .max = 4.0, .rate_per_s = 100.0}};
    return settings;
  }

  // Command 0.5 sin, applied the same, sensor 2 sin of `frequency_hz`.
  void play(double frequency_hz, std::uint64_t ticks) {
    for (std::uint64_t i = 0; i < ticks; ++i, ++tick_) {
      const double sine =
          std::sin(2.0 * std::numbers::pi * frequency_hz * static_cast<double>(tick_) / rate_hz);
      TickSamples samples{.tick = tick_, .dwell = 0, .channels = 3};
      samples.values[0] = samples.values[1] = 0.5 * sine;
      samples.values[2] = 2.0 * sine;
      scope_.add(samples);
    }
  }

  std::uint64_t tick_ = 0;
  Scope scope_{3, limits(), {"command", "applied", "gyro"}, {"V", "V", "rad/s"}, rate_hz};
};

TEST_F(ScopeTest, KeepsTwoCyclesOldestFirst) {
  scope_.start(10.0);
  play(10.0, 1234);
  const Scope::Trace trace = scope_.trace();
  EXPECT_NEAR(trace.step_s * static_cast<double>(trace.channels[2].size()), 0.2, 1e-9);
  const double newest_s = 1233.0 / rate_hz;
  const auto size = static_cast<double>(trace.channels[2].size());
  for (std::size_t i = 0; i < trace.channels[2].size(); ++i) {
    const double at_s = newest_s - (size - 1.0 - static_cast<double>(i)) * trace.step_s;
    EXPECT_NEAR(trace.channels[2][i], 2.0 * std::sin(2.0 * std::numbers::pi * 10.0 * at_s), 1e-9);
  }
}

TEST_F(ScopeTest, ThinsOutSlowSinesAndKeepsEnoughOfFastOnes) {
  scope_.start(0.01);
  play(0.01, 300000);
  EXPECT_LE(scope_.trace().channels[0].size(), Scope::most_samples);
  scope_.start(400.0);
  play(400.0, 500);
  EXPECT_EQ(scope_.trace().channels[0].size(), Scope::least_samples);
}

TEST_F(ScopeTest, TellsHowFarTheLimitsAreUsed) {
  scope_.start(5.0);
  EXPECT_TRUE(std::isnan(scope_.headroom().front().used()));
  play(5.0, 1000);
  ASSERT_EQ(scope_.headroom().size(), 3U);
  EXPECT_EQ(scope_.headroom()[0].name, "command");
  EXPECT_NEAR(scope_.headroom()[0].used(), 0.5, 1e-6);
  EXPECT_EQ(scope_.headroom()[1].name, "gyro");
  EXPECT_NEAR(scope_.headroom()[1].used(), 0.5, 1e-6);
  EXPECT_EQ(scope_.headroom()[2].name, "gyro rate");
  EXPECT_EQ(scope_.headroom()[2].unit, "rad/s/s");
  EXPECT_NEAR(scope_.headroom()[2].used(), 0.628, 1e-3);
}

}  // namespace
}  // namespace sinerig::dashboard
