// Noise-free plants of every shape, measured through the whole loop from 0.001 to 0.45 of its rate,
// against the closed-form zero-order-hold response. Once settled, the two agree within 1e-9.
#include "support/exactness.h"

#include <cmath>
#include <complex>
#include <numbers>
#include <set>

#include <gtest/gtest.h>

namespace sinerig {
namespace {

using test::Complex;
using test::PartialFractions;
using test::rig_of;
using test::sweep_of_the_band;
using test::worst_error;

constexpr double two_pi = 2.0 * std::numbers::pi;

std::complex<double> pole_pair(double hz, double damping) {
  const double omega = two_pi * hz;
  return {-damping * omega, omega * std::sqrt(1.0 - damping * damping)};
}

std::vector<Complex> with_conjugates(const std::vector<std::complex<double>>& roots) {
  std::vector<Complex> all;
  for (const auto& root : roots) {
    all.emplace_back(root);
    if (root.imag() != 0.0) all.emplace_back(std::conj(root));
  }
  return all;
}

struct ZerosPoles {
  std::vector<std::complex<double>> zeros;
  std::vector<std::complex<double>> poles;
  double gain;
  double delay_s = 0.0;

  sim::LinearSystem system() const {
    auto built = sim::from_zeros_poles(zeros, poles, gain);
    built.dead_time_s = delay_s;
    return built;
  }
  PartialFractions reference() const {
    auto fractions = test::partial_fractions(with_conjugates(zeros), with_conjugates(poles), gain);
    fractions.delay_s = delay_s;
    return fractions;
  }
};

// Two lightly damped antiresonance/resonance pairs and two real poles.
ZerosPoles gimbal(double delay_s) {
  return {.zeros = {pole_pair(18.0, 0.01), pole_pair(75.0, 0.01)},
          .poles = {pole_pair(23.0, 0.01), pole_pair(90.0, 0.01), -5.0, -900.0},
          .gain = 4500.0,
          .delay_s = delay_s};
}

TEST(Exactness, OfATransferFunction) {
  const SweepPlan plan = plan_sweep(sweep_of_the_band(1000.0, 3.0), {}, 1000.0);
  const auto run = test::run_virtual(
      plan, rig_of(sim::from_transfer_function({309673.0}, {1.0, 347.0, 8987.0, 317356.0})));
  const std::vector<long double> den{1.0L, 347.0L, 8987.0L, 317356.0L};
  const auto reference = test::partial_fractions({309673.0L}, den, test::roots(den));
  EXPECT_LT(worst_error(plan, run, reference), 1e-9);
}

TEST(Exactness, OfATransferFunctionWithDirectFeedthrough) {
  const SweepPlan plan = plan_sweep(sweep_of_the_band(1000.0, 1.0), {}, 1000.0);
  const auto run =
      test::run_virtual(plan, rig_of(sim::from_transfer_function({2.0, 30.0}, {1.0, 80.0})));
  const auto reference =
      test::partial_fractions({2.0L, 30.0L}, {1.0L, 80.0L}, std::vector<Complex>{-80.0L});
  EXPECT_LT(worst_error(plan, run, reference), 1e-9);
}

TEST(Exactness, OfAPureGain) {
  const SweepPlan plan = plan_sweep(sweep_of_the_band(1000.0, 0.1), {}, 1000.0);
  const auto run = test::run_virtual(plan, rig_of(sim::from_transfer_function({-3.0}, {1.0})));
  EXPECT_LT(worst_error(run.sink.points, first_sensor_channel,
                        [](long double) {
                          return Complex{-3.0L, 0.0L};
                        }),
            1e-12);
}

TEST(Exactness, OfAStateSpaceWithTwoOutputs) {
  // Diagonal: the partial fractions are the matrices.
  Eigen::MatrixXd a(2, 2);
  a << -40.0, 0.0, 0.0, -300.0;
  Eigen::VectorXd b(2);
  b << 1.0, 2.0;
  Eigen::MatrixXd c(2, 2);
  c << 3.0, 4.0, -5.0, 0.0;
  Eigen::VectorXd d(2);
  d << 0.0, 0.25;
  auto rig = rig_of(sim::from_state_space(a, b, c, d, {"one", "two"}));
  rig.sensors = {{.output = 0, .imperfections = {}}, {.output = 1, .imperfections = {}}};
  const SweepPlan plan = plan_sweep(sweep_of_the_band(1000.0, 1.5), {}, 1000.0);
  const auto run = test::run_virtual(plan, rig);
  const PartialFractions one{.poles = {-40.0L, -300.0L}, .residues = {3.0L, 8.0L}};
  const PartialFractions two{.poles = {-40.0L}, .residues = {-5.0L}, .direct = 0.25L};
  for (const auto& [output, reference] : {std::pair{2, one}, std::pair{3, two}}) {
    EXPECT_LT(worst_error(run.sink.points, static_cast<std::uint16_t>(output),
                          [&reference = reference](long double omega) {
                            return test::held_response(reference, omega, 1e-3L);
                          }),
              1e-9);
  }
}

class ExactnessOfAGimbal : public testing::TestWithParam<double> {};

TEST_P(ExactnessOfAGimbal, WithDeadTime) {
  const ZerosPoles plant = gimbal(GetParam());
  const SweepPlan plan = plan_sweep(sweep_of_the_band(1000.0, 20.0, 25), {}, 1000.0);
  const auto run = test::run_virtual(plan, rig_of(plant.system()));
  EXPECT_LT(worst_error(plan, run, plant.reference()), 1e-9);
}

// None, a tick, a tick and a half, a fraction of a tick, more than the sweep has cycles.
INSTANTIATE_TEST_SUITE_P(DeadTimes, ExactnessOfAGimbal,
                         testing::Values(0.0, 0.001, 0.0015, 0.000123, 0.0473));

TEST(Exactness, HoldsInEveryQuadrantAndOverAThousandTurnsOfDelay) {
  const ZerosPoles plant{.zeros = {}, .poles = {-60.0, -200.0}, .gain = 1e4, .delay_s = 2.7345};
  const SweepPlan plan = plan_sweep(sweep_of_the_band(1000.0, 4.0), {}, 1000.0);
  const auto run = test::run_virtual(plan, rig_of(plant.system()));
  EXPECT_LT(worst_error(plan, run, plant.reference()), 1e-9);
  std::set<std::pair<bool, bool>> quadrants;
  for (const Point& point : run.sink.points) {
    quadrants.emplace(std::signbit(point.response.real()), std::signbit(point.response.imag()));
  }
  EXPECT_EQ(quadrants.size(), 4U);
}

TEST(Exactness, OfOrder26OverTwoDecades) {
  ZerosPoles plant{.zeros = {}, .poles = {}, .gain = 1.0};
  for (int i = 0; i < 13; ++i) {
    const double hz = 4.0 * std::pow(100.0, i / 12.0);
    plant.poles.push_back(pole_pair(hz, 0.1));
    plant.gain *= std::norm(plant.poles.back());
    if (i == 12) break;
    plant.zeros.push_back(pole_pair(1.2 * hz, 0.1));
    plant.gain /= std::norm(plant.zeros.back());
  }
  ASSERT_EQ(plant.system().states(), 26);
  const SweepPlan plan = plan_sweep(sweep_of_the_band(1000.0, 16.0, 16), {}, 1000.0);
  const auto run = test::run_virtual(plan, rig_of(plant.system()));
  EXPECT_LT(worst_error(plan, run, plant.reference()), 1e-9);
}

// 1/(s + a)², whose step-invariant discretisation is in every table of z-transforms.
TEST(Exactness, OfADoublePole) {
  constexpr long double a = 70.0L;
  constexpr long double period_s = 1e-3L;
  const SweepPlan plan = plan_sweep(sweep_of_the_band(1000.0, 1.0), {}, 1000.0);
  const auto run = test::run_virtual(plan, rig_of(sim::from_zeros_poles({}, {-70.0, -70.0}, 1.0)));
  const auto exact = [](long double omega) {
    const Complex z = std::polar(1.0L, omega * period_s);
    const long double e = std::exp(-a * period_s);
    return (1.0L / (a * a)) *
           (1.0L - (z - 1.0L) / (z - e) - a * period_s * e * (z - 1.0L) / ((z - e) * (z - e)));
  };
  EXPECT_LT(worst_error(run.sink.points, first_sensor_channel, exact), 1e-9);
}

// Never settles: the offset that it starts with stays, and is orthogonal to the sine.
TEST(Exactness, OfAFreeIntegrator) {
  const SweepPlan plan = plan_sweep(sweep_of_the_band(1000.0, 0.2), {}, 1000.0);
  const auto run = test::run_virtual(plan, rig_of(sim::from_transfer_function({5.0}, {1.0, 0.0})));
  const PartialFractions integrator{.poles = {0.0L}, .residues = {5.0L}};
  EXPECT_LT(worst_error(plan, run, integrator), 1e-9);
}

class ExactnessAtRate : public testing::TestWithParam<double> {};

TEST_P(ExactnessAtRate, WhosePeriodMayBeNoWholeNumberOfNanoseconds) {
  const double rate_hz = GetParam();
  const double scale = rate_hz / 1000.0;
  const ZerosPoles plant{.zeros = {-90.0 * scale},
                         .poles = {pole_pair(40.0 * scale, 0.2), -300.0 * scale},
                         .gain = 1e5 * scale * scale,
                         .delay_s = 0.00037 / scale};
  const SweepPlan plan = plan_sweep(sweep_of_the_band(rate_hz, 0.9 / scale), {}, rate_hz);
  const auto run = test::run_virtual(plan, rig_of(plant.system()));
  EXPECT_LT(worst_error(plan, run, plant.reference()), 1e-9);
}

INSTANTIATE_TEST_SUITE_P(Rates, ExactnessAtRate,
                         testing::Values(0.7, 48.0, 1000.0, 3000.0, 22'050.0, 99'999.999));

// The clamped command has harmonics of its own, which the output shows: no fault of the plant.
SweepPlan plan_with(Settling settling) {
  SweepSettings sweep = sweep_of_the_band(1000.0, 4.0, 20);
  sweep.settling = settling;
  return plan_sweep(sweep, {}, 1000.0);
}

// What goes out is clamped at 70 % and has 15 steps: H is of what went out.
struct CoarseRun {
  SweepPlan plan;
  ZerosPoles plant{.zeros = {}, .poles = {pole_pair(35.0, 0.05), -200.0}, .gain = 9e6};
  test::VirtualRun run;

