// Random plans over random plants: each is refused with a reason or runs to its end inside its
// limits, every point on the closed form. SINERIG_TEST_SEED and SINERIG_TEST_COUNT choose how many.
#include <cmath>
#include <complex>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include "support/parameters.h"
#include "support/virtual_run.h"
#include "support/zero_order_hold.h"

namespace sinerig {
namespace {

using test::Complex;

constexpr double two_pi = 2.0 * std::numbers::pi;

class Dice {
 public:
  explicit Dice(std::uint64_t seed) : generator_{seed} {}

  double between(double low, double high) {
    return std::uniform_real_distribution<double>{low, high}(generator_);
  }
  double between_log(double low, double high) {
    return std::exp(between(std::log(low), std::log(high)));
  }
  bool chance(double probability) { return between(0.0, 1.0) < probability; }
  std::uint32_t up_to(std::uint32_t largest) {
    return 1 + static_cast<std::uint32_t>(generator_() % largest);
  }

 private:
  std::mt19937_64 generator_;
};

struct RandomPlant {
  sim::LinearSystem system;
  test::PartialFractions reference;
  double slowest_rad_s = 0.0;
};

// Poles between a twentieth and half of the rate, in 1/s, so that settling takes few ticks.
RandomPlant random_plant(Dice& dice, double rate_hz) {
  RandomPlant plant;
  std::vector<std::complex<double>> poles;
  std::vector<Complex> all_poles;
  const std::uint32_t groups = dice.up_to(3);
  plant.slowest_rad_s = rate_hz;
  for (std::uint32_t i = 0; i < groups; ++i) {
    const double real = -dice.between(0.05, 0.5) * rate_hz;
    const double imaginary = dice.chance(0.5) ? dice.between(0.1, 1.0) * rate_hz : 0.0;
    poles.emplace_back(real, imaginary);
    all_poles.emplace_back(real, imaginary);
    if (imaginary != 0.0) all_poles.emplace_back(real, -imaginary);
    plant.slowest_rad_s = std::min(plant.slowest_rad_s, -real);
  }
  std::vector<std::complex<double>> zeros;
  if (all_poles.size() > 1 && dice.chance(0.5))
    zeros.emplace_back(-dice.between(0.1, 1.0) * rate_hz);
  const double gain = std::pow(rate_hz, static_cast<double>(all_poles.size() - zeros.size())) *
                      dice.between(0.1, 10.0);
  plant.system = sim::from_zeros_poles(zeros, poles, gain);
  plant.reference = test::partial_fractions({zeros.begin(), zeros.end()}, all_poles, gain);
  if (dice.chance(0.5)) {
    plant.system.dead_time_s = dice.between(0.0, 7.0) / rate_hz;
    plant.reference.delay_s = plant.system.dead_time_s;
  }
  return plant;
}

SweepSettings random_sweep(Dice& dice, double rate_hz) {
  SweepSettings sweep;
  const auto frequency = [&] {
    return dice.between_log(0.002, 0.52) * rate_hz;
  };
  if (dice.chance(0.3)) {
    sweep.spacing = Spacing::list;
    for (std::uint32_t i = dice.up_to(6); i > 0; --i) sweep.frequencies_hz.push_back(frequency());
  } else {
    sweep.spacing = dice.chance(0.5) ? Spacing::linear : Spacing::logarithmic;
    sweep.start_hz = frequency();
    sweep.stop_hz = frequency();
    sweep.points = dice.up_to(6);
  }
  sweep.frequency_tolerance = dice.between_log(1e-5, 0.05);
  sweep.neutral = dice.between(-0.2, 0.2);
  sweep.amplitude = dice.between_log(0.1, 2.0);
  if (dice.chance(0.3)) {
    double break_hz = 0.001 * rate_hz;
    for (std::uint32_t i = dice.up_to(4); i > 0; --i) {
      break_hz *= dice.between(1.1, 10.0);
      sweep.amplitude_table.push_back(
          {.frequency_hz = break_hz, .amplitude = dice.between_log(0.01, 2.0)});
    }
  }
  if (dice.chance(0.3)) sweep.follow_velocity = dice.between_log(0.01, 3.0) * rate_hz;
  if (dice.chance(0.3)) sweep.follow_acceleration = dice.between_log(0.01, 9.0) * rate_hz * rate_hz;
  if (dice.chance(0.5)) sweep.ramp_s = dice.between_log(1.0, 1000.0) / rate_hz;
  sweep.integrate = {.cycles = dice.between(0.0, 4.0),
                     .seconds = dice.between(0.0, 300.0) / rate_hz};
  sweep.block = {.cycles = dice.between(1.0, 3.0), .seconds = dice.between(0.0, 50.0) / rate_hz};
  return sweep;
}

MotionLimits random_limits(Dice& dice, double rate_hz) {
  MotionLimits limits;
  if (dice.chance(0.5)) limits.command_max = dice.between(0.5, 3.0);
  if (dice.chance(0.5)) limits.command_min = -dice.between(0.5, 3.0);
  if (dice.chance(0.5)) limits.slew_per_s = dice.between_log(0.1, 10.0) * rate_hz;
  if (dice.chance(0.3)) limits.velocity_max = dice.between_log(0.1, 10.0) * rate_hz;
  if (dice.chance(0.3)) limits.acceleration_max = dice.between_log(0.1, 40.0) * rate_hz * rate_hz;
  return limits;
}

TEST(RandomPlans, AreRefusedWithAReasonOrRunToTheEndOnTheClosedForm) {
  const std::uint64_t first_seed = test::seed(1);
  const std::uint64_t plans = test::count(300);
  std::uint64_t refused = 0;
  for (std::uint64_t i = 0; i < plans; ++i) {
    SCOPED_TRACE(testing::Message()
                 << "SINERIG_TEST_SEED=" << first_seed + i << " SINERIG_TEST_COUNT=1");
    Dice dice{first_seed + i};
    const double rate_hz = std::round(dice.between_log(5.0, 30'000.0) * 1000.0) / 1000.0;
    const RandomPlant plant = random_plant(dice, rate_hz);
    SweepSettings sweep = random_sweep(dice, rate_hz);
    sweep.settling = Settling::fixed;
    sweep.target_db = 0.0;
    sweep.target_deg = 0.0;
    sweep.settle = {.cycles = 1.0, .seconds = 0.0};
    // The ramp, which may take half of the longest cycle, the dead time, then the transient.
    sweep.settle.seconds =
        std::max(sweep.ramp_s, 260.0 / rate_hz) + 8.0 / rate_hz + 38.0 / plant.slowest_rad_s;
    const MotionLimits limits = random_limits(dice, rate_hz);

    SweepPlan plan;
    try {
      plan = plan_sweep(sweep, limits, rate_hz);
    } catch (const PlanRefused& reason) {
      ++refused;
      ASSERT_STRNE(reason.what(), "");
      ASSERT_EQ(reason.section(), "sweep");
      ASSERT_NE(reason.key(), "");
      continue;
    }
    sim::SimulatedRigSettings rig;
    rig.system = plant.system;
    rig.sensors.resize(1);
    rig.neutral = sweep.neutral;
    GuardSettings guard = test::open_guard(1);
    guard.command_min = limits.command_min;
    guard.command_max = limits.command_max;
    guard.slew_per_s = limits.slew_per_s;
    guard.neutral = sweep.neutral;
    const auto run = test::run_virtual(plan, rig, guard);
    ASSERT_FALSE(run.outcome.trip.tripped()) << describe(run.outcome.trip, {"y"});
    ASSERT_EQ(run.sink.points.size(), plan.dwells.size());
    for (const Point& point : run.sink.points) {
      const Complex exact = test::held_response(plant.reference, two_pi * point.frequency_hz,
                                                1.0L / static_cast<long double>(rate_hz));
      const auto error =
          static_cast<double>(std::abs(Complex{point.response} - exact) / std::abs(exact));
      ASSERT_EQ(point.status, PointStatus::good)
          << to_string(point.reason) << " " << point.reason_value << ", error " << error << ", "
          << point.frequency_hz << " Hz at " << rate_hz << " Hz, SNR " << point.snr_db;
      ASSERT_LT(error, 1e-9) << point.frequency_hz << " Hz at " << rate_hz << " Hz";
    }
  }
  // Both outcomes must have been met for the test to mean anything.
  if (plans >= 100) {
    EXPECT_GT(refused, plans / 10);
    EXPECT_LT(refused, plans * 9 / 10);
  }
}

}  // namespace
}  // namespace sinerig
