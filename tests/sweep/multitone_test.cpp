// Several tones in one dwell: the common block, the phases, and that each is measured as if alone.
#include "sweep/multitone.h"

#include <cmath>
#include <numeric>
#include <set>

#include <gtest/gtest.h>

#include "support/exactness.h"
#include "sweep/asked_frequencies.h"
#include "sweep/plan.h"

namespace sinerig {
namespace {

constexpr double rate_hz = 1000.0;

SweepSettings several(std::uint32_t tones, bool odd_bins = false) {
  SweepSettings sweep;
  sweep.start_hz = 0.5;
  sweep.stop_hz = 200.0;
  sweep.points = 24;
  sweep.amplitude = 0.7;
  sweep.tones = tones;
  sweep.odd_bins = odd_bins;
  return sweep;
}

TEST(Multitone, GroupsAreFarApartAndComplete) {
  const auto groups = interleaved({5, 3, 1, 2, 4, 6, 7}, 3);
  ASSERT_EQ(groups.size(), 3U);
  EXPECT_EQ(groups[0], (std::vector<double>{1, 4, 7}));
  EXPECT_EQ(groups[1], (std::vector<double>{2, 5}));
  EXPECT_EQ(groups[2], (std::vector<double>{3, 6}));
}

TEST(Multitone, EveryToneIsNearWhatWasAskedAndInABinOfItsOwn) {
  for (const bool odd : {false, true}) {
    const SweepPlan plan = plan_sweep(several(6, odd), {}, rate_hz);
    const auto asked = interleaved(asked_frequencies(several(6)), 6);
    ASSERT_EQ(plan.dwells.size(), asked.size());
    for (std::size_t i = 0; i < asked.size(); ++i) {
      const Dwell& dwell = plan.dwells[i];
      ASSERT_EQ(dwell.tones.size(), asked[i].size());
      std::set<std::uint64_t> bins;
      for (std::size_t k = 0; k < asked[i].size(); ++k) {
        bins.insert(dwell.tones[k].cycles);
        const double tolerance = k == 0 ? 1e-3 : 0.03;
        EXPECT_NEAR(dwell.tone_hz(dwell.tones[k], rate_hz) / asked[i][k], 1.0, tolerance);
        if (odd) {
          EXPECT_EQ(dwell.tones[k].cycles % 2, 1U);
        }
      }
      EXPECT_EQ(bins.size(), asked[i].size());
    }
  }
}

TEST(Multitone, TheSumStaysWithinTheAmplitudeOfOneToneAndBelowTheSumOfAll) {
  const SweepPlan plan = plan_sweep(several(6), {}, rate_hz);
  for (const Dwell& dwell : plan.dwells) {
    double sum = 0.0;
    double peak = 0.0;
    for (const Tone& tone : dwell.tones) sum += tone.amplitude;
    for (std::uint64_t n = 0; n < dwell.block_samples; ++n) {
      double value = 0.0;
      for (const Tone& tone : dwell.tones) {
        const Phasor at = phasor(tone.cycles * n % dwell.block_samples, dwell.block_samples);
        value += tone.amplitude *
                 (at.sine * std::cos(tone.phase_rad) + at.cosine * std::sin(tone.phase_rad));
      }
      peak = std::max(peak, std::abs(value));
    }
    EXPECT_LE(peak, 0.7 * (1.0 + 1e-9));
    EXPECT_GT(peak, 0.7 * 0.99);
    EXPECT_GT(sum, 1.02 * peak);  // tones far apart meet sooner or later
  }
}

TEST(Multitone, IsRefusedWhereNoBlockFits) {
  SweepSettings sweep = several(6);
  sweep.tones_tolerance = 1e-6;
  try {
    plan_sweep(sweep, {}, rate_hz);
    FAIL();
  } catch (const PlanRefused& refused) {
    EXPECT_EQ(refused.key(), "tones_tolerance");
  }
}

TEST(Multitone, IsHeldAgainstTheLimitsByItsTruePeaks) {
  MotionLimits limits{.command_min = -0.7001, .command_max = 0.7001};
  EXPECT_NO_THROW(plan_sweep(several(6), limits, rate_hz));
  limits.velocity_max = 10.0;
  try {
    plan_sweep(several(6), limits, rate_hz);
    FAIL();
  } catch (const PlanRefused& refused) {
    EXPECT_NE(std::string{refused.what()}.find("velocity_max"), std::string::npos);
  }
}

class Tones : public testing::TestWithParam<std::uint32_t> {};

TEST_P(Tones, AreMeasuredAsExactlyAsOneAlone) {
  SweepSettings sweep = several(GetParam());
  sweep.settling = Settling::fixed;
  sweep.settle = {.cycles = 1.0, .seconds = 3.0};
  sweep.target_db = 0.0;
  sweep.target_deg = 0.0;
  const SweepPlan plan = plan_sweep(sweep, {}, rate_hz);
  const auto run = test::run_virtual(
      plan, test::rig_of(sim::from_transfer_function({309673.0}, {1.0, 347.0, 8987.0, 317356.0})));
  const std::vector<long double> den{1.0L, 347.0L, 8987.0L, 317356.0L};
  const auto reference = test::partial_fractions({309673.0L}, den, test::roots(den));
  EXPECT_EQ(run.sink.points.size(), 24U);
  EXPECT_LT(test::worst_error(plan, run, reference), 1e-9);
}

TEST_P(Tones, HandTheCommandOverWithoutAStep) {
  const SweepPlan plan = plan_sweep(several(GetParam()), {}, rate_hz);
  GuardSettings guard = test::open_guard(1);
  double fastest = 0.0;
  for (const Dwell& dwell : plan.dwells) {
    double slope = 0.0;
    for (const Tone& tone : dwell.tones) {
      slope += tone.amplitude * 2.0 * std::numbers::pi * dwell.tone_hz(tone, rate_hz);
    }
    fastest = std::max(fastest, slope);
  }
  guard.slew_per_s = 1.01 * fastest;
  const auto run = test::run_virtual(
      plan, test::rig_of(sim::from_transfer_function({300.0}, {1.0, 300.0})), guard);
  EXPECT_FALSE(run.outcome.trip.tripped()) << describe(run.outcome.trip, {"y"});
}

INSTANTIATE_TEST_SUITE_P(Number, Tones, testing::Values(2U, 4U, 7U));

}  // namespace
}  // namespace sinerig
