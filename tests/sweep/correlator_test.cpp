// The coefficients that a run records, against the definition they come from: the integrals over
// whole cycles of what the sensor read.
#include <algorithm>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "support/collecting_sink.h"
#include "support/fake_rig.h"
#include "support/virtual_run.h"

namespace sinerig {
namespace {

constexpr double rate_hz = 1000.0;
constexpr long double two_pi = 2.0L * std::numbers::pi_v<long double>;

SweepPlan one_dwell(double frequency_hz, double cycles) {
  SweepSettings sweep;
  sweep.spacing = Spacing::list;
  sweep.frequencies_hz = {frequency_hz};
  sweep.frequency_tolerance = 1e-9;
  sweep.amplitude = 1.0;
  sweep.settling = Settling::fixed;
  sweep.target_db = 0.0;
  sweep.target_deg = 0.0;
  sweep.settle = {.cycles = 2.0, .seconds = 0.0};
  sweep.integrate = {.cycles = cycles, .seconds = 0.0};
  sweep.block = {.cycles = 1.0, .seconds = 0.0};
  return plan_sweep(sweep, {}, rate_hz);
}

// Phase of a tick of the only dwell, from integers.
long double angle_of(const SweepPlan& plan, std::uint64_t tick) {
  const Dwell& dwell = plan.dwells.front();
  const std::uint64_t index = dwell.tones.front().cycles * tick % dwell.block_samples;
  return two_pi * static_cast<long double>(index) / static_cast<long double>(dwell.block_samples);
}

struct FakeRun {
  test::CollectingSink sink;
  RunOutcome outcome;
};

FakeRun run_with_sensor(const SweepPlan& plan, test::FakeSensor::Value value) {
  FakeRun run;
  VirtualClock clock{TickGrid{plan.rate_hz}};
  test::FakeActuator actuator{clock};
  test::FakeSensor sensor{clock, std::move(value)};
  Sensor* const sensors[] = {&sensor};
  Guard guard{test::open_guard(1), clock.grid().period_s()};
  SweepRunner runner{plan,    {.responses = {}, .readbacks = {}, .record_samples = true},
                     clock,   actuator,
                     sensors, guard,
                     run.sink};
  RunControl control;
  run.outcome = runner.run(control);
  return run;
}

// 2/((N − M) T) ∫ y(t) w(ω0 (t − MT)) dt over [MT, NT] by the composite trapezoidal rule on the
// sampled values, both ends included.
long double trapezoidal(const SweepPlan& plan, const std::vector<TickSamples>& samples,
                        const Block& block, long double (*weight)(long double)) {
  const std::uint64_t n = plan.dwells.front().block_samples;
  long double sum = 0.0L;
  for (std::uint64_t k = 0; k <= n; ++k) {
    const std::uint64_t tick = block.first_tick + k;
    const auto y = static_cast<long double>(samples.at(tick).values.at(block.channel));
    const long double end = k == 0 || k == n ? 0.5L : 1.0L;
    sum += end * y * weight(angle_of(plan, tick));
  }
  return 2.0L * sum / static_cast<long double>(n);
}

class TrapezoidalRule : public testing::TestWithParam<double> {};

TEST_P(TrapezoidalRule, EqualsTheStreamedCoefficientsTo1e12) {
  const SweepPlan plan = one_dwell(GetParam(), std::max(6.0, 3.0 * GetParam()));
  const auto run = run_with_sensor(plan, [&](std::uint64_t tick) {
    const long double angle = angle_of(plan, tick);
    return static_cast<double>(0.3L + std::cos(angle) - 2.0L * std::sin(angle) +
                               0.5L * std::sin(3.0L * angle) + 0.25L * std::cos(2.0L * angle));
  });
  ASSERT_FALSE(run.outcome.trip.tripped());
  std::size_t checked = 0;
  for (const Block& block : run.sink.blocks) {
    const bool last =
        block.first_tick + plan.dwells.front().block_samples >= run.sink.samples.size();
    if (last) continue;  // its end sample belongs to a tick that is not run any more
    ++checked;
    const long double a = trapezoidal(plan, run.sink.samples, block,
                                      [](long double angle) { return std::cos(angle); });
    const long double b = trapezoidal(plan, run.sink.samples, block,
                                      [](long double angle) { return std::sin(angle); });
    EXPECT_NEAR(block.coefficients.a, static_cast<double>(a), 1e-12);
    EXPECT_NEAR(block.coefficients.b, static_cast<double>(b), 1e-12);
  }
  EXPECT_GE(checked, 2U);
}

INSTANTIATE_TEST_SUITE_P(Frequencies, TrapezoidalRule, testing::Values(0.5, 7.0, 123.0, 441.0));

TEST(Coefficients, AreThoseOfTheSignalWithItsMean) {
  const SweepPlan plan = one_dwell(8.0, 4.0);
  const auto run = run_with_sensor(plan, [&](std::uint64_t tick) {
    const long double angle = angle_of(plan, tick);
    return static_cast<double>(0.3L + 0.6L * std::cos(angle) - 2.0L * std::sin(angle));
  });
  ASSERT_FALSE(run.sink.blocks.empty());
  for (const Block& block : run.sink.blocks) {
    const bool sensor = block.channel == first_sensor_channel;
    EXPECT_NEAR(block.coefficients.a, sensor ? 0.6 : 0.0, 1e-14);
    EXPECT_NEAR(block.coefficients.b, sensor ? -2.0 : 1.0, 1e-14);
    EXPECT_NEAR(block.coefficients.mean, sensor ? 0.3 : 0.0, 1e-14);
  }
  const Point& point = run.sink.points.at(0);
  EXPECT_NEAR(point.response.real(), -2.0, 1e-14);
  EXPECT_NEAR(point.response.imag(), 0.6, 1e-14);
}

// 160 dB below the signal is 1e-8 of it, under an offset of a thousand times the signal.
class DynamicRange : public testing::TestWithParam<double> {};

TEST_P(DynamicRange, IsAtLeast160DecibelsUnderAnOffsetOfAThousandSignals) {
  const SweepPlan plan = one_dwell(GetParam() * rate_hz, 2.0);
  const auto run = run_with_sensor(plan, [&](std::uint64_t tick) {
    const long double angle = angle_of(plan, tick);
    return static_cast<double>(1000.0L + 0.8L * std::sin(angle) - 0.6L * std::cos(angle));
  });
  const Point& point = run.sink.points.at(0);
  EXPECT_EQ(point.status, PointStatus::good);
  EXPECT_LT(std::abs(point.response - std::complex<double>{0.8, -0.6}), 1e-8);
  for (const Block& block : run.sink.blocks) {
    if (block.channel == first_sensor_channel) {
      EXPECT_NEAR(block.coefficients.mean, 1000.0, 1e-9);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(PartsOfTheRate, DynamicRange,
                         testing::Values(1e-5, 1e-4, 1e-3, 0.0123, 0.1, 0.25, 0.37, 0.45));

TEST(DynamicRange, ShowsNothingOfAnOffsetAloneAt160Decibels) {
  for (const double part : {1e-5, 0.01, 0.45}) {
    const SweepPlan plan = one_dwell(part * rate_hz, 2.0);
    const auto run = run_with_sensor(plan, [](std::uint64_t) { return 1000.0; });
    EXPECT_LT(std::abs(run.sink.points.at(0).response), 1e-8) << part;
  }
}

}  // namespace
}  // namespace sinerig
