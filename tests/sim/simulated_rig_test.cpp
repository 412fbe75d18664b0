// The simulated actuator and sensors, one imperfection at a time, and runs that repeat to the bit.
#include "sim/simulated_rig.h"

#include <cmath>
#include <cstring>
#include <numbers>

#include <gtest/gtest.h>

#include "support/virtual_run.h"
#include "support/zero_order_hold.h"

namespace sinerig::sim {
namespace {

constexpr double rate_hz = 1000.0;

// Driven by one from the start, the plant's output is the time in seconds.
SimulatedRigSettings clockwork(SensorImperfections imperfections) {
  SimulatedRigSettings settings;
  settings.system = from_transfer_function({1.0}, {1.0, 0.0});
  settings.sensors = {{.output = 0, .imperfections = imperfections}};
  return settings;
}

SimulatedRigSettings gain_of_one(SensorImperfections imperfections) {
  SimulatedRigSettings settings;
  settings.system = from_transfer_function({1.0}, {1.0});
  settings.sensors = {{.output = 0, .imperfections = imperfections}};
  return settings;
}

// What the sensor reads in `ticks` ticks under a constant command of one.
std::vector<Sample> readings(const SimulatedRigSettings& settings, int ticks) {
  VirtualClock clock{TickGrid{rate_hz}};
  SimulatedRig rig{settings, clock};
  std::vector<Sample> samples;
  for (int tick = 0; tick < ticks; ++tick) {
    clock.wait();
    rig.actuator().write(1.0);
    samples.push_back(rig.sensor(0).read());
  }
  return samples;
}

std::vector<Sample> writes(const ActuatorImperfections& imperfections,
                           const std::vector<double>& commands) {
  VirtualClock clock{TickGrid{rate_hz}};
  SimulatedRigSettings settings = gain_of_one({});
  settings.actuator = imperfections;
  SimulatedRig rig{settings, clock};
  std::vector<Sample> applied;
  for (const double command : commands) {
    clock.wait();
    applied.push_back(rig.actuator().write(command));
    EXPECT_EQ(rig.sensor(0).read().value, applied.back().value);
  }
  return applied;
}

double seconds(const Sample& sample) {
  return static_cast<double>(sample.time_ns) * 1e-9;
}

TEST(SimulatedSensor, ReadsThePresentAfterTheCommand) {
  for (const Sample& sample : readings(gain_of_one({}), 5)) {
    EXPECT_EQ(sample.value, 1.0);
    EXPECT_EQ(sample.fault, Fault::none);
  }
}

class SensorDelay : public testing::TestWithParam<double> {};

TEST_P(SensorDelay, AgesTheReadingAndItsTimeAlike) {
  const auto samples = readings(clockwork({.delay_s = GetParam()}), 50);
  for (std::size_t tick = 10; tick < samples.size(); ++tick) {
    ASSERT_NEAR(samples[tick].value, static_cast<double>(tick) * 1e-3 - GetParam(), 1e-12);
    ASSERT_NEAR(seconds(samples[tick]), samples[tick].value, 1e-9);
  }
}

INSTANTIATE_TEST_SUITE_P(Ages, SensorDelay, testing::Values(0.0, 0.37e-3, 1e-3, 2.5e-3, 7.001e-3));

TEST(SensorJitter, ScattersTheInstantOverItsWidthAndTellsTheTrueTime) {
  const auto samples = readings(clockwork({.delay_s = 0.1e-3, .jitter_s = 0.6e-3}), 4000);
  double earliest = 0.0;
  double latest = 1.0;
  for (std::size_t tick = 10; tick < samples.size(); ++tick) {
    ASSERT_NEAR(seconds(samples[tick]), samples[tick].value, 1e-9);
    const double age_s = static_cast<double>(tick) * 1e-3 - samples[tick].value;
    earliest = std::max(earliest, age_s);
    latest = std::min(latest, age_s);
  }
  EXPECT_NEAR(earliest, 0.7e-3, 5e-6);
  EXPECT_NEAR(latest, 0.1e-3, 5e-6);
}

// What the sensor under test, the last of the rig, reads, with every other sensor read before it.
std::vector<Sample> last_readings(const SimulatedRigSettings& settings, int ticks,
                                  int reads_per_tick = 1) {
  VirtualClock clock{TickGrid{rate_hz}};
  SimulatedRig rig{settings, clock};
  std::vector<Sample> samples;
  for (int tick = 0; tick < ticks; ++tick) {
    clock.wait();
    rig.actuator().write(1.0);
    for (int read = 0; read < reads_per_tick; ++read) {
      for (std::size_t i = 0; i + 1 < settings.sensors.size(); ++i) rig.sensor(i).read();
      samples.push_back(rig.sensor(settings.sensors.size() - 1).read());
    }
  }
  return samples;
}

// Further back than the tick before, where another sensor or the controller has been since.
TEST(SensorJitter, ReachesOverTwoTicksWhoeverElseLooksAtThePlant) {
  SimulatedRigSettings alone = clockwork({.delay_s = 0.8e-3, .jitter_s = 0.9e-3});
  SimulatedRigSettings beside_another = alone;
  beside_another.sensors.insert(beside_another.sensors.begin(), SimulatedSensor{});
  SimulatedRigSettings in_a_loop = alone;
  in_a_loop.controller = {.injection = Injection::plant_input};
  for (const auto& settings : {alone, beside_another, in_a_loop}) {
    const auto samples = last_readings(settings, 4000);
    double oldest_s = 0.0;
    double youngest_s = 1.0;
    for (std::size_t tick = 10; tick < samples.size(); ++tick) {
      ASSERT_NEAR(seconds(samples[tick]), samples[tick].value, 1e-9);
      const double age_s = static_cast<double>(tick) * 1e-3 - samples[tick].value;
      oldest_s = std::max(oldest_s, age_s);
      youngest_s = std::min(youngest_s, age_s);
    }
    EXPECT_NEAR(oldest_s, 1.7e-3, 5e-6);
    EXPECT_NEAR(youngest_s, 0.8e-3, 5e-6);
  }
}

TEST(SensorJitter, TellsTheTrueTimeOfASecondReadingToo) {
  SimulatedRigSettings settings = clockwork({.delay_s = 0.3e-3, .jitter_s = 0.6e-3});
  settings.sensors.insert(settings.sensors.begin(), SimulatedSensor{});
  const auto samples = last_readings(settings, 200, 3);
  for (std::size_t i = 30; i < samples.size(); ++i) {
    ASSERT_NEAR(seconds(samples[i]), samples[i].value, 1e-9);
  }
}

// Steady state of a lag under a sine: every sub-tick sample lies on the closed form.
TEST(SensorDelay, SamplesTheHeldResponseBetweenTheTicks) {
  const test::PartialFractions lag{.poles = {-400.0L}, .residues = {400.0L}};
  constexpr long double omega = 2.0L * std::numbers::pi_v<long double> * 40.0L;
  for (const double age_s : {0.0, 0.123e-3, 0.5e-3, 0.999e-3, 3.3e-3}) {
    SimulatedRigSettings settings = clockwork({.delay_s = age_s});
    settings.system = from_transfer_function({400.0}, {1.0, 400.0});
    VirtualClock clock{TickGrid{rate_hz}};
    SimulatedRig rig{settings, clock};
    const test::Complex response = test::held_response(lag, omega, 1e-3L, age_s);
    for (int tick = 0; tick < 400; ++tick) {
      clock.wait();
      const long double angle = omega * static_cast<long double>(tick) * 1e-3L;
      rig.actuator().write(static_cast<double>(std::sin(angle)));
      const Sample sample = rig.sensor(0).read();
      if (tick < 150) continue;
      const auto exact = static_cast<double>((response * std::polar(1.0L, angle)).imag());
      ASSERT_NEAR(sample.value, exact, 1e-12) << "age " << age_s << ", tick " << tick;
    }
  }
}

// A lag, and its rate with the direct feedthrough that it has, under proportional control.
struct Loop {
  static constexpr long double corner = 100.0L;
  static constexpr long double proportional = 0.5L;
  static constexpr long double period_s = 1e-3L;

