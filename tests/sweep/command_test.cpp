// What the actuator is asked for, from the first tick to the last: continuous from dwell to dwell,
// on its baseline, fitted to the wanted response, back at neutral.
#include <algorithm>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "support/virtual_run.h"
#include "sweep/leveller.h"

namespace sinerig {
namespace {

constexpr double rate_hz = 1000.0;

sim::SimulatedRigSettings resonance() {
  sim::SimulatedRigSettings rig;
  const double omega = 2.0 * std::numbers::pi * 20.0;
  rig.system = sim::from_zeros_poles({}, {{-0.02 * omega, omega}}, 2.0 * omega * omega);
  rig.sensors.resize(1);
  rig.sensors[0].imperfections.noise_rms = 1e-4;
  return rig;
}

SweepSettings across_the_resonance() {
  SweepSettings sweep;
  sweep.start_hz = 2.0;
  sweep.stop_hz = 60.0;
  sweep.points = 12;
  sweep.amplitude = 0.5;
  return sweep;
}

std::vector<double> commands_of(const test::VirtualRun& run) {
  std::vector<double> commands;
  for (const TickSamples& tick : run.sink.samples) commands.push_back(tick.values[command_channel]);
  return commands;
}

RunnerSettings recording() {
  RunnerSettings runner;
  runner.record_samples = true;
  return runner;
}

TEST(Command, HasNoStepWhereADwellEndsInTheMidstOfACycle) {
  const SweepPlan plan = plan_sweep(across_the_resonance(), {}, rate_hz);
  const auto run = test::run_virtual(plan, resonance(), test::open_guard(1), recording());
  ASSERT_FALSE(run.outcome.trip.tripped());
  const std::vector<double> commands = commands_of(run);
  const double fastest_sine = 2.0 * 0.5 * std::sin(std::numbers::pi * 60.1 / rate_hz);
  for (std::size_t i = 1; i < commands.size(); ++i) {
    ASSERT_LE(std::abs(commands[i] - commands[i - 1]), fastest_sine) << "at tick " << i;
  }
}

TEST(Command, GoesToItsOffsetAndBackToNeutralByTheRamp) {
  SweepSettings sweep = across_the_resonance();
  sweep.neutral = 1.0;
  sweep.offset = 2.0;
  sweep.bias_amplitude = 0.25;
  sweep.bias_hz = 0.31;
  sweep.ramp_s = 0.5;
  auto rig = resonance();
  rig.neutral = 1.0;
  GuardSettings guard = test::open_guard(1);
  guard.neutral = 1.0;
  const SweepPlan plan = plan_sweep(sweep, {}, rate_hz);
  const auto run = test::run_virtual(plan, rig, guard, recording());
  const std::vector<double> commands = commands_of(run);
  EXPECT_NEAR(commands.front(), 1.0, 1e-12);
  EXPECT_NEAR(commands.back(), 1.0, 1e-12);
  const auto [least, most] = std::minmax_element(commands.begin() + 1000, commands.end() - 1000);
  EXPECT_NEAR(*most, 3.75, 0.02);
  EXPECT_NEAR(*least, 2.25, 0.02);
  for (std::size_t i = 1; i < commands.size(); ++i) {
    ASSERT_LE(std::abs(commands[i] - commands[i - 1]), 0.25) << "at tick " << i;
  }
}

TEST(Command, MeasuresTheSameWithAndWithoutABiasMotion) {
  SweepSettings biased = across_the_resonance();
  biased.offset = 2.0;
  biased.bias_amplitude = 1.0;
  biased.bias_hz = 0.31;
  biased.ramp_s = 0.5;
  const auto still =
      test::run_virtual(plan_sweep(across_the_resonance(), {}, rate_hz), resonance());
  const auto moving = test::run_virtual(plan_sweep(biased, {}, rate_hz), resonance());
  ASSERT_EQ(still.sink.points.size(), moving.sink.points.size());
  for (std::size_t i = 0; i < still.sink.points.size(); ++i) {
    const Point& a = still.sink.points[i];
    const Point& b = moving.sink.points[i];
    // The way from neutral to the offset may leave the first dwell unsettled, and then it says so.
    EXPECT_TRUE(i == 0 || b.status == PointStatus::good) << b.frequency_hz;
    EXPECT_LT(std::abs(a.response - b.response) / std::abs(a.response), 0.02) << b.frequency_hz;
  }
}

TEST(Command, IsFittedToTheWantedResponseAndNeverAboveItsPlan) {
  SweepSettings sweep = across_the_resonance();
  sweep.points = 30;
  sweep.level = {.response = 0.4, .most_response = 1.2, .least_amplitude = 0.001};
  const auto run = test::run_virtual(plan_sweep(sweep, {}, rate_hz), resonance(),
                                     test::open_guard(1), recording());
  ASSERT_FALSE(run.outcome.trip.tripped());
  for (const Point& point : run.sink.points) {
    EXPECT_LE(point.input_amplitude, 0.5 * (1.0 + 1e-9)) << point.frequency_hz;
    EXPECT_LE(point.output_amplitude, 1.2) << point.frequency_hz;
    const bool at_the_maximum = point.input_amplitude > 0.49;
    EXPECT_TRUE(at_the_maximum || point.output_amplitude >= 0.1) << point.frequency_hz;
  }
  for (const double command : commands_of(run)) ASSERT_LE(std::abs(command), 0.5 + 1e-9);
}

TEST(Command, IsRaisedForAFirstPointThatIsFarTooQuiet) {
  SweepSettings sweep = across_the_resonance();
  sweep.points = 1;
  sweep.level = {.response = 0.5, .most_response = 5.0, .least_amplitude = 0.01};
  const auto run = test::run_virtual(plan_sweep(sweep, {}, rate_hz), resonance());
  ASSERT_EQ(run.sink.points.size(), 1U);
  EXPECT_EQ(run.sink.points[0].status, PointStatus::good);
  EXPECT_NEAR(run.sink.points[0].output_amplitude, 0.5, 0.05);
  const auto retries =
      std::count_if(run.sink.events.begin(), run.sink.events.end(),
                    [](const Event& event) { return event.kind == EventKind::retried; });
  EXPECT_EQ(retries, 1);
}

// What is planned within its limits is played within them, from the first tick to the release.
struct LimitedSweep {
  const char* name;
  void (*change)(SweepSettings&, RunnerSettings&, GuardSettings&);
};

class WithinItsLimits : public testing::TestWithParam<LimitedSweep> {};

TEST_P(WithinItsLimits, TheCommandStays) {
  SweepSettings sweep = across_the_resonance();
  sweep.frequency_tolerance = 0.01;
  RunnerSettings runner = recording();
  GuardSettings guard = test::open_guard(1);
  GetParam().change(sweep, runner, guard);
  SweepPlan plan;
  // The tightest limit that the plan takes.
  double slew_per_s = 1.0;
  for (;; slew_per_s *= 1.01) {
    try {
      plan = plan_sweep(sweep, {.slew_per_s = slew_per_s}, rate_hz);
      break;
    } catch (const PlanRefused&) {
    }
  }
  guard.slew_per_s = slew_per_s;
  double loudest = 0.0;
  for (const Dwell& dwell : plan.dwells) {
    double sum = 0.0;
    for (const Tone& tone : dwell.tones) sum += tone.amplitude;
    loudest = std::max(loudest, sum);
  }
  guard.command_max = std::abs(sweep.offset) + sweep.bias_amplitude + loudest * (1.0 + 1e-9);
  guard.command_min = -guard.command_max;
  const auto run = test::run_virtual(plan, resonance(), guard, runner);
  EXPECT_FALSE(run.outcome.trip.tripped()) << describe(run.outcome.trip, {"y"});
  const std::vector<double> commands = commands_of(run);
  EXPECT_LE(std::abs(commands.back()), slew_per_s / rate_hz) << "before the release";
}

INSTANTIATE_TEST_SUITE_P(
    Of, WithinItsLimits,
    testing::Values(
        LimitedSweep{"ATableThatFalls",
                     [](auto& sweep, auto&, auto&) {
                       sweep.amplitude_table = {{.frequency_hz = 2.0, .amplitude = 0.5},
                                                {.frequency_hz = 20.0, .amplitude = 0.02}};
                     }},
        LimitedSweep{"ATableThatFallsOverALongRamp",
                     [](auto& sweep, auto&, auto&) {
                       sweep.amplitude_table = {{.frequency_hz = 2.0, .amplitude = 0.5},
                                                {.frequency_hz = 20.0, .amplitude = 0.02}};
                       sweep.ramp_s = 1.0;
                     }},
        LimitedSweep{"AVelocityThatIsFollowed",
                     [](auto& sweep, auto&, auto&) {
                       sweep.follow_velocity = 10.0;
                     }},
        LimitedSweep{"ALevelThatIsKept",
                     [](auto& sweep, auto&, auto&) {
                       sweep.level = {
                           .response = 0.4, .most_response = 0.6, .least_amplitude = 0.01};
                     }},
        LimitedSweep{"APreflight",
                     [](auto& sweep, auto& runner, auto&) {
                       sweep.amplitude = 0.1;
                       runner.preflight = {.wanted = true, .level = 0.05};
                     }},
        LimitedSweep{"ASoftLimit",
                     [](auto& sweep, auto& runner, auto& guard) {
                       sweep.bias_amplitude = 0.1;
                       sweep.bias_hz = 0.31;
                       guard.channels[0].soft_max = 1.5;
                       runner.retry = {.soft = 5, .soft_wait_s = 0.1};
                     }},
        LimitedSweep{"AnOffsetWithABiasMotion",
                     [](auto& sweep, auto&, auto&) {
                       sweep.offset = 1.0;
                       sweep.bias_amplitude = 0.3;
                       sweep.bias_hz = 0.31;
                       sweep.ramp_s = 0.5;
                     }},
        LimitedSweep{"SeveralTones",
                     [](auto& sweep, auto&, auto&) {
                       sweep.tones = 4;
                     }},
        LimitedSweep{"ATransientThatIsModelled",
                     [](auto& sweep, auto&, auto&) {
                       sweep.settling = Settling::model;
                       sweep.amplitude_table = {{.frequency_hz = 2.0, .amplitude = 0.5},
                                                {.frequency_hz = 20.0, .amplitude = 0.02}};
                     }}),
    [](const auto& instance) { return std::string{instance.param.name}; });

TEST(Command, OfSeveralTonesStaysWithinTheirPeakWhileOneGroupGivesWayToTheNext) {
  SweepSettings sweep = across_the_resonance();
  sweep.points = 24;
  sweep.stop_hz = 100.0;
  sweep.tones = 4;
  sweep.frequency_tolerance = 0.01;
  const auto run = test::run_virtual(plan_sweep(sweep, {}, rate_hz), resonance(),
                                     test::open_guard(1), recording());
  for (const double command : commands_of(run)) ASSERT_LE(std::abs(command), 0.5 + 1e-9);
}

Point point_of(PointStatus status, double gain, double amplitude) {
  Point point;
  point.status = status;
  point.frequency_hz = 10.0;
  point.response = gain;
  point.input_amplitude = amplitude;
  point.output_amplitude = gain * amplitude;
  return point;
}

TEST(Leveller, LowersAPointThatClippedOrOvershotAndRaisesOneThatDrowned) {
  const Level level{.response = 1.0, .most_response = 3.0, .least_amplitude = 0.01, .retries = 2};
  EXPECT_LT(*Leveller{level}.retry(point_of(PointStatus::clipped, 2.0, 0.5), 0.5, 1.0), 0.5);
  EXPECT_NEAR(*Leveller{level}.retry(point_of(PointStatus::good, 10.0, 0.5), 0.5, 1.0), 0.1, 1e-12);
  EXPECT_GT(*Leveller{level}.retry(point_of(PointStatus::low_signal, 2.0, 0.1), 0.1, 1.0), 0.1);
  EXPECT_FALSE(Leveller{level}.retry(point_of(PointStatus::good, 2.0, 0.5), 0.5, 1.0));
}

TEST(Leveller, GivesUpAfterItsRetriesAndAtTheMaximum) {
  const Level level{.response = 1.0, .most_response = 3.0, .least_amplitude = 0.01, .retries = 2};
  Leveller leveller{level};
  const Point drowned = point_of(PointStatus::low_signal, 0.01, 0.1);
  EXPECT_TRUE(leveller.retry(drowned, 0.1, 1.0));
  EXPECT_TRUE(leveller.retry(drowned, 0.4, 1.0));
  EXPECT_FALSE(leveller.retry(drowned, 0.8, 1.0));
  EXPECT_FALSE(Leveller{level}.retry(point_of(PointStatus::low_signal, 0.01, 1.0), 1.0, 1.0));
}

TEST(Leveller, FollowsTheSlopeOfTheGain) {
  const Level level{.response = 1.0, .most_response = 3.0, .least_amplitude = 1e-6, .retries = 0};
  Leveller leveller{level};
  for (const double frequency_hz : {10.0, 20.0}) {
    Point point = point_of(PointStatus::good, 100.0 / frequency_hz, 0.1);
    point.frequency_hz = frequency_hz;
    leveller.retry(point, 0.1, 1.0);
  }
  // Gain falls as 1/f: 2.5 at 40 Hz.
  EXPECT_NEAR(leveller.scale(40.0, 1.0), 0.4, 1e-12);
}

}  // namespace
}  // namespace sinerig
