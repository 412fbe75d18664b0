// A sweep that excites nothing ends within two blocks, and says why.
#include <cmath>

#include <gtest/gtest.h>

#include "support/virtual_run.h"

namespace sinerig {
namespace {

constexpr double rate_hz = 1000.0;

SweepPlan ten_points(double bias_amplitude = 0.0) {
  SweepSettings sweep;
  sweep.start_hz = 2.0;
  sweep.stop_hz = 100.0;
  sweep.points = 10;
  sweep.amplitude = 0.5;
  sweep.bias_amplitude = bias_amplitude;
  sweep.bias_hz = 0.37;
  return plan_sweep(sweep, {}, rate_hz);
}

sim::SimulatedRigSettings lag() {
  sim::SimulatedRigSettings rig;
  rig.system = sim::from_transfer_function({100.0}, {1.0, 100.0});
  rig.sensors.resize(1);
  rig.sensors[0].imperfections.noise_rms = 1e-4;
  return rig;
}

RunnerSettings reading_back() {
  RunnerSettings runner;
  runner.readbacks = {0};
  return runner;
}

std::uint64_t ticks_of_two_blocks(const SweepPlan& plan) {
  return plan.dwells.front().settle_samples + 2 * plan.dwells.front().block_samples;
}

TEST(ExcitationCheck, FindsADriveThatAppliesNothing) {
  const SweepPlan plan = ten_points();
  auto rig = lag();
  rig.actuator.gain = 0.0;
  const auto run = test::run_virtual(plan, rig);
  EXPECT_EQ(run.outcome.trip.cause, TripCause::excitation_missing);
  EXPECT_EQ(run.outcome.trip.value, 0.0);
  EXPECT_LE(run.outcome.trip.tick, ticks_of_two_blocks(plan));
  EXPECT_NE(describe(run.outcome.trip, {"gyro"})
                .find("what was applied does not hold the commanded sine"),
            std::string::npos);
}

TEST(ExcitationCheck, FindsASwappedWire) {
  const SweepPlan plan = ten_points();
  auto rig = lag();
  rig.actuator.gain = -1.0;
  const auto run = test::run_virtual(plan, rig);
  EXPECT_EQ(run.outcome.trip.cause, TripCause::excitation_reversed);
  EXPECT_NEAR(std::abs(run.outcome.trip.value), 180.0, 1e-6);
  EXPECT_LE(run.outcome.trip.tick, ticks_of_two_blocks(plan));
}

TEST(ExcitationCheck, FindsAReadBackThatMovesAtAnotherFrequency) {
  const SweepPlan plan = ten_points();
  auto rig = lag();
  rig.sensors[0].imperfections.noise_rms = 2.0;  // nothing of the sine is left to see
  const auto run = test::run_virtual(plan, rig, test::open_guard(1), reading_back());
  EXPECT_EQ(run.outcome.trip.cause, TripCause::excitation_other_frequency);
  EXPECT_LT(run.outcome.trip.value, 0.5);
  EXPECT_LE(run.outcome.trip.tick, ticks_of_two_blocks(plan));
}

TEST(ExcitationCheck, FindsAReadBackThatDoesNotMove) {
  const SweepPlan plan = ten_points();
  auto rig = lag();
  rig.sensors[0].imperfections.quantum = 100.0;
  const auto run = test::run_virtual(plan, rig, test::open_guard(1), reading_back());
  EXPECT_EQ(run.outcome.trip.cause, TripCause::excitation_missing);
}

// An encoder that is late now and then is no reason not to look at what was applied.
TEST(ExcitationCheck, FindsASwappedWireBesideASensorThatMissesSamples) {
  const SweepPlan plan = ten_points();
  auto rig = lag();
  rig.actuator.gain = -1.0;
  rig.sensors[0].imperfections.lost_fraction = 0.3;
  const auto run = test::run_virtual(plan, rig);
  EXPECT_EQ(run.outcome.trip.cause, TripCause::excitation_reversed);
  EXPECT_LE(run.outcome.trip.tick, ticks_of_two_blocks(plan));
}

TEST(ExcitationCheck, JudgesAReadBackThatMissesSamples) {
  const SweepPlan plan = ten_points();
  auto rig = lag();
  rig.sensors[0].imperfections.lost_fraction = 0.3;
  auto run = test::run_virtual(plan, rig, test::open_guard(1), reading_back());
  EXPECT_FALSE(run.outcome.trip.tripped()) << describe(run.outcome.trip, {"gyro"});
  rig.system = sim::from_transfer_function({-100.0}, {1.0, 100.0});
  run = test::run_virtual(plan, rig, test::open_guard(1), reading_back());
  EXPECT_EQ(run.outcome.trip.cause, TripCause::excitation_reversed);
  EXPECT_LE(run.outcome.trip.tick, ticks_of_two_blocks(plan));
}

// Dwells of one block, as they are by default, and those that a model ends in less.
TEST(ExcitationCheck, FindsAReversedReadBackHoweverShortTheDwells) {
  for (const Settling settling : {Settling::fixed, Settling::detect, Settling::model}) {
    SweepSettings sweep;
    sweep.start_hz = 1.0;
    sweep.stop_hz = 5.0;
    sweep.points = 5;
    sweep.amplitude = 0.5;
    sweep.settling = settling;
    auto rig = lag();
    rig.system = sim::from_transfer_function({-100.0}, {1.0, 100.0});
    const auto run =
        test::run_virtual(plan_sweep(sweep, {}, rate_hz), rig, test::open_guard(1), reading_back());
    EXPECT_EQ(run.outcome.trip.cause, TripCause::excitation_reversed) << static_cast<int>(settling);
    EXPECT_EQ(run.outcome.dwells_done, 0U) << static_cast<int>(settling);
    ASSERT_EQ(run.sink.points.size(), 1U) << static_cast<int>(settling);
    EXPECT_EQ(run.sink.points[0].status, PointStatus::stopped) << static_cast<int>(settling);
  }
}

// Its stamps say how late it is, and what is behind a drive may turn by more once it has followed.
TEST(ExcitationCheck, IsContentWithAReadBackThatComesLate) {
  auto rig = lag();
  rig.sensors[0].imperfections.delay_s = 0.004;
  auto run = test::run_virtual(ten_points(), rig, test::open_guard(1), reading_back());
  EXPECT_FALSE(run.outcome.trip.tripped()) << describe(run.outcome.trip, {"gyro"});
  rig = lag();
  rig.system = sim::from_transfer_function({1e6}, {1.0, 200.0, 2e4, 1e6});
  run = test::run_virtual(ten_points(), rig, test::open_guard(1), reading_back());
  EXPECT_FALSE(run.outcome.trip.tripped()) << describe(run.outcome.trip, {"gyro"});
}

TEST(ExcitationCheck, IsContentWithAReadBackThatFollows) {
  const auto run = test::run_virtual(ten_points(), lag(), test::open_guard(1), reading_back());
  EXPECT_FALSE(run.outcome.trip.tripped()) << describe(run.outcome.trip, {"gyro"});
}

// A bias far larger than the tone leaks into the sums of its blocks, here with the sign turned.
TEST(ExcitationCheck, IsContentWithABiasMotionThatDwarfsTheTone) {
  for (const double bias_hz : {0.07, 0.11, 0.15, 0.3, 0.37}) {
    SweepSettings sweep;
    sweep.start_hz = 2.0;
    sweep.stop_hz = 20.0;
    sweep.points = 3;
    sweep.amplitude = 0.02;
    sweep.bias_amplitude = 0.3;
    sweep.bias_hz = bias_hz;
    const auto run = test::run_virtual(plan_sweep(sweep, {}, rate_hz), lag(), test::open_guard(1),
                                       reading_back());
    EXPECT_FALSE(run.outcome.trip.tripped())
        << bias_hz << " Hz: " << describe(run.outcome.trip, {"gyro"});
  }
}

TEST(ExcitationCheck, IsContentWithAClampedCoarseActuator) {
  auto rig = lag();
  rig.actuator.max = 0.3;
  rig.actuator.min = -0.3;
  rig.actuator.quantum = 0.25;
  const auto run = test::run_virtual(ten_points(), rig);
  EXPECT_FALSE(run.outcome.trip.tripped()) << describe(run.outcome.trip, {"gyro"});
}

}  // namespace
}  // namespace sinerig