  SimulatedRigSettings settings(const SimulatedSensor& sensor) const {
    SimulatedRigSettings rig;
    const auto pole = static_cast<double>(corner);
    rig.system =
        from_state_space(Eigen::MatrixXd::Constant(1, 1, -pole), Eigen::VectorXd::Constant(1, pole),
                         Eigen::Vector2d{1.0, -pole}, Eigen::Vector2d{0.0, pole}, {"y", "rate"});
    rig.controller = {.proportional = static_cast<double>(proportional)};
    rig.sensors = {sensor};
    return rig;
  }

  // Over the reference, by whole ticks of the sensor's delay and the rest.
  test::Complex response(const SimulatedSensor& sensor, long double omega) const {
    const long double ticks = static_cast<long double>(sensor.imperfections.delay_s) / period_s;
    const long double whole = std::floor(ticks + 1e-9L);
    const long double rest_s = ticks - whole < 1e-9L ? 0.0L : (ticks - whole) * period_s;
    const test::Complex tick_before = std::polar(1.0L, -omega * period_s);
    return at_rest_age(sensor, omega, rest_s) * std::pow(tick_before, whole);
  }

  test::Complex at_rest_age(const SimulatedSensor& sensor, long double omega,
                            long double age_s) const {
    const test::PartialFractions lag{.poles = {-corner}, .residues = {corner}};
    const test::PartialFractions rate{
        .poles = {-corner}, .residues = {-corner * corner}, .direct = corner};
    const test::Complex y = test::held_response(lag, omega, period_s);
    const test::Complex error = 1.0L / (1.0L + proportional * y);
    const test::Complex input = proportional * error;
    if (sensor.signal == Signal::plant_output) {
      return input * test::held_response(sensor.output == 0 ? lag : rate, omega, period_s, age_s);
    }
    // Held from the tick before.
    const long double held_s = age_s > 0.0L ? period_s : 0.0L;
    return (sensor.signal == Signal::error ? error : input) * std::polar(1.0L, -omega * held_s);
  }
};

class SensorInALoop : public testing::TestWithParam<SimulatedSensor> {};

TEST_P(SensorInALoop, SamplesTheClosedFormAtAnyAge) {
  constexpr Loop loop;
  constexpr long double omega = 2.0L * std::numbers::pi_v<long double> * 300.0L;
  for (const double age_s : {0.0, 0.123e-3, 0.3e-3, 0.999e-3, 1e-3, 2e-3, 3.3e-3}) {
    SimulatedSensor sensor = GetParam();
    sensor.imperfections.delay_s = age_s;
    const test::Complex response = loop.response(sensor, omega);
    VirtualClock clock{TickGrid{rate_hz}};
    SimulatedRig rig{loop.settings(sensor), clock};
    for (int tick = 0; tick < 600; ++tick) {
      clock.wait();
      const long double angle = omega * static_cast<long double>(tick) * 1e-3L;
      rig.actuator().write(static_cast<double>(std::sin(angle)));
      const Sample sample = rig.sensor(0).read();
      if (tick < 400) continue;
      const auto exact = static_cast<double>((response * std::polar(1.0L, angle)).imag());
      ASSERT_NEAR(sample.value, exact, 1e-10) << "age " << age_s << ", tick " << tick;
    }
  }
}

std::string name_of(const testing::TestParamInfo<SimulatedSensor>& sensor) {
  constexpr const char* names[] = {"PlantOutput", "Error", "Control", "PlantInput"};
  return names[static_cast<int>(sensor.param.signal)] + std::to_string(sensor.param.output);
}

INSTANTIATE_TEST_SUITE_P(
    Of, SensorInALoop,
    testing::Values(SimulatedSensor{.output = 0, .imperfections = {}},
                    SimulatedSensor{.output = 1, .imperfections = {}},
                    SimulatedSensor{.signal = Signal::error, .imperfections = {}},
                    SimulatedSensor{.signal = Signal::control, .imperfections = {}},
                    SimulatedSensor{.signal = Signal::plant_input, .imperfections = {}}),
    name_of);

// As `sinerig check` does: no command, and more than one reading.
TEST(ALoopSignal, IsReadWithoutACommandToo) {
  SimulatedRigSettings settings =
      Loop{}.settings({.signal = Signal::plant_input, .imperfections = {}});
  settings.neutral = 0.25;
  VirtualClock clock{TickGrid{rate_hz}};
  SimulatedRig rig{settings, clock};
  for (int tick = 0; tick < 3; ++tick) {
    clock.wait();
    EXPECT_EQ(rig.sensor(0).read().value, 0.25);
  }
  rig.actuator().write(2.0);
  const double input = rig.sensor(0).read().value;
  EXPECT_NE(input, 0.25);
  clock.wait();
  EXPECT_EQ(rig.sensor(0).read().value, input);
}

TEST(SimulatedSensor, AddsBiasAndDrift) {
  const auto samples = readings(gain_of_one({.bias = 0.5, .drift_per_s = 2.0}), 1001);
  EXPECT_DOUBLE_EQ(samples.front().value, 1.5);
  EXPECT_NEAR(samples.back().value, 1.5 + 2.0, 1e-12);
}

TEST(SimulatedSensor, AddsWhiteNoiseOfTheRmsThatWasAskedFor) {
  const auto samples = readings(gain_of_one({.noise_rms = 0.2}), 20'000);
  double power = 0.0;
  for (const Sample& sample : samples) power += (sample.value - 1.0) * (sample.value - 1.0);
  EXPECT_NEAR(std::sqrt(power / static_cast<double>(samples.size())), 0.2, 0.2 * 0.03);
}

TEST(SimulatedSensor, QuantisesWhatItReads) {
  for (const Sample& sample : readings(gain_of_one({.noise_rms = 0.2, .quantum = 0.25}), 500)) {
    EXPECT_EQ(sample.value, 0.25 * std::round(sample.value / 0.25));
  }
}

TEST(SimulatedSensor, ClipsAndSaysSo) {
  const auto samples = readings(clockwork({.min = 0.01, .max = 0.03}), 60);
  EXPECT_EQ(samples[5].value, 0.01);
  EXPECT_EQ(samples[5].fault, Fault::range);
  EXPECT_EQ(samples[20].fault, Fault::none);
  EXPECT_EQ(samples[50].value, 0.03);
  EXPECT_EQ(samples[50].fault, Fault::range);
}

TEST(LostSamples, AreStaleWithTheLastValueInTheFractionThatWasAskedFor) {
  const auto samples = readings(clockwork({.lost_fraction = 0.2}), 10'000);
  int lost = 0;
  for (std::size_t tick = 1; tick < samples.size(); ++tick) {
    if (samples[tick].fault == Fault::none) {
      ASSERT_NEAR(seconds(samples[tick]), static_cast<double>(tick) * 1e-3, 1e-12);
      continue;
    }
    ++lost;
    ASSERT_EQ(samples[tick].fault, Fault::stale);
    ASSERT_EQ(samples[tick].value, samples[tick - 1].value);
    ASSERT_EQ(samples[tick].time_ns, samples[tick - 1].time_ns);
  }
  EXPECT_NEAR(lost, 2000, 150);
}

TEST(LateSamples, AreTheReadingBeforeWithItsOwnTime) {
  const auto samples = readings(clockwork({.late_fraction = 0.2}), 10'000);
  int late = 0;
  for (std::size_t tick = 2; tick < samples.size(); ++tick) {
    ASSERT_NEAR(seconds(samples[tick]), samples[tick].value, 1e-9);
    const double age_s = static_cast<double>(tick) * 1e-3 - seconds(samples[tick]);
    if (age_s > 0.5e-3) {
      ++late;
      ASSERT_NEAR(age_s, 1e-3, 1e-9);
    }
  }
  EXPECT_NEAR(late, 2000, 150);
}

TEST(AStuckSensor, FreezesWithoutAWord) {
  const auto samples = readings(clockwork({.stuck_at_s = 0.02}), 100);
  EXPECT_NEAR(samples[19].value, 0.019, 1e-12);
  for (std::size_t tick = 20; tick < samples.size(); ++tick) {
    EXPECT_EQ(samples[tick].value, samples[19].value);
    EXPECT_EQ(samples[tick].fault, Fault::none);
  }
}

TEST(SimulatedActuator, AppliesWhatItIsGivenWithoutImperfections) {
  for (const Sample& sample : writes({}, {0.1, -3.0, 7.7})) EXPECT_EQ(sample.fault, Fault::none);
  EXPECT_EQ(writes({}, {0.1, -3.0, 7.7}).back().value, 7.7);
}

TEST(SimulatedActuator, ClampsAndQuantisesAndReportsWhatItApplied) {
  const auto applied = writes({.min = -1.0, .max = 0.55, .quantum = 0.1}, {0.34, 0.9, -7.0});
  EXPECT_DOUBLE_EQ(applied[0].value, 0.3);
  EXPECT_EQ(applied[1].value, 0.55);
  EXPECT_EQ(applied[2].value, -1.0);
}

TEST(SimulatedActuator, MovesNoFasterThanItsSlewLimit) {
  const auto applied = writes({.slew_per_s = 100.0}, {1.0, 1.0, 1.0, -1.0, 0.1});
  EXPECT_DOUBLE_EQ(applied[0].value, 0.1);
  EXPECT_DOUBLE_EQ(applied[1].value, 0.2);
  EXPECT_DOUBLE_EQ(applied[2].value, 0.3);
  EXPECT_DOUBLE_EQ(applied[3].value, 0.2);
  EXPECT_DOUBLE_EQ(applied[4].value, 0.1);
}

TEST(SimulatedActuator, StillMovesWhenItsSlewIsLessThanAStepPerTick) {
  const auto applied = writes({.quantum = 0.1, .slew_per_s = 10.0}, std::vector<double>(60, 0.5));
  EXPECT_NEAR(applied[9].value, 0.1, 1e-12);
  EXPECT_NEAR(applied.back().value, 0.5, 1e-12);
}

TEST(ADroppedCommand, IsHeldAndReported) {
  std::vector<double> commands(5000);
  for (std::size_t i = 0; i < commands.size(); ++i) commands[i] = static_cast<double>(i);
  const auto applied = writes({.dropout_fraction = 0.1}, commands);
  int lost = 0;
  for (std::size_t i = 1; i < applied.size(); ++i) {
    if (applied[i].fault == Fault::none) {
      ASSERT_EQ(applied[i].value, commands[i]);
      continue;
    }
    ++lost;
    ASSERT_EQ(applied[i].fault, Fault::bus);
    ASSERT_EQ(applied[i].value, applied[i - 1].value);
  }
  EXPECT_NEAR(lost, 500, 80);
}

TEST(SimulatedActuator, IsNeutralAfterItsRelease) {
  VirtualClock clock{TickGrid{rate_hz}};
  SimulatedRigSettings settings = gain_of_one({});
  settings.neutral = 0.25;
  SimulatedRig rig{settings, clock};
  clock.wait();
  rig.actuator().write(0.9);
  rig.actuator().release();
  rig.actuator().release();
  EXPECT_EQ(rig.sensor(0).read().value, 0.25);
}

// A rig on the real clock that never ran: releasing it must not simulate the time since boot.
TEST(SimulatedActuator, CanBeReleasedBeforeTheFirstTickOfTheRealClock) {
  MonotonicClock clock{TickGrid{rate_hz}};
  SimulatedRigSettings settings = gain_of_one({});
  settings.system = from_mechanical_axis({.inertia = 1.0, .damping = 1.0, .modes = {}});
  settings.friction = {.coulomb = 0.1};
  SimulatedRig rig{settings, clock};
  rig.actuator().release();
  EXPECT_EQ(rig.sensor(0).read().value, 0.0);
}

SimulatedRigSettings noisy(std::uint64_t seed) {
  SimulatedRigSettings settings;
  settings.system = from_mechanical_axis(
      {.inertia = 0.02, .damping = 0.2, .stiffness = 10.0, .modes = {}, .lag_hz = 80.0});
  settings.friction = {.coulomb = 0.01, .breakaway = 0.02};
  settings.actuator = {.quantum = 1e-3, .dropout_fraction = 0.0002};
  settings.sensors = {{.output = 0,
                       .imperfections = {.delay_s = 0.7e-3,
                                         .jitter_s = 0.2e-3,
                                         .noise_rms = 1e-4,
                                         .pink_noise_rms = 1e-4,
                                         .backlash = 1e-5,
                                         .quantum = 1e-6,
                                         .lost_fraction = 1e-4,
                                         .late_fraction = 1e-3}},
                      {.output = 1, .imperfections = {.noise_rms = 1e-3}}};
  settings.seed = seed;
  return settings;
}

test::VirtualRun noisy_run(std::uint64_t seed) {
  SweepSettings sweep;
  sweep.start_hz = 10.0;
  sweep.stop_hz = 100.0;
  sweep.points = 3;
  sweep.amplitude = 0.3;
  sweep.ramp_s = 0.1;
  sweep.settle_max = {.cycles = 4.0, .seconds = 0.3};
  sweep.integrate_max = {.cycles = 4.0, .seconds = 0.3};
  return test::run_virtual(plan_sweep(sweep, {}, rate_hz), noisy(seed), test::open_guard(2),
                           {.responses = {}, .readbacks = {}, .record_samples = true});
}

// Equal to the bit, NaN included.
bool same_bits(double a, double b) {
  return std::memcmp(&a, &b, sizeof a) == 0;
}

TEST(AVirtualRun, RepeatsToTheBitInEveryRecord) {
  const auto first = noisy_run(42).sink;
  const auto second = noisy_run(42).sink;

  ASSERT_EQ(first.samples.size(), second.samples.size());
  ASSERT_GT(first.samples.size(), 1000U);
  for (std::size_t i = 0; i < first.samples.size(); ++i) {
    ASSERT_EQ(first.samples[i].tick, second.samples[i].tick);
    for (std::size_t channel = 0; channel < first.samples[i].channels; ++channel) {
      ASSERT_TRUE(same_bits(first.samples[i].values[channel], second.samples[i].values[channel]));
    }
  }
  ASSERT_EQ(first.points.size(), second.points.size());
  for (std::size_t i = 0; i < first.points.size(); ++i) {
    const Point& a = first.points[i];
    const Point& b = second.points[i];
    EXPECT_EQ(a.status, b.status);
    EXPECT_EQ(a.samples, b.samples);
    EXPECT_TRUE(same_bits(a.response.real(), b.response.real()));
    EXPECT_TRUE(same_bits(a.response.imag(), b.response.imag()));
    EXPECT_TRUE(same_bits(a.covariance.re_re, b.covariance.re_re));
    EXPECT_TRUE(same_bits(a.covariance.re_im, b.covariance.re_im));
    EXPECT_TRUE(same_bits(a.covariance.im_im, b.covariance.im_im));
  }
  ASSERT_EQ(first.blocks.size(), second.blocks.size());
  for (std::size_t i = 0; i < first.blocks.size(); ++i) {
    EXPECT_EQ(first.blocks[i].first_tick, second.blocks[i].first_tick);
    EXPECT_TRUE(same_bits(first.blocks[i].coefficients.a, second.blocks[i].coefficients.a));
    EXPECT_TRUE(same_bits(first.blocks[i].coefficients.b, second.blocks[i].coefficients.b));
    EXPECT_TRUE(same_bits(first.blocks[i].coefficients.mean, second.blocks[i].coefficients.mean));
  }
  ASSERT_EQ(first.events.size(), second.events.size());
  for (std::size_t i = 0; i < first.events.size(); ++i) {
    EXPECT_EQ(first.events[i].kind, second.events[i].kind);
    EXPECT_EQ(first.events[i].tick, second.events[i].tick);
  }
}

TEST(AVirtualRun, DiffersUnderAnotherSeed) {
  const auto first = noisy_run(42).sink;
  const auto other = noisy_run(43).sink;
  for (std::size_t i = 0; i < std::min(first.points.size(), other.points.size()); ++i) {
    EXPECT_NE(first.points[i].response, other.points[i].response);
  }
}

}  // namespace
}  // namespace sinerig::sim
