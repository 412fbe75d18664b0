#include "dashboard/scope.h"

#include <cmath>
#include <numbers>
#include <optional>
#include <stdexcept>

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
  // One limit only: what is left of the way to it.
  EXPECT_TRUE(std::isnan(scope_.headroom()[1].used()));
  EXPECT_NEAR(scope_.headroom()[1].left(), 2.0, 1e-6);
  EXPECT_EQ(scope_.headroom()[2].name, "gyro rate");
  EXPECT_EQ(scope_.headroom()[2].unit, "rad/s/s");
  EXPECT_NEAR(scope_.headroom()[2].used(), 0.628, 1e-3);
}

// A supply that must not fall below 20 V.
TEST(Headroom, HasNoPartOfASingleLimit) {
  Headroom row;
  row.min = 20.0;
  row.seen = true;
  row.low = row.high = 24.0;
  EXPECT_TRUE(std::isnan(row.used()));
  EXPECT_DOUBLE_EQ(row.left(), 4.0);
  row.low = 18.0;
  EXPECT_DOUBLE_EQ(row.left(), -2.0);
}

// A sine of 2 at 5 Hz, which is new in every fifth tick only, 300 µs after it, and held between.
class SlowSensor : public testing::Test {
 protected:
  static constexpr std::int32_t delay_ns = 300'000;
  static constexpr double omega = 2.0 * std::numbers::pi * 5.0;

  static double at(double time_s) { return 2.0 * std::sin(omega * time_s); }

  // Tells the scope and, where there is one, the guard; true when that has tripped.
  bool play(const ChannelLimits& limits) {
    GuardSettings settings;
    settings.channels = {limits};
    Guard guard{settings, 1.0 / rate_hz};
    scope_.emplace(3U, settings, names_, units_, rate_hz);
    scope_->start(5.0);
    double held = 0.0;
    for (std::uint64_t tick = 0; tick < 1000 && !guard.trip().tripped(); ++tick) {
      const std::int64_t tick_ns = static_cast<std::int64_t>(tick) * 1'000'000;
      const double applied = 0.5 * std::sin(omega * static_cast<double>(tick) / rate_hz);
      const bool fresh = tick % 5 == 0;
      if (fresh) held = at(1e-9 * static_cast<double>(tick_ns + delay_ns));
      guard.observe_write({.value = applied, .time_ns = tick_ns, .fault = Fault::none}, tick);
      guard.observe(0,
                    {.value = held,
                     .time_ns = tick_ns + delay_ns,
                     .fault = fresh ? Fault::none : Fault::stale},
                    tick_ns + delay_ns, tick);
      TickSamples samples{.tick = tick, .dwell = 0, .channels = 3};
      samples.values[0] = samples.values[1] = applied;
      samples.values[2] = held;
      samples.offset_ns[2] = delay_ns;
      samples.missing = fresh ? 0U : 1U << 2U;
      scope_->add(samples);
    }
    return guard.trip().tripped();
  }

  const Headroom& row(const std::string& name) const {
    for (const Headroom& each : scope_->headroom())
      if (each.name == name) return each;
    throw std::runtime_error(name);
  }

  // The largest of a quantity that the page shows must be what the guard acts on.
  void expect_as_guarded(const std::string& name, double ChannelLimits::*limit) {
    expect_as_guarded(name, [&](ChannelLimits& limits) -> double& { return limits.*limit; });
  }
  void expect_as_guarded(const std::string& name, Bound ChannelLimits::*bound) {
    expect_as_guarded(name, [&](ChannelLimits& limits) -> double& { return (limits.*bound).hard; });
    expect_as_guarded(name + ", soft",
                      [&](ChannelLimits& limits) -> double& { return (limits.*bound).soft; });
  }
  template <typename Select>
  void expect_as_guarded(const std::string& name, Select select) {
    ChannelLimits limits;
    limits.derivative_filter_s = 0.01;
    select(limits) = 1e9;
    ASSERT_FALSE(play(limits)) << name;
    const double largest = std::max(row(name).high, -row(name).low);
    select(limits) = largest * (1.0 + 1e-6);
    EXPECT_FALSE(play(limits)) << name;
    select(limits) = largest * (1.0 - 1e-6);
    EXPECT_TRUE(play(limits)) << name;
  }

  std::vector<std::string> names_{"command", "applied", "gyro"};
  std::vector<std::string> units_{"V", "V", "rad/s"};
  std::optional<Scope> scope_;
};

TEST_F(SlowSensor, UsesWhatTheGuardGoesBy) {
  expect_as_guarded("gyro", &ChannelLimits::max);
  expect_as_guarded("gyro, soft", &ChannelLimits::soft_max);
  expect_as_guarded("gyro rate", &ChannelLimits::rate_per_s);
  expect_as_guarded("gyro velocity", &ChannelLimits::velocity);
  expect_as_guarded("gyro acceleration", &ChannelLimits::acceleration);
  expect_as_guarded("gyro following error", &ChannelLimits::following);
}

// Held values and the time they really took: 2ω = 62.8/s, not the five-fold of a leap in one tick.
TEST_F(SlowSensor, HasTheRateOfTheRig) {
  ChannelLimits limits;
  limits.rate_per_s = 100.0;
  ASSERT_FALSE(play(limits));
  EXPECT_NEAR(row("gyro rate").used(), 0.628, 5e-3);
}

TEST_F(SlowSensor, TellsHowLongAFollowingErrorMayLast) {
  ChannelLimits limits;
  limits.following.hard = 0.1;
  limits.following_ns = 2'000'000'000;
  ASSERT_FALSE(play(limits));
  EXPECT_TRUE(std::isnan(row("gyro following error").used())) << "above it is no violation yet";
  EXPECT_GT(row("gyro following error").high, 0.1);
  EXPECT_EQ(row("gyro following error").lasting_s, 2.0);
}

}  // namespace
}  // namespace sinerig::dashboard
