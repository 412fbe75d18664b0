// The loop under a scripted clock that loses ticks: whole periods are skipped, phase is kept, a
// block with a gap is void, and the result is as exact as without.
#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <utility>

#include <gtest/gtest.h>

#include "support/exactness.h"
#include "support/fake_rig.h"

namespace sinerig {
namespace {

constexpr double rate_hz = 1000.0;

struct GapRun {
  test::CollectingSink sink;
  RunOutcome outcome;
  std::vector<test::Write> writes;
  double last_command = 0.0;
  bool released = false;
};

SweepPlan plan_of(std::vector<double> frequencies_hz) {
  SweepSettings sweep;
  sweep.spacing = Spacing::list;
  sweep.frequencies_hz = std::move(frequencies_hz);
  sweep.amplitude = 0.7;
  sweep.settling = Settling::fixed;
  sweep.target_db = 0.0;
  sweep.target_deg = 0.0;
  sweep.settle = {.cycles = 1.0, .seconds = 0.6};
  sweep.integrate = {.cycles = 4.0, .seconds = 0.3};
  return plan_sweep(sweep, {}, rate_hz);
}

constexpr double pole_rad_s = 60.0;

// The plant is simulated at the true times of a scripted clock.
GapRun run_with_gaps(const SweepPlan& plan, test::ScriptedClock::Skip skip,
                     GuardSettings guard_settings = test::open_guard(1)) {
  GapRun run;
  test::ScriptedClock clock{rate_hz, std::move(skip)};
  sim::SimulatedRig rig{test::rig_of(sim::from_transfer_function({pole_rad_s}, {1.0, pole_rad_s})),
                        clock};
  test::FakeActuator actuator{clock};
  actuator.apply = [&](double command) {
    return rig.actuator().write(command).value;
  };
  Sensor* const sensors[] = {&rig.sensor(0)};
  Guard guard{std::move(guard_settings), clock.grid().period_s()};
  SweepRunner runner{plan, {}, clock, actuator, sensors, guard, run.sink};
  RunControl control;
  run.outcome = runner.run(control);
  run.writes = actuator.writes;
  run.last_command = actuator.last;
  run.released = actuator.released;
  return run;
}

double worst_error(const GapRun& run) {
  const test::PartialFractions lag{.poles = {-60.0L}, .residues = {60.0L}};
  return test::worst_error(run.sink.points, first_sensor_channel, [&](long double omega) {
    return test::held_response(lag, omega, 1e-3L);
  });
}

std::vector<Event> gaps_of(const GapRun& run) {
  std::vector<Event> gaps;
  for (const Event& event : run.sink.events) {
    if (event.kind == EventKind::gap) gaps.push_back(event);
  }
  return gaps;
}

TEST(Gaps, AreNotedWithTheirTickAndLength) {
  const auto run = run_with_gaps(
      plan_of({10.0}), [](std::uint64_t index) -> std::uint64_t { return index == 250 ? 3 : 0; });
  const auto gaps = gaps_of(run);
  ASSERT_EQ(gaps.size(), 1U);
  EXPECT_EQ(gaps[0].tick, 253U);
  EXPECT_EQ(gaps[0].value, 3.0);
  EXPECT_EQ(run.outcome.skipped_ticks, 3U);
  EXPECT_EQ(run.sink.timings.at(0).skipped, 3U);
  EXPECT_EQ(run.sink.timings.at(0).resettles, 1U);
}

TEST(Gaps, KeepThePhaseOfTheCommandOnTheGrid) {
  const SweepPlan plan = plan_of({10.0});
  const auto run = run_with_gaps(
      plan, [](std::uint64_t index) -> std::uint64_t { return index % 97 == 0 ? index % 5 : 0; });
  for (const test::Write& write : run.writes) {
    const double angle = 2.0 * std::numbers::pi * static_cast<double>(write.tick % 100) / 100.0;
    ASSERT_NEAR(write.command, 0.7 * std::sin(angle), 1e-15) << write.tick;
  }
}

TEST(Gaps, InABlockVoidItAndTheDwellSettlesAgain) {
  const SweepPlan plan = plan_of({10.0});
  const std::uint64_t second_block = plan.dwells[0].settle_samples + 150;
  const auto run = run_with_gaps(
      plan, [=](std::uint64_t index) -> std::uint64_t { return index == second_block ? 1 : 0; });
  ASSERT_EQ(run.sink.points.size(), 1U);
  EXPECT_EQ(run.sink.points[0].status, PointStatus::good);
  EXPECT_EQ(run.sink.points[0].samples, plan.dwells[0].blocks * plan.dwells[0].block_samples);
  EXPECT_EQ(run.sink.timings.at(0).resettles, 1U);
  for (const Block& block : run.sink.blocks) {
    const bool before = block.first_tick + plan.dwells[0].block_samples <= second_block;
    const bool settled = block.first_tick >= second_block + plan.dwells[0].settle_samples;
    EXPECT_TRUE(before || settled) << block.first_tick;
  }
}

class GapsAnywhere : public testing::TestWithParam<std::uint64_t> {};

TEST_P(GapsAnywhere, LeaveTheResultAsExactAsWithout) {
  const SweepPlan plan = plan_of({7.0, 10.0, 123.0, 441.0});
  const std::uint64_t every = GetParam();
  const auto run = run_with_gaps(plan, [=](std::uint64_t index) -> std::uint64_t {
    return index % every == 0 ? 1 + index % 7 : 0;
  });
  ASSERT_EQ(run.sink.points.size(), 4U);
  EXPECT_FALSE(run.outcome.trip.tripped());
  EXPECT_FALSE(gaps_of(run).empty());
  EXPECT_LT(worst_error(run), 1e-9);
}

INSTANTIATE_TEST_SUITE_P(Periods, GapsAnywhere, testing::Values(1501, 1999, 2503, 3001));

// However many ticks are lost and wherever: the command never moves further in a tick than the sine
// does, so that a slew limit right above it is not tripped.
TEST(Gaps, NeverMakeTheCommandJump) {
  const SweepPlan plan = plan_of({1.0, 3.0, 10.0, 13.0, 17.0});
  for (std::uint64_t every = 400; every < 1400; every += 37) {
    GuardSettings guard = test::open_guard(1);
    guard.slew_per_s = 0.7 * 2.0 * std::numbers::pi * 17.0 * 1.001;
    const auto run = run_with_gaps(
        plan,
        [=](std::uint64_t index) -> std::uint64_t {
          return index % every == 0 ? 1 + index % 5 : 0;
        },
        guard);
    ASSERT_FALSE(run.outcome.trip.tripped()) << describe(run.outcome.trip, {"y"}) << ", " << every;
  }
}

TEST(LostSamples, NeverMakeTheCommandJumpEither) {
  auto rig = test::rig_of(sim::from_transfer_function({pole_rad_s}, {1.0, pole_rad_s}));
  rig.sensors[0].imperfections.lost_fraction = 0.002;
  GuardSettings guard = test::open_guard(1);
  guard.slew_per_s = 0.7 * 2.0 * std::numbers::pi * 17.0 * 1.001;
  for (rig.seed = 1; rig.seed <= 20; ++rig.seed) {
    const auto run = test::run_virtual(plan_of({1.0, 3.0, 10.0, 13.0, 17.0}), rig, guard);
    ASSERT_FALSE(run.outcome.trip.tripped()) << describe(run.outcome.trip, {"y"});
  }
}

// One sample in ten ticks: at 20 Hz and above its harmonics and the tone look alike to it.
TEST(LostSamples, OfASlowSensorCostNoPointAndNoEvents) {
  SweepSettings sweep;
  sweep.spacing = Spacing::list;
  sweep.frequencies_hz = {7.0, 20.0, 25.0, 30.0, 40.0};
  sweep.amplitude = 0.7;
  const SweepPlan plan = plan_sweep(sweep, {}, rate_hz);
  test::ScriptedClock clock{rate_hz};
  test::FakeActuator actuator{clock};
  double state = 0.0;
  actuator.apply = [&](double command) {
    state = 0.95 * state + 0.05 * command;
    return command;
  };
  std::mt19937 random{1};
  std::normal_distribution<double> noise{0.0, 3e-4};
  test::FakeSensor sensor{clock, [&](std::uint64_t /*tick*/) {
                            return state + noise(random);
                          }};
  sensor.fault_at = [](std::uint64_t tick) {
    return tick % 10 == 0 ? Fault::none : Fault::stale;
  };
  Sensor* const sensors[] = {&sensor};
  test::CollectingSink sink;
  Guard guard{test::open_guard(1), clock.grid().period_s()};
  SweepRunner runner{plan, {}, clock, actuator, sensors, guard, sink};
  RunControl control;
  const RunOutcome outcome = runner.run(control);
  EXPECT_FALSE(outcome.trip.tripped());
  ASSERT_EQ(sink.points.size(), 5U);
  for (const Point& point : sink.points) {
    const std::complex<double> z =
        std::polar(1.0, 2.0 * std::numbers::pi * point.frequency_hz / rate_hz);
    EXPECT_EQ(point.status, PointStatus::good)
        << point.frequency_hz << " Hz: " << to_string(point.reason);
    EXPECT_NEAR(std::abs(point.response * (1.0 - 0.95 / z) / 0.05), 1.0, 0.02)
        << point.frequency_hz;
  }
  for (const Event& event : sink.events) {
    EXPECT_NE(event.kind, EventKind::sensor_fault);
    EXPECT_NE(event.kind, EventKind::sensor_recovered);
  }
}

TEST(Gaps, BetweenTwoDwellsAreHandledToo) {
  const SweepPlan plan = plan_of({10.0, 20.0});
  const std::uint64_t second = plan.dwells[0].min_samples();
  const auto run = run_with_gaps(
      plan, [=](std::uint64_t index) -> std::uint64_t { return index == second ? 4 : 0; });
  ASSERT_EQ(run.sink.points.size(), 2U);
  EXPECT_LT(worst_error(run), 1e-9);
  const auto at = std::find_if(run.writes.begin(), run.writes.end(),
                               [=](const test::Write& write) { return write.tick == second + 4; });
  ASSERT_NE(at, run.writes.end());
  EXPECT_NEAR(at->command, 0.7 * std::sin(2.0 * std::numbers::pi * 4.0 * 0.02), 1e-15);
}

TEST(Gaps, WithoutAnEndMakeARealTimeFaultAndReleaseTheActuator) {
  const SweepPlan plan = plan_of({10.0, 20.0});
  const auto run = run_with_gaps(
      plan, [](std::uint64_t index) -> std::uint64_t { return index % 50 == 0 ? 1 : 0; });
  ASSERT_EQ(run.sink.points.size(), 2U);
  for (const Point& point : run.sink.points) {
    EXPECT_EQ(point.status, PointStatus::rt_fault);
    EXPECT_EQ(point.reason, PointReason::gaps);
    EXPECT_GT(point.reason_value, 0.0);
    EXPECT_TRUE(std::isnan(point.response.real()));
  }
  EXPECT_TRUE(run.released);
  EXPECT_EQ(run.last_command, 0.0);
}

TEST(Gaps, NearlyAsLongAsIsAllowedEndTheRunAsWell) {
  const SweepPlan plan = plan_of({10.0});
  const auto run = run_with_gaps(plan, [](std::uint64_t) -> std::uint64_t { return 1000; });
  EXPECT_FALSE(run.outcome.trip.tripped());
  EXPECT_EQ(run.sink.points.at(0).status, PointStatus::rt_fault);
  EXPECT_TRUE(run.released);
}

TEST(Gaps, InWhichTheMachineSleptStopTheRun) {
  const SweepPlan plan = plan_of({10.0, 20.0});
  const auto run = run_with_gaps(
      plan, [](std::uint64_t index) -> std::uint64_t { return index == 400 ? 1001 : 0; });
  EXPECT_EQ(run.outcome.trip.cause, TripCause::clock_lost);
  EXPECT_EQ(run.outcome.trip.tick, 1401U);
  EXPECT_NEAR(run.outcome.trip.value, 1.001, 1e-12);
  EXPECT_EQ(describe(run.outcome.trip, {}),
            "the loop stood still for 1 s (at most 1 s) (tick 1401; command changed to 0)");
  EXPECT_TRUE(run.released);
  EXPECT_EQ(run.last_command, 0.0);
}

// A bus that reports the command of the tick before, at the time at which it was applied, and
// sometimes nothing or late. What the sensor reads is as old.
class LaggingRig final : public Actuator, public Sensor {
 public:
  LaggingRig(const Clock& clock, sim::SimulatedRig& rig) : clock_{clock}, rig_{rig} {}

