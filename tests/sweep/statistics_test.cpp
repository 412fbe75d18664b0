// The statistics of a point, as statistics: fixed seeds, bounds that a correct estimator misses
// once in 10⁶ runs at most. `tools/bench quality` measures the same with many more.
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "support/virtual_run.h"
#include "support/zero_order_hold.h"

namespace sinerig {
namespace {

using test::Complex;

constexpr double rate_hz = 1000.0;
constexpr long double two_pi = 2.0L * std::numbers::pi_v<long double>;

const std::complex<double> pole{-65.97344573, 67.30637726};  // 15 Hz, damping 0.7

std::complex<double> truth(double frequency_hz) {
  const auto modes = test::partial_fractions({}, {Complex{pole}, Complex{std::conj(pole)}},
                                             static_cast<long double>(std::norm(pole)));
  return std::complex<double>{
      test::held_response(modes, two_pi * static_cast<long double>(frequency_hz), 1.0L / rate_hz)};
}

sim::SimulatedRigSettings rig_of(std::uint64_t seed) {
  sim::SimulatedRigSettings rig;
  rig.system = sim::from_zeros_poles({}, {pole}, std::norm(pole));
  rig.sensors.resize(1);
  rig.seed = seed;
  return rig;
}

SweepSettings ten_points() {
  SweepSettings sweep;
  sweep.start_hz = 5.0;
  sweep.stop_hz = 100.0;
  sweep.points = 10;
  sweep.frequency_tolerance = 0.01;
  sweep.amplitude = 1.0;
  return sweep;
}

double gain_error_db(const Point& point) {
  return std::abs(20.0 * std::log10(std::abs(point.response / truth(point.frequency_hz))));
}

// 600 intervals: 95 % of them is 570 ± 5.3.
void expect_coverage(const SweepSettings& sweep, double sim::SensorImperfections::*noise, int least,
                     int most) {
  const SweepPlan plan = plan_sweep(sweep, {}, rate_hz);
  int covered = 0;
  int points = 0;
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    auto rig = rig_of(seed);
    rig.sensors[0].imperfections.*noise = 0.02;
    for (const Point& point : test::run_virtual(plan, rig).sink.points) {
      covered += gain_error_db(point) <= point.gain_interval_db ? 1 : 0;
      ++points;
    }
  }
  ASSERT_EQ(points, 600);
  EXPECT_GE(covered, least);
  EXPECT_LE(covered, most);
}

TEST(Statistics, IntervalsOfAFixedLengthCoverWhiteNoise) {
  SweepSettings sweep = ten_points();
  sweep.settling = Settling::fixed;
  sweep.settle = {.cycles = 1.0, .seconds = 0.5};
  sweep.target_db = 0.0;
  sweep.target_deg = 0.0;
  sweep.integrate = {.cycles = 4.0, .seconds = 0.0};
  expect_coverage(sweep, &sim::SensorImperfections::noise_rms, 540, 596);
}

SweepSettings to_a_target() {
  SweepSettings sweep = ten_points();
  sweep.target_db = 0.3;
  sweep.target_deg = 2.0;
  return sweep;
}

TEST(Statistics, IntervalsCoverWhereTheirWidthEndsTheDwell) {
  expect_coverage(to_a_target(), &sim::SensorImperfections::noise_rms, 535, 600);
}

TEST(Statistics, IntervalsCoverColouredNoise) {
  expect_coverage(to_a_target(), &sim::SensorImperfections::pink_noise_rms, 520, 600);
}

TEST(Statistics, LostSamplesAndDriftLeaveNoBias) {
  SweepSettings sweep = ten_points();
  sweep.settle = {.cycles = 1.0, .seconds = 1.0};
  auto rig = rig_of(1);
  rig.sensors[0].imperfections.lost_fraction = 0.05;
  rig.sensors[0].imperfections.drift_per_s = 50.0;
  const auto run = test::run_virtual(plan_sweep(sweep, {}, rate_hz), rig);
  ASSERT_EQ(run.sink.points.size(), 10U);
  for (const Point& point : run.sink.points) {
    EXPECT_LT(std::abs(point.response / truth(point.frequency_hz) - 1.0), 1e-6)
        << point.frequency_hz;
    EXPECT_GT(point.lost, 0.0);
  }
}

TEST(Statistics, ALightlyDampedModeIsWaitedFor) {
  SweepSettings sweep = ten_points();
  sweep.spacing = Spacing::list;
  sweep.frequencies_hz = {6.0, 7.0, 7.5, 8.0, 8.5, 9.0};
  const std::complex<double> mode{-1.0053, 50.2554};  // 8 Hz, damping 0.02: a second to 1/e
  auto rig = rig_of(1);
  rig.system = sim::from_zeros_poles({}, {mode}, std::norm(mode));
  rig.sensors[0].imperfections.noise_rms = 1e-3;
  const auto modes = test::partial_fractions({}, {Complex{mode}, Complex{std::conj(mode)}},
                                             static_cast<long double>(std::norm(mode)));
  const auto run = test::run_virtual(plan_sweep(sweep, {}, rate_hz), rig);
  ASSERT_EQ(run.sink.points.size(), 6U);
  for (const Point& point : run.sink.points) {
    const std::complex<double> exact{test::held_response(
        modes, two_pi * static_cast<long double>(point.frequency_hz), 1.0L / rate_hz)};
    EXPECT_EQ(point.status, PointStatus::good) << point.frequency_hz;
    EXPECT_LT(std::abs(point.response / exact - 1.0), 0.012) << point.frequency_hz;
  }
}

// Within a cycle or two the second and the third harmonic of 9.7 Hz take in a mode at 23 Hz, and no
// residual shows it.
TEST(Statistics, ARingingModeIsNotTakenForHarmonics) {
  SweepSettings sweep;
  sweep.start_hz = 0.5;
  sweep.stop_hz = 50.0;
  sweep.points = 60;
  sweep.amplitude = 0.7;
  const SweepPlan plan = plan_sweep(sweep, {}, rate_hz);
  constexpr double twice_target_db = 0.1;
  constexpr double twice_target_deg = 0.6;
  int beyond = 0;
  for (const double damping : {0.01, 0.05}) {
    const double natural_rad_s = 2.0 * std::numbers::pi * 23.0;
    const std::complex<double> mode{-damping * natural_rad_s,
                                    natural_rad_s * std::sqrt(1.0 - damping * damping)};
    const auto modes = test::partial_fractions({}, {Complex{mode}, Complex{std::conj(mode)}},
                                               static_cast<long double>(std::norm(mode)));
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
      auto rig = rig_of(seed);
      rig.system = sim::from_zeros_poles({}, {mode}, std::norm(mode));
      rig.sensors[0].imperfections.noise_rms = 1e-3;
      for (const Point& point : test::run_virtual(plan, rig).sink.points) {
        if (point.status != PointStatus::good) continue;
        const std::complex<double> exact{test::held_response(
            modes, two_pi * static_cast<long double>(point.frequency_hz), 1.0L / rate_hz)};
        const std::complex<double> off = point.response / exact;
        const bool far = std::abs(20.0 * std::log10(std::abs(off))) > twice_target_db ||
                         std::abs(std::arg(off)) * 180.0 / std::numbers::pi > twice_target_deg;
        if (far) ++beyond;
      }
    }
  }
  EXPECT_EQ(beyond, 0) << "of 2400 points, the default target 0.05 dB and 0.3 degrees";
}

