#include "sweep/plan.h"

#include <cmath>
#include <numbers>
#include <numeric>

#include <gmock/gmock.h>

#include "sweep/asked_frequencies.h"
#include "sweep/dwell_sizing.h"

namespace sinerig {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

constexpr double rate_hz = 1000.0;
constexpr double two_pi = 2.0 * std::numbers::pi;

SweepSettings a_sweep() {
  SweepSettings sweep;
  sweep.start_hz = 1.0;
  sweep.stop_hz = 100.0;
  sweep.points = 21;
  sweep.amplitude = 0.5;
  sweep.settling = Settling::fixed;
  sweep.settle = {.cycles = 4.0, .seconds = 0.5};
  sweep.integrate = {.cycles = 8.0, .seconds = 0.5};
  sweep.target_db = 0.0;
  sweep.target_deg = 0.0;
  return sweep;
}

SweepSettings a_list(std::vector<double> frequencies_hz) {
  SweepSettings sweep = a_sweep();
  sweep.spacing = Spacing::list;
  sweep.frequencies_hz = std::move(frequencies_hz);
  return sweep;
}

Dwell only_dwell(SweepSettings sweep, double frequency_hz) {
  sweep.spacing = Spacing::list;
  sweep.frequencies_hz = {frequency_hz};
  return plan_sweep(sweep, {}, rate_hz).dwells.at(0);
}

TEST(AskedFrequencies, AreEvenOnALogarithmicAxisFromEndToEnd) {
  const auto asked = asked_frequencies(a_sweep());
  ASSERT_EQ(asked.size(), 21U);
  EXPECT_EQ(asked.front(), 1.0);
  EXPECT_EQ(asked.back(), 100.0);
  for (std::size_t i = 1; i < asked.size(); ++i) {
    EXPECT_NEAR(asked[i] / asked[i - 1], std::pow(10.0, 0.1), 1e-12);
  }
}

TEST(AskedFrequencies, AreEvenOnALinearAxisFromEndToEnd) {
  SweepSettings sweep = a_sweep();
  sweep.spacing = Spacing::linear;
  const auto asked = asked_frequencies(sweep);
  EXPECT_EQ(asked.front(), 1.0);
  EXPECT_EQ(asked.back(), 100.0);
  for (std::size_t i = 1; i < asked.size(); ++i) {
    EXPECT_NEAR(asked[i] - asked[i - 1], 4.95, 1e-12);
  }
}

TEST(AskedFrequencies, OfAListKeepTheirOrder) {
  EXPECT_THAT(asked_frequencies(a_list({5.0, 2.0, 9.0})), ElementsAre(5.0, 2.0, 9.0));
}

TEST(AskedFrequencies, OfASinglePointAreItsStart) {
  SweepSettings sweep = a_sweep();
  sweep.points = 1;
  EXPECT_THAT(asked_frequencies(sweep), ElementsAre(1.0));
}

TEST(SubBands, AreSweepsOfTheirOwnThatShareTheirEdges) {
  SweepSettings sweep = a_sweep();
  sweep.points = 3;
  sweep.sub_bands = equal_sub_bands(sweep, 2);
  const auto asked = asked_of(sweep);
  ASSERT_EQ(asked.size(), 5U);
  const double wanted[] = {1.0, std::sqrt(10.0), 10.0, 10.0 * std::sqrt(10.0), 100.0};
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_NEAR(asked[i].hz, wanted[i], 1e-12);
    EXPECT_EQ(asked[i].sub_band, i < 3 ? 0U : 1U);
  }
}

TEST(SubBands, ReachTheDwellsOfThePlan) {
  SweepSettings sweep = a_sweep();
  sweep.sub_bands = {{.start_hz = 1.0, .stop_hz = 5.0, .points = 4},
                     {.start_hz = 20.0, .stop_hz = 40.0, .points = 6}};
  const SweepPlan plan = plan_sweep(sweep, {}, rate_hz);
  ASSERT_EQ(plan.dwells.size(), 10U);
  for (std::size_t i = 0; i < 10; ++i) EXPECT_EQ(plan.dwells[i].sub_band, i < 4 ? 0U : 1U);
}

