// From a violation to a changed command: at most one tick, whatever is violated and whenever.
#include "sweep/guard.h"

#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>

#include <gmock/gmock.h>

#include "support/guarded_bench.h"
#include "support/parameters.h"

namespace sinerig {
namespace {

using test::GuardedBench;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double infinity = std::numeric_limits<double>::infinity();

struct Violation {
  TripCause cause;
  std::uint64_t last_planned;  // the last tick whose command is the planned one
  std::uint64_t tripped_at;
  bool at_once = false;
  bool soft = false;
};

// Sets one violation up at about `tick` and says what the guard has to make of it.
Violation violate(GuardedBench& bench, int kind, std::uint64_t tick, std::mt19937_64& random) {
  const auto between = [&](double low, double high) {
    return std::uniform_real_distribution<double>{low, high}(random);
  };
  const auto sensor_reads = [&bench, tick](double value) {
    bench.sensor.value = [=](std::uint64_t now) {
      return now >= tick ? value : GuardedBench::reading;
    };
  };
  const auto first_tick = [](const auto& violated) {
    std::uint64_t found = 1;
    while (!violated(found)) ++found;
    return found;
  };
  ChannelLimits& limits = bench.settings.channels[0];
  switch (kind) {
    case 0:
      limits.max = between(0.21, 5.0);
      sensor_reads(limits.max * between(1.0001, 10.0));
      return {TripCause::channel_limit, tick, tick};
    case 1:
      limits.min = between(-5.0, 0.19);
      sensor_reads(limits.min - between(0.0001, 10.0));
      return {TripCause::channel_limit, tick, tick};
    case 2: sensor_reads(nan); return {TripCause::channel_not_finite, tick, tick};
    case 3:
      sensor_reads(random() % 2 == 0 ? infinity : -infinity);
      return {TripCause::channel_not_finite, tick, tick};
    case 4:
      limits.rate_per_s = between(1.0, 100.0);
      sensor_reads(GuardedBench::reading + limits.rate_per_s * 1e-3 * between(1.001, 3.0));
      return {TripCause::channel_rate, tick, tick};
    case 5: {
      const std::uint64_t patience = 1 + random() % 5;
      bench.settings.max_age_ns = static_cast<std::int64_t>(patience) * 1'000'000;
      bench.sensor.fault_at = [=](std::uint64_t now) {
        return now >= tick ? Fault::stale : Fault::none;
      };
      return {TripCause::channel_age, tick + patience, tick + patience};
    }
    case 6: {
      bench.settings.max_write_faults = static_cast<std::uint32_t>(1 + random() % 3);
      bench.actuator.fault_at = [=](std::uint64_t now) {
        return now >= tick ? Fault::bus : Fault::none;
      };
      const std::uint64_t last = tick + bench.settings.max_write_faults - 1;
      return {TripCause::actuator_fault, last, last};
    }
    case 7: {
      bench.settings.command_max = between(0.2, 0.55);
      const std::uint64_t found = first_tick(
          [&](std::uint64_t at) { return bench.planned(at) > bench.settings.command_max; });
      return {TripCause::command_limit, found - 1, found};
    }
    case 8: {
      bench.settings.command_min = between(-0.35, 0.0);
      const std::uint64_t found = first_tick(
          [&](std::uint64_t at) { return bench.planned(at) < bench.settings.command_min; });
      return {TripCause::command_limit, found - 1, found};
    }
    case 9: {
      const double largest = bench.planned(1) - bench.planned(0);
      bench.settings.slew_per_s = largest * between(0.5, 0.99) * GuardedBench::rate_hz;
      return {TripCause::command_slew, 0, 1};
    }
    case 10: bench.sink.stalled_from = tick; return {TripCause::recorder_stalled, tick, tick};
    case 11: {
      limits.soft_max = between(0.21, 5.0);
      limits.soft_min = between(-5.0, 0.19);
      sensor_reads(random() % 2 == 0 ? limits.soft_max * between(1.0001, 10.0)
                                     : limits.soft_min - between(0.0001, 10.0));
      return {TripCause::channel_limit, tick, tick, false, true};
    }
    case 12: {
      // A constant velocity v behind the filter is v (1 − q^k) after k samples.
      const double velocity = between(1.0, 100.0);
      const auto samples = 1 + random() % 4;
      limits.derivative_filter_s = between(0.0, 0.01);
      const double q = limits.derivative_filter_s / (limits.derivative_filter_s + 1e-3);
      const double bound = velocity * (1.0 - std::pow(q, static_cast<double>(samples) - 0.5));
      const bool soft = random() % 2 == 0;
      (soft ? limits.velocity.soft : limits.velocity.hard) = bound;
      bench.sensor.value = [=](std::uint64_t now) {
        return GuardedBench::reading +
               (now < tick ? 0.0 : velocity * 1e-3 * static_cast<double>(now - tick + 1));
      };
      const std::uint64_t found = tick + samples - 1;
      return {TripCause::channel_velocity, found, found, false, soft};
    }
    case 13: {
      // A step of the velocity is v/T of acceleration; behind both filters T²/(T + τ)² of it.
      const double velocity = between(1.0, 100.0);
      limits.derivative_filter_s = between(0.0, 0.01);
      const double passed = std::pow(1e-3 / (limits.derivative_filter_s + 1e-3), 2.0);
      const bool soft = random() % 2 == 0;
      (soft ? limits.acceleration.soft : limits.acceleration.hard) =
          1e3 * velocity * passed * between(0.5, 0.999);
      bench.sensor.value = [=](std::uint64_t now) {
        return GuardedBench::reading +
               (now < tick ? 0.0 : velocity * 1e-3 * static_cast<double>(now - tick + 1));
      };
      return {TripCause::channel_acceleration, tick, tick, false, soft};
    }
    case 14: {
      const double bound = between(0.05, 0.35);
      const std::uint64_t lasting = random() % 3;
      const bool soft = random() % 2 == 0;
      (soft ? limits.following.soft : limits.following.hard) = bound;
      limits.following_ns = static_cast<std::int64_t>(lasting) * 1'000'000;
      const auto away = [&](std::uint64_t at) {
        return std::abs(bench.planned(at) - GuardedBench::reading) > bound;
      };
      std::uint64_t found = 0;
      for (std::uint64_t in_a_row = 0; in_a_row <= lasting; ++found)
        in_a_row = away(found) ? in_a_row + 1 : 0;
      --found;
      return {TripCause::following_error, found, found, false, soft};
    }
    case 15:
      limits.allowed = {0.0, GuardedBench::reading, 8.0};
      sensor_reads(between(1.0, 7.0));
      return {TripCause::channel_code, tick, tick};
    case 16: {
      const std::uint64_t patience = 1 + random() % 5;
      bench.settings.max_age_ns = 1'000'000'000;
      limits.max_age_ns = static_cast<std::int64_t>(patience) * 1'000'000;
      bench.sensor.fault_at = [=](std::uint64_t now) {
        return now >= tick ? Fault::timeout : Fault::none;
      };
      return {TripCause::channel_age, tick + patience, tick + patience};
    }
    case 17:
      bench.sensor.fault_at = [=](std::uint64_t now) {
        return now >= tick ? Fault::interlock : Fault::none;
      };
      return {TripCause::interlock_open, tick, tick};
    default: {
      const int requests = 1 + static_cast<int>(random() % 2);
      bench.sensor.value = [&bench, tick, requests](std::uint64_t now) {
        if (now == tick) bench.control.stop_requests = requests;
        return GuardedBench::reading;
      };
      return {TripCause::stop_requested, tick, tick + 1, requests > 1};
    }
  }
}

TEST(RandomViolations, ChangeTheCommandWithinATickRampItAndReleaseTheActuator) {
  const std::uint64_t first_seed = test::seed(1);
  for (std::uint64_t i = 0; i < test::count(10'000); ++i) {
    SCOPED_TRACE(testing::Message()
                 << "SINERIG_TEST_SEED=" << first_seed + i << " SINERIG_TEST_COUNT=1");
    std::mt19937_64 random{first_seed + i};
    constexpr double frequencies_hz[] = {20.0, 25.0, 40.0, 50.0, 62.5, 100.0};
    GuardedBench bench{frequencies_hz[random() % 6]};
    bench.settings.stop_ramp_ticks = random() % 3 == 0 ? 0 : random() % 40;
    const std::uint64_t tick = 1 + random() % (bench.plan.min_samples() - 8);
    bench.runner_settings.retry = {.soft = 0, .soft_in_all = 0, .soft_wait_s = 0.0};
    const Violation expected = violate(bench, static_cast<int>(random() % 19), tick, random);

    const RunOutcome outcome = bench.run();
    ASSERT_STREQ(to_string(outcome.trip.cause), to_string(expected.cause));
    ASSERT_EQ(outcome.trip.tick, expected.tripped_at);
    ASSERT_EQ(outcome.trip.soft, expected.soft);

    const std::uint64_t ramp =
        expected.at_once ? 1 : std::max<std::uint64_t>(1, bench.settings.stop_ramp_ticks);
    const auto& writes = bench.actuator.writes;
    ASSERT_EQ(writes.size(), expected.last_planned + 1 + ramp);
    for (std::uint64_t k = 0; k <= expected.last_planned; ++k) {
      ASSERT_NEAR(writes[k].command, bench.planned(k), 1e-12) << "tick " << k;
    }
    const double from = writes[expected.last_planned].command - GuardedBench::neutral;
    for (std::uint64_t k = 1; k <= ramp; ++k) {
      const double left = 1.0 - static_cast<double>(k) / static_cast<double>(ramp);
      ASSERT_NEAR(writes[expected.last_planned + k].command, GuardedBench::neutral + from * left,
                  1e-12);
    }
    ASSERT_EQ(outcome.trip.command, writes[expected.last_planned + 1].command);
    ASSERT_EQ(bench.actuator.last, GuardedBench::neutral);
    ASSERT_TRUE(bench.actuator.released);
  }
}

// What cannot come out of a plan, straight at the guard.
TEST(Guard, HoldsBackACommandThatIsNoNumber) {
  for (const double wanted : {nan, infinity, -infinity}) {
    Guard guard{{.command_min = -1.0, .command_max = 1.0, .neutral = 0.25, .channels = {}}, 1e-3};
    EXPECT_EQ(guard.admit(0.5, 0, 1), 0.5);
    EXPECT_EQ(guard.admit(wanted, 1, 1), 0.25);
    EXPECT_EQ(guard.trip().cause, TripCause::command_not_finite);
    EXPECT_TRUE(guard.finished());
  }
}

TEST(Guard, AllowsTheSlewOfAsManyTicksAsHavePassed) {
  Guard guard{{.slew_per_s = 100.0, .channels = {}}, 1e-3};
  EXPECT_EQ(guard.admit(0.1, 1, 1), 0.1);
  EXPECT_EQ(guard.admit(0.4, 4, 3), 0.4);
  EXPECT_FALSE(guard.trip().tripped());
  guard.admit(0.7, 6, 2);
  EXPECT_EQ(guard.trip().cause, TripCause::command_slew);
}

TEST(Guard, KeepsTheFirstCause) {
  Guard guard{{.stop_ramp_ticks = 10, .channels = {{.max = 1.0}}}, 1e-3};
  guard.admit(1.0, 0, 1);
  guard.stop(TripCause::stop_requested, 5);
  guard.observe(0, {.value = 2.0, .time_ns = 6}, 6, 6);
  EXPECT_EQ(guard.trip().cause, TripCause::stop_requested);
  EXPECT_EQ(guard.trip().tick, 5U);
}

TEST(Guard, CutsARampShortOnASecondRequest) {
  Guard guard{{.stop_ramp_ticks = 10, .channels = {}}, 1e-3};
  guard.admit(1.0, 0, 1);
  guard.stop(TripCause::stop_requested, 1);
  EXPECT_DOUBLE_EQ(guard.admit(1.0, 1, 1), 0.9);
  EXPECT_FALSE(guard.finished());
  guard.stop(TripCause::stop_requested, 2, true);
  EXPECT_EQ(guard.admit(1.0, 2, 1), 0.0);
  EXPECT_TRUE(guard.finished());
}

TEST(Guard, RampsOnTheGridThroughAGap) {
  Guard guard{{.stop_ramp_ticks = 10, .channels = {}}, 1e-3};
  guard.admit(1.0, 0, 1);
  guard.stop(TripCause::stop_requested, 1);
  EXPECT_DOUBLE_EQ(guard.admit(0.0, 1, 1), 0.9);
  EXPECT_DOUBLE_EQ(guard.admit(0.0, 7, 6), 0.3);
  EXPECT_DOUBLE_EQ(guard.admit(0.0, 40, 33), 0.0);
}

TEST(Guard, TakesASingleFaultyWriteForNoDeadActuator) {
  Guard guard{{.max_write_faults = 2, .channels = {}}, 1e-3};
  for (std::uint64_t tick = 0; tick < 100; ++tick) {
    guard.observe_write({.fault = tick % 2 == 0 ? Fault::bus : Fault::none}, tick);
  }
  EXPECT_FALSE(guard.trip().tripped());
}

TEST(Guard, TakesAnUnknownWriteForNeitherGoodNorFaulty) {
  Guard guard{{.max_write_faults = 2, .channels = {}}, 1e-3};
  guard.observe_write({.fault = Fault::bus}, 0);
  for (std::uint64_t tick = 1; tick < 100; ++tick)
    guard.observe_write({.fault = Fault::stale}, tick);
  EXPECT_FALSE(guard.trip().tripped());
  guard.observe_write({.fault = Fault::bus}, 100);
  EXPECT_EQ(guard.trip().cause, TripCause::actuator_fault);
}

TEST(Guard, StopsAtOnceWhereTheDeviceItselfReportsAFault) {
  Guard guard{{.max_write_faults = 50, .channels = {}}, 1e-3};
  guard.observe_write({.fault = Fault::device}, 3);
  EXPECT_EQ(guard.trip().cause, TripCause::actuator_fault);
  EXPECT_EQ(guard.admit(1.0, 4, 1), 0.0);
  EXPECT_EQ(describe(guard.trip(), {}),
            "the actuator reports a fault (tick 3; command changed to 0)");
}

TEST(Guard, WatchesASensorThatNeverAnswersFromTheFirstTick) {
  Guard guard{{.max_age_ns = 5'000'000, .channels = {{}}}, 1e-3};
  for (std::int64_t tick = 0; tick <= 6; ++tick) {
    EXPECT_FALSE(guard.trip().tripped()) << tick;
    guard.observe(0, {.fault = Fault::timeout}, (1000 + tick) * 1'000'000,
                  static_cast<std::uint64_t>(tick));
  }
  EXPECT_EQ(guard.trip().cause, TripCause::channel_age);
}

TEST(Guard, ToldNotToWatchTheAgeOrTheWritesDoesNot) {
  Guard guard{{.max_age_ns = 0, .max_write_faults = 0, .channels = {{}}}, 1e-3};
  for (std::uint64_t tick = 0; tick < 1000; ++tick) {
    guard.observe_write({.fault = Fault::bus}, tick);
    guard.observe(0, {.fault = Fault::stale}, static_cast<std::int64_t>(tick) * 1'000'000, tick);
  }
  EXPECT_FALSE(guard.trip().tripped());
}

TEST(Guard, LetsAHardLimitTakeThePlaceOfASoftOneOnTheSameRamp) {
  Guard guard{{.stop_ramp_ticks = 10, .channels = {{.max = 2.0, .soft_max = 1.0}}}, 1e-3};
  guard.admit(1.0, 0, 1);
  guard.observe(0, {.value = 1.5, .time_ns = 1}, 1, 1);
  EXPECT_TRUE(guard.trip().soft);
  EXPECT_DOUBLE_EQ(guard.admit(1.0, 2, 1), 0.9);
  guard.observe(0, {.value = 2.5, .time_ns = 2}, 2, 2);
  EXPECT_FALSE(guard.trip().soft);
  EXPECT_EQ(guard.trip().limit, 2.0);
  EXPECT_DOUBLE_EQ(guard.admit(1.0, 3, 1), 0.8);
  EXPECT_DOUBLE_EQ(guard.trip().command, 0.8);
  guard.observe(0, {.value = 1.5, .time_ns = 3}, 3, 3);
  EXPECT_EQ(guard.trip().limit, 2.0);
}

TEST(Guard, StopsALoopThatIsLaterThanAllowed) {
  Guard guard{{.max_lateness_ns = 500'000, .channels = {}}, 1e-3};
  guard.observe_lateness(500'000, 6);
  EXPECT_FALSE(guard.trip().tripped());
  guard.observe_lateness(620'000, 7);
  EXPECT_EQ(guard.admit(1.0, 7, 1), 0.0);
  EXPECT_EQ(describe(guard.trip(), {}),
            "the loop was 0.00062 s late, its limit is 0.0005 s (tick 7; command changed to 0)");
}

TEST(Guard, BeginsAnewAtNeutralAfterAStop) {
  Guard guard{{.slew_per_s = 100.0, .channels = {{.rate_per_s = 1.0}}}, 1e-3};
  guard.observe(0, {.value = 5.0, .time_ns = 1}, 1, 1);
  guard.observe_write({.fault = Fault::device}, 2);
  guard.admit(0.05, 3, 1);
  ASSERT_TRUE(guard.finished());
  guard.resume();
  EXPECT_FALSE(guard.trip().tripped());
  guard.observe(0, {.value = 9.0, .time_ns = 9}, 9, 9);
  EXPECT_EQ(guard.admit(0.1, 10, 1), 0.1);
  EXPECT_FALSE(guard.trip().tripped());
}

TEST(Guard, RefusesSettingsThatCannotBeMeant) {
  const auto message_of = [](const GuardSettings& settings) -> std::string {
    try {
      const Guard guard{settings, 1e-3};
    } catch (const std::invalid_argument& refused) {
      return refused.what();
    }
    return "";
  };
  EXPECT_EQ(message_of({.command_min = 0.5, .command_max = 1.0, .channels = {}}),
            "the neutral command must lie between command_min and command_max");
  EXPECT_EQ(message_of({.neutral = nan, .channels = {}}),
            "the neutral command must lie between command_min and command_max");
  const std::string window = "a channel's window must have min < max and a rate above 0";
  EXPECT_EQ(message_of({.channels = {{.min = 1.0, .max = 1.0}}}), window);
  EXPECT_EQ(message_of({.channels = {{.rate_per_s = 0.0}}}), window);
  EXPECT_EQ(message_of({.channels = {{.max = nan}}}), window);
  EXPECT_EQ(message_of({.channels = {{.soft_min = 2.0, .soft_max = 1.0}}}),
            "a channel's soft window must have min < max");
}

struct Description {
  Trip trip;
  const char* text;
};

class TripDescription : public testing::TestWithParam<Description> {};

TEST_P(TripDescription, SaysWhatWasSeenWhatIsAllowedAndWhatWasDone) {
  EXPECT_EQ(describe(GetParam().trip, {"encoder", "gyro"}), GetParam().text);
}

INSTANTIATE_TEST_SUITE_P(
    Causes, TripDescription,
    testing::Values(
        Description{{}, "no trip"},
        Description{{.cause = TripCause::stop_requested, .tick = 7},
                    "stop requested (tick 7; command changed to 0)"},
        Description{{.cause = TripCause::channel_limit,
                     .channel = 1,
                     .value = 3.2,
                     .limit = 3.0,
                     .tick = 812,
                     .command = 0.5},
                    "gyro = 3.2 is outside its limit 3 (tick 812; command changed to 0.5)"},
        Description{{.cause = TripCause::channel_rate, .value = 70.0, .limit = 50.0},
                    "encoder changes by 70 per second, its limit is 50 (tick 0; command changed to "
                    "0)"},
        Description{{.cause = TripCause::channel_not_finite, .channel = 0},
                    "encoder is not a finite number (tick 0; command changed to 0)"},
        Description{{.cause = TripCause::channel_age, .channel = 1, .value = 0.101, .limit = 0.1},
                    "gyro has had no good sample for 0.101 s, its limit is 0.1 s (tick 0; command "
                    "changed to 0)"},
        Description{{.cause = TripCause::command_limit, .value = 0.6, .limit = 0.5},
                    "a command of 0.6 is outside its limit 0.5 (tick 0; command changed to 0)"},
        Description{{.cause = TripCause::command_slew, .value = 0.6, .limit = 0.5},
                    "a command step of 0.6 exceeds the slew limit of 0.5 per tick (tick 0; command "
                    "changed to 0)"},
        Description{{.cause = TripCause::command_not_finite},
                    "the command is not a finite number (tick 0; command changed to 0)"},
        Description{{.cause = TripCause::actuator_fault, .value = 2.0, .limit = 2.0},
                    "2 faulty writes to the actuator in a row (limit 2) (tick 0; command changed "
                    "to 0)"},
        Description{{.cause = TripCause::channel_limit,
                     .soft = true,
                     .channel = 1,
                     .value = 3.2,
                     .limit = 3.0,
                     .tick = 812,
                     .command = 0.5},
                    "gyro = 3.2 is outside its soft limit 3 (tick 812; command changed to 0.5)"},
        Description{{.cause = TripCause::channel_velocity, .value = 70.0, .limit = 50.0},
                    "encoder moves at 70 per second, its limit is 50 (tick 0; command changed to "
                    "0)"},
        Description{
            {.cause = TripCause::channel_acceleration, .soft = true, .value = 70.0, .limit = 50.0},
            "encoder accelerates by 70 per second squared, its soft limit is 50 (tick 0; "
            "command changed to 0)"},
        Description{{.cause = TripCause::following_error, .value = 0.2, .limit = 0.1},
                    "encoder is 0.2 away from what was applied, its limit is 0.1 (tick 0; command "
                    "changed to 0)"},
        Description{{.cause = TripCause::channel_code, .channel = 1, .value = 7.0},
                    "gyro = 7 is none of its allowed values (tick 0; command changed to 0)"},
        Description{{.cause = TripCause::recorder_stalled},
                    "the recorder no longer takes points (tick 0; command changed to 0)"}));

}  // namespace
}  // namespace sinerig