TEST(Statistics, TheModeOfASecondResponseIsWaitedFor) {
  SweepSettings sweep = ten_points();
  sweep.spacing = Spacing::list;
  sweep.frequencies_hz = {6.0, 7.0, 7.5, 8.0, 8.5, 9.0};
  const std::complex<double> mode{-1.0053, 50.2554};  // 8 Hz, damping 0.02
  const double fast = -2000.0;
  sim::LinearSystem system;
  system.a = Eigen::MatrixXd::Zero(3, 3);
  system.a << fast, 0.0, 0.0, 0.0, 2.0 * mode.real(), -std::norm(mode), 0.0, 1.0, 0.0;
  system.b = Eigen::Vector3d{-fast, std::norm(mode), 0.0};
  system.c = Eigen::MatrixXd::Zero(2, 3);
  system.c << 1.0, 0.0, 0.0, 0.0, 0.0, 1.0;
  system.d = Eigen::Vector2d::Zero();
  system.outputs = {"fast", "flexible"};
  auto rig = rig_of(1);
  rig.system = system;
  rig.sensors.resize(2);
  rig.sensors[1].output = 1;
  for (auto& sensor : rig.sensors) sensor.imperfections.noise_rms = 1e-3;
  const auto modes = test::partial_fractions({}, {Complex{mode}, Complex{std::conj(mode)}},
                                             static_cast<long double>(std::norm(mode)));
  const auto run = test::run_virtual(plan_sweep(sweep, {}, rate_hz), rig);
  ASSERT_EQ(run.sink.points.size(), 12U);
  for (const Point& point : run.sink.points) {
    EXPECT_EQ(point.status, PointStatus::good) << point.frequency_hz;
    if (point.pair == 0) continue;
    const std::complex<double> exact{test::held_response(
        modes, two_pi * static_cast<long double>(point.frequency_hz), 1.0L / rate_hz)};
    EXPECT_LT(std::abs(point.response / exact - 1.0), 0.012) << point.frequency_hz;
  }
}