TEST(Plan, RunsDownwardWhenTheStopIsBelowTheStart) {
  SweepSettings up = a_sweep();
  SweepSettings down = a_sweep();
  std::swap(down.start_hz, down.stop_hz);
  const SweepPlan rising = plan_sweep(up, {}, rate_hz);
  const SweepPlan falling = plan_sweep(down, {}, rate_hz);
  ASSERT_EQ(falling.dwells.size(), 21U);
  for (std::size_t i = 0; i < 21; ++i) {
    EXPECT_NEAR(falling.dwells[i].asked_hz, rising.dwells[20 - i].asked_hz, 1e-12);
    if (i > 0) {
      EXPECT_LT(falling.dwells[i].frequency_hz(rate_hz), falling.dwells[i - 1].frequency_hz(1e3));
    }
  }
}

TEST(Plan, SnapsEveryFrequencyWithinTheStatedTolerance) {
  for (const double tolerance : {1e-6, 1e-4, 1e-2}) {
    SweepSettings sweep = a_sweep();
    sweep.frequency_tolerance = tolerance;
    for (const Dwell& dwell : plan_sweep(sweep, {}, rate_hz).dwells) {
      EXPECT_NEAR(dwell.frequency_hz(rate_hz) / dwell.asked_hz, 1.0, tolerance * (1.0 + 1e-6));
    }
  }
}

TEST(Plan, MergesPointsThatFallOnOneFrequency) {
  const SweepPlan plan = plan_sweep(a_list({10.0, 10.001, 20.0, 9.999, 20.0}), {}, rate_hz);
  ASSERT_EQ(plan.dwells.size(), 2U);
  EXPECT_EQ(plan.dwells[0].frequency_hz(rate_hz), 10.0);
  EXPECT_EQ(plan.dwells[1].frequency_hz(rate_hz), 20.0);
}

TEST(Plan, HoldsWholeCyclesInWholeBlocks) {
  for (const Dwell& dwell : plan_sweep(a_sweep(), {}, rate_hz).dwells) {
    EXPECT_EQ(dwell.settle_samples * dwell.tones.front().cycles % dwell.block_samples, 0U);
    EXPECT_GE(dwell.blocks, 1U);
    EXPECT_GE(dwell.tones.front().cycles, 1U);
    EXPECT_GE(static_cast<double>(dwell.block_samples), 0.02 * rate_hz);
    EXPECT_EQ(dwell.max_samples, dwell.min_samples());
    EXPECT_EQ(dwell.min_samples(), dwell.settle_samples + dwell.blocks * dwell.block_samples);
  }
}

TEST(Plan, DurationIsTheSumOfItsDwells) {
  const SweepPlan plan = plan_sweep(a_sweep(), {}, rate_hz);
  const auto samples = std::accumulate(
      plan.dwells.begin(), plan.dwells.end(), std::uint64_t{0},
      [](std::uint64_t sum, const Dwell& dwell) { return sum + dwell.min_samples(); });
  EXPECT_EQ(plan.min_samples(), samples);
  EXPECT_EQ(plan.min_seconds(), static_cast<double>(samples) / rate_hz);
}

TEST(Plan, SettlesForTheLargerOfCyclesAndTime) {
  SweepSettings sweep = a_sweep();
  sweep.settle = {.cycles = 4.0, .seconds = 0.5};
  EXPECT_EQ(only_dwell(sweep, 1.0).settle_samples, 4000U);   // 4 cycles of 1 s
  EXPECT_EQ(only_dwell(sweep, 8.0).settle_samples, 500U);    // both
  EXPECT_EQ(only_dwell(sweep, 100.0).settle_samples, 500U);  // 0.5 s of 10 ms cycles
}

TEST(Plan, IntegratesForTheLargerOfCyclesAndTime) {
  SweepSettings sweep = a_sweep();
  sweep.integrate = {.cycles = 3.0, .seconds = 0.5};
  const auto measured = [&](double frequency_hz) {
    const Dwell dwell = only_dwell(sweep, frequency_hz);
    return dwell.blocks * dwell.block_samples;
  };
  EXPECT_EQ(measured(1.0), 3000U);
  EXPECT_EQ(measured(100.0), 500U);
}

