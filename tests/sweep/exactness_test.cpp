// Noise-free plants of every shape, measured through the whole loop, against the closed-form
// zero-order-hold response.
#include <cmath>
#include <complex>
#include <numbers>

#include <gtest/gtest.h>

#include "support/virtual_run.h"
#include "support/zero_order_hold.h"

namespace sinerig {
namespace {

using test::Complex;
using test::PartialFractions;

constexpr long double two_pi = 2.0L * std::numbers::pi_v<long double>;

SweepSettings sweep_of_the_band(double rate_hz, double settle_s) {
  SweepSettings sweep;
  sweep.start_hz = 0.001 * rate_hz;
  sweep.stop_hz = 0.45 * rate_hz;
  sweep.points = 40;
  sweep.amplitude = 0.7;
  sweep.settling = Settling::fixed;
  sweep.target_db = 0.0;
  sweep.target_deg = 0.0;
  sweep.settle = {.cycles = 2.0, .seconds = settle_s};
  sweep.integrate = {.cycles = 2.0, .seconds = 0.1};
  return sweep;
}

// Worst relative error of the sweep against the closed form.
double worst_error(const SweepPlan& plan, const test::VirtualRun& run,
                   const PartialFractions& reference, long double sample_age_s = 0.0L) {
  long double worst = 0.0L;
  for (const Point& point : run.sink.points) {
    EXPECT_EQ(point.status, PointStatus::good) << point.frequency_hz;
    const Complex exact = test::held_response(reference, two_pi * point.frequency_hz,
                                              1.0L / plan.rate_hz, sample_age_s);
    worst = std::max(worst, std::abs(Complex{point.response} - exact) / std::abs(exact));
  }
  return static_cast<double>(worst);
}

sim::SimulatedRigSettings rig_of(sim::LinearSystem system) {
  sim::SimulatedRigSettings rig;
  rig.system = std::move(system);
  rig.sensors.resize(1);
  return rig;
}

TEST(Exactness, FilterGivenByItsTransferFunction) {
  const SweepPlan plan = plan_sweep(sweep_of_the_band(1000.0, 3.0), {}, 1000.0);
  const auto run = test::run_virtual(
      plan, rig_of(sim::from_transfer_function({309673.0}, {1.0, 347.0, 8987.0, 317356.0})));
  const std::vector<long double> den{1.0L, 347.0L, 8987.0L, 317356.0L};
  const auto reference = test::partial_fractions({309673.0L}, den, test::roots(den));
  EXPECT_EQ(run.sink.points.size(), plan.dwells.size());
  EXPECT_LT(worst_error(plan, run, reference), 1e-9);
}

// Lightly damped pairs, a real pole, dead time of one and a half ticks.
struct GimbalCase {
  double delay_s;
  double sample_age_s;
};

class ExactnessOfAGimbal : public testing::TestWithParam<GimbalCase> {};

TEST_P(ExactnessOfAGimbal, MatchesTheClosedForm) {
  const auto [delay_s, sample_age_s] = GetParam();
  const auto pair = [](double hz, double damping) {
    const double omega = 2.0 * std::numbers::pi * hz;
    return std::complex<double>{-damping * omega, omega * std::sqrt(1.0 - damping * damping)};
  };
  const std::vector<std::complex<double>> zeros{pair(18.0, 0.01), pair(75.0, 0.01)};
  const std::vector<std::complex<double>> poles{pair(23.0, 0.01), pair(90.0, 0.01), -5.0, -900.0};
  auto system = sim::from_zeros_poles(zeros, poles, 4500.0);
  system.dead_time_s = delay_s;

  std::vector<Complex> all_zeros;
  std::vector<Complex> all_poles;
  for (const auto& zero : zeros) {
    all_zeros.emplace_back(zero);
    all_zeros.emplace_back(std::conj(zero));
  }
  for (const auto& pole : poles) {
    all_poles.emplace_back(pole);
    if (pole.imag() != 0.0) all_poles.emplace_back(std::conj(pole));
  }
  PartialFractions reference = test::partial_fractions(all_zeros, all_poles, 4500.0L);
  reference.delay_s = delay_s;

  auto rig = rig_of(system);
  rig.sensors[0].imperfections.delay_s = sample_age_s;
  const SweepPlan plan = plan_sweep(sweep_of_the_band(1000.0, 20.0), {}, 1000.0);
  const auto run = test::run_virtual(plan, rig);
  EXPECT_LT(worst_error(plan, run, reference, sample_age_s), 1e-9);
}

INSTANTIATE_TEST_SUITE_P(DeadTimesAndSamplingInstants, ExactnessOfAGimbal,
                         testing::Values(GimbalCase{0.0, 0.0}, GimbalCase{0.001, 0.0},
                                         GimbalCase{0.0015, 0.0}, GimbalCase{0.0473, 0.0}));

}  // namespace
}  // namespace sinerig
