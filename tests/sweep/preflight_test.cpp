// The pre-flight dwell: low, told of, and the end of the sweep where something is wrong.
#include "sweep/preflight.h"

#include <cmath>

#include <gtest/gtest.h>

#include "support/virtual_run.h"

namespace sinerig {
namespace {

constexpr double rate_hz = 1000.0;

// A gain of 2 and a lag of 1 ms.
sim::SimulatedRigSettings gain_of_two() {
  sim::SimulatedRigSettings rig;
  rig.system = sim::from_zeros_poles({}, {{-1000.0, 0.0}}, 2000.0);
  rig.sensors.resize(1);
  rig.sensors[0].imperfections.noise_rms = 1e-3;
  return rig;
}

SweepPlan short_plan() {
  SweepSettings sweep;
  sweep.spacing = Spacing::list;
  sweep.frequencies_hz = {5.0, 10.0};
  sweep.amplitude = 1.0;
  return plan_sweep(sweep, {}, rate_hz);
}

RunnerSettings with(PreflightSettings preflight) {
  RunnerSettings runner;
  preflight.wanted = true;
  runner.preflight = preflight;
  return runner;
}

test::VirtualRun fly(const PreflightSettings& preflight,
                     const sim::SimulatedRigSettings& rig = gain_of_two()) {
  return test::run_virtual(short_plan(), rig, test::open_guard(1), with(preflight));
}

TEST(Preflight, GoesFirstAtItsLevelAndTheSweepFollowsAtItsOwn) {
  const auto run = fly({.level = 0.1, .min_gain = 1.9, .max_gain = 2.1});
  ASSERT_FALSE(run.outcome.trip.tripped());
  ASSERT_EQ(run.sink.preflights.size(), 1U);
  const Preflight& found = run.sink.preflights[0];
  EXPECT_TRUE(found.passed);
  EXPECT_NEAR(found.frequency_hz, 5.0, 1e-6);
  EXPECT_NEAR(found.amplitude, 0.1, 1e-9);
  EXPECT_NEAR(found.gain, 2.0, 0.01);
  EXPECT_LT(found.phase_deg, 0.0);
  ASSERT_EQ(run.sink.points.size(), 2U);
  for (const Point& point : run.sink.points) {
    EXPECT_EQ(point.status, PointStatus::good);
    EXPECT_NEAR(point.input_amplitude, 1.0, 1e-9);
  }
  EXPECT_EQ(run.outcome.dwells_done, 2U);
}

TEST(Preflight, IsNotWantedUnlessAskedFor) {
  const auto run = test::run_virtual(short_plan(), gain_of_two());
  EXPECT_TRUE(run.sink.preflights.empty());
}

struct Refusal {
  const char* name;
  PreflightSettings settings;
  void (*spoil)(sim::SimulatedRigSettings&);
  TripCause cause;
  const char* text;
};

class PreflightRefusal : public testing::TestWithParam<Refusal> {};

TEST_P(PreflightRefusal, StopsBeforeTheSweepAndSaysWhatToDo) {
  auto rig = gain_of_two();
  GetParam().spoil(rig);
  const auto run = fly(GetParam().settings, rig);
  EXPECT_STREQ(to_string(run.outcome.trip.cause), to_string(GetParam().cause));
  EXPECT_EQ(run.outcome.dwells_done, 0U);
  ASSERT_EQ(run.sink.preflights.size(), 1U);
  EXPECT_FALSE(run.sink.preflights[0].passed);
  ASSERT_EQ(run.sink.points.size(), 1U);
  EXPECT_EQ(run.sink.points[0].status, PointStatus::stopped);
  const std::string words = describe_cause(run.outcome.trip, {"encoder"});
  EXPECT_NE(words.find(GetParam().text), std::string::npos) << words;
  EXPECT_EQ(words.rfind("encoder ", 0), 0U) << words;
}

INSTANTIATE_TEST_SUITE_P(
    Of, PreflightRefusal,
    testing::Values(
        Refusal{"AGainThatIsTooLow",
                {.min_gain = 3.0},
                [](auto&) {},
                TripCause::preflight_gain,
                "outside [sweep] preflight_gain (3); are unit, range and mechanism right?"},
        Refusal{"AGainThatIsTooHigh",
                {.max_gain = 1.0},
                [](auto&) {},
                TripCause::preflight_gain,
                "outside [sweep] preflight_gain (1)"},
        Refusal{"AWrongSign",
                {.min_phase_deg = -90.0, .max_phase_deg = 10.0},
                [](auto& rig) { rig.system.c *= -1.0; },
                TripCause::preflight_phase,
                "outside [sweep] preflight_phase_deg (-90°); is a sign wrong?"},
        Refusal{"ANoiseThatDrownsIt",
                {.min_snr_db = 20.0},
                [](auto& rig) { rig.sensors[0].imperfections.noise_rms = 0.5; },
                TripCause::preflight_noise,
                "[sweep] preflight_snr_db wants 20; look for the noise, or raise "
                "preflight_level"},
        Refusal{"ASensorThatIsDead",
                {},
                [](auto& rig) { rig.sensors[0].imperfections.stuck_at_s = 0.0; },
                TripCause::preflight_silent,
                "does not answer the pre-flight dwell"}),
    [](const auto& instance) { return std::string{instance.param.name}; });

Point of_phase(double degrees) {
  Point point;
  point.response = std::polar(1.0, degrees * std::numbers::pi / 180.0);
  point.output_amplitude = 1.0;
  point.snr_db = 40.0;
  return point;
}

TEST(Preflight, TakesPhasesByWholeTurns) {
  const PreflightSettings behind{.min_phase_deg = -200.0, .max_phase_deg = -160.0};
  EXPECT_FALSE(check_preflight(behind, of_phase(179.0), true).tripped());
  EXPECT_FALSE(check_preflight(behind, of_phase(-179.0), true).tripped());
  EXPECT_NEAR(check_preflight(behind, of_phase(0.0), true).value, 0.0, 1e-9);
  EXPECT_EQ(check_preflight(behind, of_phase(0.0), true).cause, TripCause::preflight_phase);
  EXPECT_FALSE(check_preflight(behind, of_phase(0.0), false).tripped());
  EXPECT_FALSE(check_preflight({}, of_phase(123.0), true).tripped());
}

TEST(Preflight, IsToldInOneLine) {
  EXPECT_EQ(describe(Preflight{.input = 1,
                               .output = 2,
                               .passed = true,
                               .frequency_hz = 1.0,
                               .amplitude = 0.05,
                               .gain = 0.998,
                               .phase_deg = -3.2,
                               .snr_db = 41.0},
                     {"command", "applied", "position"}),
            "passed: position/applied at 1 Hz, 0.05: gain 0.998, phase -3.2°, SNR 41 dB");
}

}  // namespace
}  // namespace sinerig