TEST(Plan, BlocksHaveTheLargerOfCyclesAndTime) {
  SweepSettings sweep = a_sweep();
  sweep.block = {.cycles = 2.0, .seconds = 0.1};
  EXPECT_EQ(only_dwell(sweep, 1.0).block_samples, 2000U);
  EXPECT_EQ(only_dwell(sweep, 1.0).tones.front().cycles, 2U);
  EXPECT_EQ(only_dwell(sweep, 100.0).block_samples, 100U);
  EXPECT_EQ(only_dwell(sweep, 100.0).tones.front().cycles, 10U);
}

TEST(Plan, MeasuresAtLeastOneBlockAndCanDoWithoutSettling) {
  SweepSettings sweep = a_sweep();
  sweep.settle = {};
  sweep.integrate = {};
  EXPECT_EQ(only_dwell(sweep, 10.0).settle_samples, 0U);
  EXPECT_EQ(only_dwell(sweep, 10.0).blocks, 1U);
}

TEST(Plan, SettlesAfterTheRamp) {
  SweepSettings sweep = a_sweep();
  sweep.ramp_s = 0.25;
  const Dwell dwell = only_dwell(sweep, 10.0);
  EXPECT_EQ(dwell.ramp_samples, 250U);
  EXPECT_EQ(dwell.settle_samples, 300U + 500U);  // whole cycles each
}

TEST(Amplitude, IsConstantWithoutALaw) {
  EXPECT_EQ(amplitude_at(a_sweep(), 0.1), 0.5);
  EXPECT_EQ(amplitude_at(a_sweep(), 400.0), 0.5);
}

TEST(Amplitude, FollowsTheVelocityAboveItsBreakPoint) {
  SweepSettings sweep = a_sweep();
  sweep.follow_velocity = 3.0;
  const double break_hz = 3.0 / 0.5 / two_pi;
  EXPECT_EQ(amplitude_at(sweep, break_hz * 0.99), 0.5);
  for (const double frequency_hz : {1.01 * break_hz, 3.0, 50.0}) {
    EXPECT_NEAR(amplitude_at(sweep, frequency_hz) * two_pi * frequency_hz, 3.0, 1e-12);
  }
}

TEST(Amplitude, FollowsTheAccelerationAboveItsBreakPoint) {
  SweepSettings sweep = a_sweep();
  sweep.follow_velocity = 3.0;
  sweep.follow_acceleration = 60.0;
  const double break_hz = 60.0 / 3.0 / two_pi;
  const double below_hz = 0.99 * break_hz;
  EXPECT_NEAR(amplitude_at(sweep, below_hz) * two_pi * below_hz, 3.0, 1e-12);
  for (const double frequency_hz : {1.01 * break_hz, 20.0, 50.0}) {
    const double omega = two_pi * frequency_hz;
    EXPECT_NEAR(amplitude_at(sweep, frequency_hz) * omega * omega, 60.0, 1e-10);
  }
}

TEST(Amplitude, OfATableIsStraightOnLogarithmicAxesAndHeldBeyondItsEnds) {
  SweepSettings sweep = a_sweep();
  sweep.amplitude_table = {{.frequency_hz = 1.0, .amplitude = 0.4},
                           {.frequency_hz = 100.0, .amplitude = 0.1},
                           {.frequency_hz = 200.0, .amplitude = 0.3}};
  EXPECT_EQ(amplitude_at(sweep, 0.5), 0.4);
  EXPECT_NEAR(amplitude_at(sweep, 1.0), 0.4, 1e-15);
  EXPECT_NEAR(amplitude_at(sweep, 10.0), 0.2, 1e-15);
  EXPECT_NEAR(amplitude_at(sweep, 100.0), 0.1, 1e-15);
  EXPECT_EQ(amplitude_at(sweep, 400.0), 0.3);
}

TEST(Amplitude, OfATableIsHeldUnderTheVelocityAsWell) {
  SweepSettings sweep = a_sweep();
  sweep.amplitude_table = {{.frequency_hz = 1.0, .amplitude = 0.4}};
  sweep.follow_velocity = 1.0;
  EXPECT_NEAR(amplitude_at(sweep, 10.0) * two_pi * 10.0, 1.0, 1e-14);
}

TEST(Amplitude, OfADwellIsTakenAtItsExactFrequency) {
  SweepSettings sweep = a_sweep();
  sweep.frequency_tolerance = 0.01;
  sweep.follow_velocity = 0.1;
  for (const Dwell& dwell : plan_sweep(sweep, {}, rate_hz).dwells) {
    EXPECT_NEAR(dwell.tones.front().amplitude * two_pi * dwell.frequency_hz(rate_hz), 0.1, 1e-15);
  }
}