// A measured input has noise of its own, here most of the variance: 300 intervals, 285 ± 3.8.
TEST(Statistics, IntervalsCoverWhereTheInputIsMeasured) {
  SweepSettings sweep = ten_points();
  sweep.target_db = 0.0;
  sweep.target_deg = 0.0;
  sweep.integrate = {.cycles = 4.0, .seconds = 1.0};
  const SweepPlan plan = plan_sweep(sweep, {}, rate_hz);
  RunnerSettings runner;
  runner.responses = {{.input = 2, .output = 1, .exact_input = false}};
  int covered = 0;
  int points = 0;
  double width_db = 0.0;
  double square_db = 0.0;
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    auto rig = rig_of(seed);
    rig.sensors.resize(2);
    rig.sensors[0].imperfections.noise_rms = 1e-4;
    rig.sensors[1].signal = sim::Signal::plant_input;
    rig.controller =
        sim::ControllerSettings{.proportional = 1e-9, .injection = sim::Injection::plant_input};
    rig.sensors[1].imperfections.noise_rms = 0.02;
    for (const Point& point :
         test::run_virtual(plan, rig, test::open_guard(2), runner).sink.points) {
      EXPECT_NE(point.status, PointStatus::unsettled) << to_string(point.reason);
      const double error_db = gain_error_db(point);
      covered += error_db <= point.gain_interval_db ? 1 : 0;
      width_db += point.gain_interval_db;
      square_db += error_db * error_db;
      ++points;
    }
  }
  ASSERT_EQ(points, 300);
  EXPECT_GE(covered, 267);
  // Twice the error that there is, not twenty times.
  EXPECT_LT(width_db / points, 3.0 * std::sqrt(square_db / points));
}

TEST(Points, WithoutAnEstimateAreNeverGood) {
  SweepSettings sweep = ten_points();
  sweep.settle_max = {.cycles = 2.0, .seconds = 0.5};
  sweep.integrate_max = {.cycles = 2.0, .seconds = 0.5};
  const SweepPlan plan = plan_sweep(sweep, {}, rate_hz);
  auto rig = rig_of(1);
  rig.sensors.resize(2);
  rig.sensors[1].imperfections.lost_fraction = 1.0;
  for (const bool as_input : {false, true}) {
    RunnerSettings runner;
    runner.responses = {as_input ? Pair{.input = 2, .output = 1, .exact_input = false}
                                 : Pair{.input = 0, .output = 2}};
    const auto run = test::run_virtual(plan, rig, test::open_guard(2), runner);
    ASSERT_EQ(run.sink.points.size(), 10U);
    for (const Point& point : run.sink.points) {
      EXPECT_EQ(point.status, PointStatus::low_signal);
      EXPECT_EQ(point.reason, PointReason::no_data);
    }
  }
}

// What is left of a sensor that stops in the midst of a dwell is the rounding of the totals.
TEST(Points, OfASensorThatStopsAreStuck) {
  SweepSettings sweep = ten_points();
  sweep.settle_max = {.cycles = 20.0, .seconds = 5.0};
  for (const double at_s : {0.3, 0.7, 1.2}) {
    auto rig = rig_of(1);
    rig.sensors[0].imperfections.stuck_at_s = at_s;
    sweep.points = 1;
    sweep.harmonics = at_s < 0.5 ? 1 : 3;
    sweep.integrate.seconds = 2.0;
    const auto run = test::run_virtual(plan_sweep(sweep, {}, rate_hz), rig);
    ASSERT_EQ(run.sink.points.size(), 1U);
    EXPECT_NE(run.sink.points[0].status, PointStatus::good) << at_s;
    EXPECT_EQ(run.sink.points[0].reason, PointReason::stuck) << at_s;
  }
}

}  // namespace
}  // namespace sinerig