  explicit CoarseRun(Settling settling = Settling::fixed) : plan{plan_with(settling)} {
    auto rig = rig_of(plant.system());
    rig.actuator.min = -0.49;
    rig.actuator.max = 0.49;
    rig.actuator.quantum = 0.07;
    run = test::run_virtual(plan, rig);
  }
};

TEST(Exactness, IsNotTouchedByAClampedAndCoarselyQuantisedActuator) {
  const CoarseRun coarse;
  EXPECT_LT(worst_error(coarse.plan, coarse.run, coarse.plant.reference()), 1e-6);
}

// The harmonics of such a command alias to wherever they like; only whole blocks are orthogonal to
// them all, and only the drift of the blocks' means is.
TEST(Exactness, NorByOneWhereSettlingIsDetected) {
  const CoarseRun coarse{Settling::detect};
  EXPECT_LT(worst_error(coarse.plan, coarse.run, coarse.plant.reference()), 1e-6);
}

TEST(Exactness, WouldBeLostByPercentIfTheCommandWereTakenForTheInput) {
  const CoarseRun coarse;
  for (const Point& point : coarse.run.sink.points) {
    const double from_command =
        point.output_amplitude / coarse.plan.dwells[point.dwell].tones.front().amplitude;
    EXPECT_GT(std::abs(from_command / std::abs(point.response) - 1.0), 0.02) << point.frequency_hz;
  }
}

}  // namespace
}  // namespace sinerig