// Each refusal: where it points, and what it says.
struct Refusal {
  const char* name;
  SweepSettings sweep;
  MotionLimits limits;
  const char* key;
  const char* message;
};

SweepSettings with(void (*change)(SweepSettings&)) {
  SweepSettings sweep = a_sweep();
  change(sweep);
  return sweep;
}

class PlanRefusal : public testing::TestWithParam<Refusal> {};

TEST_P(PlanRefusal, NamesTheKeyTheValueAndTheRule) {
  try {
    plan_sweep(GetParam().sweep, GetParam().limits, rate_hz);
    FAIL() << "not refused";
  } catch (const PlanRefused& refused) {
    EXPECT_EQ(refused.section(), "sweep");
    EXPECT_EQ(refused.key(), GetParam().key);
    EXPECT_THAT(refused.what(), HasSubstr(GetParam().message));
  }
}

INSTANTIATE_TEST_SUITE_P(
    Each, PlanRefusal,
    testing::Values(
        Refusal{"NoPoint",
                with([](SweepSettings& sweep) { sweep.points = 0; }),
                {},
                "points",
                "no frequency to measure: give at least one"},
        Refusal{"StopAboveHalfTheRate",
                with([](SweepSettings& sweep) { sweep.stop_hz = 900.0; }),
                {},
                "stop_hz",
                "900: must be above 0 and below half the loop rate (500 Hz)"},
        Refusal{"StartAtHalfTheRate",
                with([](SweepSettings& sweep) { sweep.start_hz = 500.0; }),
                {},
                "start_hz",
                "500: must be above 0 and below half the loop rate (500 Hz)"},
        Refusal{"ListedAtZero",
                a_list({10.0, 0.0}),
                {},
                "frequencies_hz",
                "0: must be above 0 and below half the loop rate (500 Hz)"},
        Refusal{"CommandAboveItsLimit",
                with([](SweepSettings& sweep) { sweep.offset = 0.2; }),
                {.command_max = 0.6},
                "amplitude",
                "a command of 0.7 at 1 Hz: exceeds [limits] command_max = 0.6; lower the amplitude "
                "there or raise the limit"},
        Refusal{"CommandBelowItsLimit",
                a_sweep(),
                {.command_min = -0.4},
                "amplitude",
                "a command of -0.5 at 1 Hz: exceeds [limits] command_min = -0.4"},
        Refusal{"TooFastForTheSlew",
                a_list({50.0}),
                {.slew_per_s = 100.0},
                "amplitude",
                "a slew of 156.434 at 50 Hz: exceeds [limits] slew_per_s = 100"},
        Refusal{"RampTooShortForTheSlew",
                with([](SweepSettings& sweep) { sweep.ramp_s = 0.01; }),
                {.slew_per_s = 6.0},
                "ramp_s",
                "a slew of up to 6.28318 on the ramp to 1 Hz: exceeds [limits] slew_per_s = 6; "
                "lengthen the ramp, lower the amplitude there or raise the limit"},
        Refusal{"TooFastForTheVelocity",
                a_list({50.0}),
                {.velocity_max = 100.0},
                "amplitude",
                "a peak velocity of 157.08 at 50 Hz: exceeds [limits] velocity_max = 100"},
        Refusal{"TooFastForTheAcceleration",
                a_list({50.0}),
                {.acceleration_max = 1e4},
                "amplitude",
                "a peak acceleration of 49348 at 50 Hz: exceeds [limits] acceleration_max = 10000"},
        Refusal{"TableAboveTheVelocity",
                with([](SweepSettings& sweep) {
                  sweep.amplitude_table = {{.frequency_hz = 1.0, .amplitude = 2.0}};
                }),
                {.velocity_max = 10.0},
                "amplitude_table",
                "a peak velocity of 12.5664 at 1 Hz"},
        Refusal{"SlowerThanAnyDwell",
                with([](SweepSettings& sweep) { sweep.start_hz = 1e-300; }),
                {},
                "start_hz",
                "1e-300 Hz: a cycle would last 1e+300 s; 3.84615e-07 Hz is the lowest at this "
                "rate"},
        Refusal{"BiasOnATone",
                with([](SweepSettings& sweep) {
                  sweep.bias_amplitude = 0.1;
                  sweep.bias_hz = 1.0;
                }),
                {},
                "bias_hz",
                "1: no dwell at 1 Hz is long enough to tell the bias motion from the tone"},
        Refusal{"BiasAndSineTooFastForTheVelocity",
                with([](SweepSettings& sweep) {
                  sweep.points = 1;
                  sweep.bias_amplitude = 1.0;
                  sweep.bias_hz = 0.25;
                }),
                {.velocity_max = 4.0},
                "amplitude",
                "a peak velocity of 4.71239 at 1 Hz: exceeds [limits] velocity_max = 4"},
        Refusal{"AProbeThatIsTooLong",
                with([](SweepSettings& sweep) {
                  sweep.settling = Settling::model;
                  sweep.probe_s = 300.0;
                }),
                {},
                "probe_s",
                "300: at this rate the probe lasts 200 s at most"},
        Refusal{"LongerThanAMonth",
                with([](SweepSettings& sweep) { sweep.integrate.seconds = 1e7; }),
                {},
                "integrate_s",
                "the dwell at 1 Hz could last 1e+07 s: shorten settling or integration, or loosen "
                "frequency_tolerance"},
        Refusal{"EndlessSettling",
                with([](SweepSettings& sweep) { sweep.settle.cycles = 1e300; }),
                {},
                "integrate_s",
                "could last"}),
    [](const auto& instance) { return std::string{instance.param.name}; });