  Sample write(double command) noexcept override {
    const std::uint64_t tick = clock_.now().tick;
    const Sample applied = std::exchange(applied_, rig_.actuator().write(command));
    read_ = std::exchange(next_read_, rig_.sensor(0).read());
    const bool nothing_yet = tick == 0;
    const bool lost = lost_at && lost_at(tick);
    if (nothing_yet || lost) read_.fault = Fault::stale;
    Sample answer = applied;
    if (late_at && late_at(tick)) answer.time_ns += 700'000;
    if (nothing_yet || lost) answer.fault = Fault::stale;
    return answer;
  }
  void release() noexcept override { rig_.actuator().release(); }
  Sample read() noexcept override { return read_; }

  std::function<bool(std::uint64_t tick)> lost_at;
  std::function<bool(std::uint64_t tick)> late_at;

 private:
  const Clock& clock_;
  sim::SimulatedRig& rig_;
  Sample applied_;
  Sample read_;
  Sample next_read_;
};

struct LaggingRun {
  test::CollectingSink sink;
  RunOutcome outcome;
};

LaggingRun run_lagging(const SweepPlan& plan, std::function<bool(std::uint64_t)> lost_at,
                       std::function<bool(std::uint64_t)> late_at = {}) {
  LaggingRun run;
  test::ScriptedClock clock{rate_hz};
  sim::SimulatedRig rig{test::rig_of(sim::from_transfer_function({pole_rad_s}, {1.0, pole_rad_s})),
                        clock};
  LaggingRig lagging{clock, rig};
  lagging.lost_at = std::move(lost_at);
  lagging.late_at = std::move(late_at);
  Sensor* const sensors[] = {&lagging};
  Guard guard{test::open_guard(1), clock.grid().period_s()};
  SweepRunner runner{plan, {}, clock, lagging, sensors, guard, run.sink};
  RunControl control;
  run.outcome = runner.run(control);
  return run;
}

double worst_error(const LaggingRun& run) {
  const test::PartialFractions lag{.poles = {-60.0L}, .residues = {60.0L}};
  return test::worst_error(run.sink.points, first_sensor_channel, [&](long double omega) {
    return test::held_response(lag, omega, 1e-3L);
  });
}

TEST(LaggingBus, IsExactBecauseWhatWasAppliedComesWithItsTime) {
  // At 441 Hz a tick is 159 degrees: no reason to take the sign for wrong.
  const auto run = run_lagging(plan_of({7.0, 123.0, 441.0}), {});
  EXPECT_FALSE(run.outcome.trip.tripped());
  EXPECT_LT(worst_error(run), 1e-9);
}

TEST(LaggingBus, ALostConfirmationIsAMissingSampleAndNoLostCommand) {
  const auto run =
      run_lagging(plan_of({7.0, 123.0}), [](std::uint64_t tick) { return tick % 50 == 7; });
  EXPECT_FALSE(run.outcome.trip.tripped());
  EXPECT_LT(worst_error(run), 1e-9);
  for (const Point& point : run.sink.points) {
    EXPECT_NEAR(point.lost / (point.lost + point.samples), 0.02, 0.005);
    EXPECT_EQ(run.sink.timings.at(point.dwell).resettles, 0U);
  }
}

TEST(LaggingBus, ACommandLateByMoreThanHalfAPeriodVoidsWhatWasGathered) {
  const SweepPlan plan = plan_of({10.0});
  const std::uint64_t second_block = plan.dwells[0].settle_samples + 150;
  const auto run = run_lagging(plan, {}, [=](std::uint64_t tick) { return tick == second_block; });
  EXPECT_GT(run.sink.timings.at(0).resettles, 0U);
  EXPECT_EQ(run.sink.points.at(0).status, PointStatus::good);
  EXPECT_LT(worst_error(run), 1e-9);
}

}  // namespace
}  // namespace sinerig
