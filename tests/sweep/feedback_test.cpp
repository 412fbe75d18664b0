// Identification under feedback: the plant from two measured signals, the loop functions beside it.
#include <cmath>
#include <complex>
#include <numbers>

#include <gtest/gtest.h>

#include "support/virtual_run.h"
#include "support/zero_order_hold.h"

namespace sinerig {
namespace {

using test::Complex;

constexpr double rate_hz = 1000.0;
constexpr double proportional = 3.0;

// An integrator with a lag: 20 / (s (s / 60 + 1)), under proportional control.
sim::SimulatedRigSettings controlled_rig(sim::Injection injection) {
  sim::SimulatedRigSettings rig;
  rig.system = sim::from_zeros_poles({}, {0.0, -60.0}, 1200.0);
  rig.controller = sim::ControllerSettings{.proportional = proportional, .injection = injection};
  rig.sensors.resize(4);
  rig.sensors[1].signal = sim::Signal::plant_input;
  rig.sensors[2].signal = sim::Signal::control;
  rig.sensors[3].signal = sim::Signal::error;
  return rig;
}

// Regression channels: 0 applied, then output, plant input, control, error.
constexpr std::size_t applied = 0;
constexpr std::size_t output = 1;
constexpr std::size_t plant_input = 2;
constexpr std::size_t control = 3;
constexpr std::size_t error = 4;

Pair over(std::size_t out, std::size_t in) {
  return {.input = in, .output = out, .exact_input = in == applied};
}

Complex plant_at(double frequency_hz) {
  const auto reference =
      test::partial_fractions(std::vector<Complex>{}, std::vector<Complex>{0.0L, -60.0L}, 1200.0L);
  return test::held_response(reference, 2.0L * std::numbers::pi_v<long double> * frequency_hz,
                             1.0L / rate_hz);
}

SweepPlan plan_under_feedback() {
  SweepSettings sweep;
  sweep.start_hz = 0.7;
  sweep.stop_hz = 180.0;
  sweep.points = 15;
  sweep.amplitude = 0.3;
  sweep.settling = Settling::fixed;
  sweep.settle = {.cycles = 1.0, .seconds = 3.0};
  sweep.integrate = {.cycles = 2.0, .seconds = 0.2};
  sweep.target_db = 0.0;
  sweep.target_deg = 0.0;
  return plan_sweep(sweep, {}, rate_hz);
}

TEST(Feedback, GivesThePlantAndTheLoopFunctionsWithTheDitherAtThePlantInput) {
  const auto settings = controlled_rig(sim::Injection::plant_input);
  RunnerSettings runner;
  runner.responses = {over(output, plant_input), over(plant_input, applied), over(control, applied),
                      over(control, plant_input)};
  const auto run = test::run_virtual(plan_under_feedback(), settings, test::open_guard(4), runner);
  ASSERT_EQ(run.sink.points.size(), 4U * 15U);
  for (const Point& point : run.sink.points) {
    const Complex plant = plant_at(point.frequency_hz);
    const Complex loop = static_cast<long double>(proportional) * plant;
    const Complex expected[] = {plant, 1.0L / (1.0L + loop), -loop / (1.0L + loop), -loop};
    const Complex exact = expected[point.pair];
    EXPECT_LT(std::abs(Complex{point.response} - exact) / std::abs(exact), 1e-9L)
        << "response " << point.pair << " at " << point.frequency_hz << " Hz";
  }
}

TEST(Feedback, GivesTheLoopFromErrorToOutputWithTheDitherAtTheReference) {
  const auto settings = controlled_rig(sim::Injection::reference);
  RunnerSettings runner;
  runner.responses = {over(output, error), over(output, applied), over(error, applied)};
  const auto run = test::run_virtual(plan_under_feedback(), settings, test::open_guard(4), runner);
  for (const Point& point : run.sink.points) {
    const Complex loop = static_cast<long double>(proportional) * plant_at(point.frequency_hz);
    const Complex expected[] = {loop, loop / (1.0L + loop), 1.0L / (1.0L + loop)};
    const Complex exact = expected[point.pair];
    EXPECT_LT(std::abs(Complex{point.response} - exact) / std::abs(exact), 1e-9L)
        << "response " << point.pair << " at " << point.frequency_hz << " Hz";
  }
}

TEST(Feedback, RefusesAControllerAroundDirectFeedthrough) {
  auto settings = controlled_rig(sim::Injection::reference);
  settings.system = sim::from_transfer_function({1.0, 2.0}, {1.0, 1.0});
  VirtualClock clock{TickGrid{rate_hz}};
  EXPECT_THROW(sim::SimulatedRig(settings, clock), std::invalid_argument);
}

}  // namespace
}  // namespace sinerig