TEST(Plan, GivesEveryChangeOfAmplitudeHalfACycle) {
  SweepSettings sweep = a_list({10.0, 20.0, 25.0, 40.0});
  sweep.amplitude_table = {{.frequency_hz = 20.0, .amplitude = 0.4},
                           {.frequency_hz = 25.0, .amplitude = 0.2}};
  const SweepPlan plan = plan_sweep(sweep, {}, rate_hz);
  EXPECT_EQ(plan.dwells[0].ramp_samples, 0U);   // from rest, at phase zero
  EXPECT_EQ(plan.dwells[1].ramp_samples, 0U);   // as before
  EXPECT_EQ(plan.dwells[2].ramp_samples, 20U);  // half of 40 samples
  EXPECT_EQ(plan.dwells[3].ramp_samples, 0U);
  EXPECT_GE(plan.dwells[2].settle_samples, plan.dwells[2].ramp_samples);
}

TEST(Plan, AllowsARampThatIsLongEnoughForTheSlew) {
  SweepSettings sweep = a_list({1.0});
  sweep.ramp_s = 2.0;
  EXPECT_EQ(plan_sweep(sweep, {.slew_per_s = 3.5}, rate_hz).dwells.size(), 1U);
}

TEST(Plan, AllowsWhatReachesALimitAndNoMore) {
  SweepSettings sweep = a_list({50.0});
  const MotionLimits limits{.command_min = -0.5,
                            .command_max = 0.5,
                            .velocity_max = 0.5 * two_pi * 50.0,
                            .acceleration_max = 0.5 * two_pi * 50.0 * (two_pi * 50.0)};
  EXPECT_EQ(plan_sweep(sweep, limits, rate_hz).dwells.size(), 1U);
}

TEST(Plan, DoesNotWatchAHarmonicThatTheBiasMotionFallsOn) {
  SweepSettings sweep = a_list({0.5, 10.0});
  sweep.bias_amplitude = 0.1;
  sweep.bias_hz = 1.0;
  const SweepPlan plan = plan_sweep(sweep, {}, rate_hz);
  EXPECT_EQ(plan.dwells[0].harmonics, 1U);
  EXPECT_EQ(plan.dwells[1].harmonics, 3U);
}

TEST(Plan, CountsWhatRefinementMayAdd) {
  SweepSettings sweep = a_sweep();
  const std::uint64_t without = plan_sweep(sweep, {}, rate_hz).max_samples();
  sweep.refine_points = 3;
  const SweepPlan plan = plan_sweep(sweep, {}, rate_hz);
  std::uint64_t longest = 0;
  for (const Dwell& dwell : plan.refinement.candidates)
    longest = std::max(longest, dwell.max_samples);
  EXPECT_EQ(plan.max_samples(), without + 3 * longest);
}

}  // namespace
}  // namespace sinerig
