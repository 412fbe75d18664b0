// Every way out of the loop leaves the actuator released, and says why in the records.
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "support/guarded_bench.h"
#include "sweep/outbox.h"

namespace sinerig {
namespace {

using test::GuardedBench;

struct ExitPath {
  const char* name;
  void (*arrange)(GuardedBench&);
  TripCause cause;
};

void reads_at_tick_100(GuardedBench& bench, double value) {
  bench.sensor.value = [=](std::uint64_t tick) {
    return tick == 100 ? value : GuardedBench::reading;
  };
}

class EveryExitPath : public testing::TestWithParam<ExitPath> {};

TEST_P(EveryExitPath, ReleasesTheActuatorAndRecordsTheReason) {
  GuardedBench bench;
  bench.settings.stop_ramp_ticks = 12;
  GetParam().arrange(bench);
  const RunOutcome outcome = bench.run();

  EXPECT_EQ(outcome.trip.cause, GetParam().cause);
  EXPECT_TRUE(bench.actuator.released);
  EXPECT_EQ(bench.actuator.releases, 1);
  EXPECT_EQ(bench.actuator.last, GuardedBench::neutral);

  const auto& events = bench.sink.records.events;
  ASSERT_GE(events.size(), 3U);
  EXPECT_EQ(events.front().kind, EventKind::started);
  EXPECT_EQ(events.back().kind, EventKind::finished);
  EXPECT_EQ(events[events.size() - 2].kind, EventKind::released);
  const bool tripped = GetParam().cause != TripCause::none;
  EXPECT_EQ(events[events.size() - 3].kind == EventKind::tripped, tripped);

  ASSERT_EQ(bench.sink.records.points.size(), 1U);
  const Point& point = bench.sink.records.points[0];
  EXPECT_EQ(point.status == PointStatus::stopped, tripped);
  EXPECT_EQ(point.reason == PointReason::guard_trip, tripped);
  if (tripped) {
    EXPECT_EQ(events[events.size() - 3].trip.cause, GetParam().cause);
    EXPECT_NEAR(bench.actuator.writes.back().command, GuardedBench::neutral, 1e-15);
  }
}

INSTANTIATE_TEST_SUITE_P(
    Paths, EveryExitPath,
    testing::Values(
        ExitPath{"TheNormalEnd", [](GuardedBench&) {}, TripCause::none},
        ExitPath{"AChannelLimit",
                 [](GuardedBench& bench) {
                   bench.settings.channels[0].max = 1.0;
                   reads_at_tick_100(bench, 1.5);
                 },
                 TripCause::channel_limit},
        ExitPath{"NotANumber",
                 [](GuardedBench& bench) {
                   reads_at_tick_100(bench, std::numeric_limits<double>::quiet_NaN());
                 },
                 TripCause::channel_not_finite},
        ExitPath{"Infinity",
                 [](GuardedBench& bench) {
                   reads_at_tick_100(bench, std::numeric_limits<double>::infinity());
                 },
                 TripCause::channel_not_finite},
        ExitPath{"StaleData",
                 [](GuardedBench& bench) {
                   bench.settings.max_age_ns = 10'000'000;
                   bench.sensor.fault_at = [](std::uint64_t tick) {
                     return tick >= 100 ? Fault::stale : Fault::none;
                   };
                 },
                 TripCause::channel_age},
        ExitPath{"ASensorWithoutABus",
                 [](GuardedBench& bench) {
                   bench.settings.max_age_ns = 10'000'000;
                   bench.sensor.fault_at = [](std::uint64_t) {
                     return Fault::bus;
                   };
                 },
                 TripCause::channel_age},
        ExitPath{"AnActuatorWithoutABus",
                 [](GuardedBench& bench) {
                   bench.actuator.fault_at = [](std::uint64_t tick) {
                     return tick >= 100 ? Fault::bus : Fault::none;
                   };
                 },
                 TripCause::actuator_fault},
        ExitPath{"ACommandLimit", [](GuardedBench& bench) { bench.settings.command_max = 0.5; },
                 TripCause::command_limit},
        ExitPath{"ASlewLimit", [](GuardedBench& bench) { bench.settings.slew_per_s = 50.0; },
                 TripCause::command_slew},
        ExitPath{"ARecorderThatFails", [](GuardedBench& bench) { bench.sink.stalled_from = 100; },
                 TripCause::recorder_stalled},
        ExitPath{"AStopRequestBeforeTheFirstTick",
                 [](GuardedBench& bench) { bench.control.stop_requests = 1; },
                 TripCause::stop_requested},
        ExitPath{"AStopRequest",
                 [](GuardedBench& bench) {
                   bench.sensor.value = [&bench](std::uint64_t tick) {
                     if (tick == 100) bench.control.stop_requests = 1;
                     return GuardedBench::reading;
                   };
                 },
                 TripCause::stop_requested}),
    [](const auto& instance) { return std::string{instance.param.name}; });

TEST(LastTick, WithAViolationStillRampsAndReleases) {
  GuardedBench bench;
  bench.settings.stop_ramp_ticks = 5;
  const std::uint64_t last = bench.plan.min_samples() - 1;
  bench.sensor.value = [=](std::uint64_t tick) {
    return tick == last ? std::numeric_limits<double>::quiet_NaN() : GuardedBench::reading;
  };
  const RunOutcome outcome = bench.run();
  EXPECT_EQ(outcome.trip.cause, TripCause::channel_not_finite);
  EXPECT_EQ(bench.actuator.writes.size(), last + 1 + 5);
  EXPECT_TRUE(bench.actuator.released);
  EXPECT_EQ(bench.sink.records.points.at(0).status, PointStatus::stopped);
}

TEST(LastTick, WithAFailedRecorderIsReportedAndReleases) {
  GuardedBench bench;
  bench.sink.stalled_from = bench.plan.min_samples() - 1;
  const RunOutcome outcome = bench.run();
  EXPECT_EQ(outcome.trip.cause, TripCause::recorder_stalled);
  EXPECT_TRUE(bench.actuator.released);
  EXPECT_EQ(bench.actuator.last, GuardedBench::neutral);
}

// Nobody takes anything out of the queue until the loop has ended.
TEST(AFullQueue, StopsTheSweepAndLosesNoPointOrEvent) {
  GuardedBench bench;
  SweepSettings sweep;
  sweep.start_hz = 20.0;
  sweep.stop_hz = 100.0;
  sweep.points = 200;
  sweep.frequency_tolerance = 1e-6;
  sweep.amplitude = 0.1;
  bench.plan = plan_sweep(sweep, {}, GuardedBench::rate_hz);
  bench.settings.neutral = 0.0;
  bench.settings.stop_ramp_ticks = 8;
  Outbox outbox{64, 256, Outbox::WhenFull::keep};
  Guard guard{bench.settings, 1.0 / GuardedBench::rate_hz};
  Sensor* const sensors[] = {&bench.sensor};
  SweepRunner runner{
      bench.plan, {.record_samples = true}, bench.clock, bench.actuator, sensors, guard, outbox};
  const RunOutcome outcome = runner.run(bench.control);
  EXPECT_EQ(outcome.trip.cause, TripCause::recorder_stalled);
  EXPECT_TRUE(bench.actuator.released);
  EXPECT_GT(outbox.dropped_samples(), 0U);

  test::CollectingSink taken;
  Record record;
  for (bool more = true; more;) {
    more = false;
    while (outbox.try_take(record)) {
      more = true;
      if (const auto* samples = std::get_if<TickSamples>(&record)) {
        taken.put_sample(*samples);
      } else {
        taken.put(record);
      }
    }
    outbox.flush();
  }
  EXPECT_EQ(taken.points.size(), outcome.dwells_done + 1U);
  EXPECT_EQ(taken.timings.size(), taken.points.size());
  EXPECT_EQ(taken.points.back().status, PointStatus::stopped);
  const auto& events = taken.events;
  EXPECT_EQ(events.back().kind, EventKind::finished);
  EXPECT_EQ(events[events.size() - 3].trip.cause, TripCause::recorder_stalled);
  EXPECT_EQ(taken.samples.size() + outbox.dropped_samples(), outcome.ticks);
}

TEST(AStoppedDwell, KeepsTheBlocksThatItHadFinished) {
  GuardedBench bench;
  const Dwell& dwell = bench.plan.dwells[0];
  const std::uint64_t after_one_block = dwell.settle_samples + dwell.block_samples + 3;
  bench.sensor.value = [=](std::uint64_t tick) {
    return tick == after_one_block ? std::numeric_limits<double>::quiet_NaN()
                                   : GuardedBench::reading;
  };
  bench.run();
  const Point& point = bench.sink.records.points.at(0);
  EXPECT_GE(point.samples, dwell.block_samples);
  EXPECT_EQ(point.status, PointStatus::stopped);
  EXPECT_TRUE(std::isfinite(point.response.real()));
}

}  // namespace
}  // namespace sinerig
