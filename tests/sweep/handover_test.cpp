// The command between one thing and the next, where no plan has foreseen it: a chirp that is
// disturbed, repeated or given up, a sweep that goes on after an interruption, a bias motion at the
// end. What is planned within its limits stays within them.
#include <algorithm>
#include <cmath>
#include <latch>
#include <numbers>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "support/virtual_run.h"
#include "sweep/probe.h"

namespace sinerig {
namespace {

constexpr double rate_hz = 1000.0;
constexpr double two_pi = 2.0 * std::numbers::pi;

sim::SimulatedRigSettings axis(double noise_rms = 1e-5) {
  sim::SimulatedRigSettings rig;
  sim::MechanicalAxis axis;
  axis.inertia = 0.02;
  axis.damping = 0.1;
  axis.stiffness = 0.02 * std::pow(two_pi * 8.0, 2);
  rig.system = sim::from_mechanical_axis(axis);
  rig.sensors = {{.output = 0, .imperfections = {.noise_rms = noise_rms}}};
  return rig;
}

KnownModes mode_at(double frequency_hz) {
  KnownModes modes;
  modes.prior.modes = 1;
  modes.prior.poles[0] = {.sigma_rad_s = -2.5, .omega_rad_s = two_pi * frequency_hz};
  for (std::size_t i = 0; i < 2; ++i) modes.prior.covariance[triangle(i) + i] = 0.01;
  modes.noise_variance = {1e-10};
  modes.noise_dof = 100.0;
  return modes;
}

// Finds what it is told, whatever the record.
class ToldFinder final : public ModeFinder {
 public:
  explicit ToldFinder(KnownModes modes) : modes_{modes} {}
  bool find(const ProbeRecord&, KnownModes& modes) noexcept override {
    modes = modes_;
    return true;
  }

 private:
  KnownModes modes_;
};

// Loses what it is given in some ticks.
class LosingActuator final : public Actuator {
 public:
  LosingActuator(Actuator& actuator, const Clock& clock, std::set<std::uint64_t> lost)
      : actuator_{actuator}, clock_{clock}, lost_{std::move(lost)} {}
  Sample write(double command) noexcept override {
    Sample sample = actuator_.write(command);
    if (lost_.contains(clock_.now().tick)) sample.fault = Fault::bus;
    return sample;
  }
  void release() noexcept override { actuator_.release(); }

 private:
  Actuator& actuator_;
  const Clock& clock_;
  std::set<std::uint64_t> lost_;
};

struct Limited {
  SweepPlan plan;
  GuardSettings guard;
};

// A sweep in the tightest limit of its slew that the plan takes.
Limited tightly(const SweepSettings& sweep, double room = 1.0) {
  Limited limited{.plan = {}, .guard = test::open_guard(1)};
  double slew_per_s = 1.0;
  for (;; slew_per_s *= 1.002) {
    try {
      limited.plan = plan_sweep(sweep, {.slew_per_s = slew_per_s}, rate_hz);
      break;
    } catch (const PlanRefused&) {
    }
  }
  slew_per_s *= room;
  limited.plan = plan_sweep(sweep, {.slew_per_s = slew_per_s}, rate_hz);
  limited.guard.slew_per_s = slew_per_s;
  limited.guard.command_max = 1.0 + 1e-9;
  limited.guard.command_min = -limited.guard.command_max;
  return limited;
}

SweepSettings modelled(std::uint32_t points = 16) {
  SweepSettings sweep;
  sweep.start_hz = 1.0;
  sweep.stop_hz = 100.0;
  sweep.points = points;
  sweep.amplitude = 1.0;
  sweep.frequency_tolerance = 5e-3;
  sweep.settling = Settling::model;
  sweep.check_fraction = 0.0;
  return sweep;
}

test::VirtualRun run(const Limited& limited, RunnerSettings settings,
                     std::set<std::uint64_t> lost = {}, std::uint32_t done = 0,
                     const sim::SimulatedRigSettings& rig_settings = axis()) {
  test::VirtualRun run;
  VirtualClock clock{TickGrid{rate_hz}};
  sim::SimulatedRig rig{rig_settings, clock};
  Sensor* const sensors[] = {&rig.sensor(0)};
  LosingActuator actuator{rig.actuator(), clock, std::move(lost)};
  Guard guard{limited.guard, clock.grid().period_s()};
  settings.record_samples = true;
  SweepRunner runner{limited.plan, settings, clock, actuator, sensors, guard, run.sink};
  if (done > 0) {
    FinishedDwells finished;
    finished.dwells = done;
    runner.go_on(finished);
  }
  RunControl control;
  run.outcome = runner.run(control);
  return run;
}

std::string trip_of(const test::VirtualRun& run) {
  return run.outcome.trip.tripped() ? describe(run.outcome.trip, {"y"}) : "";
}

double last_command(const test::VirtualRun& run) {
  return run.sink.samples.back().values[command_channel];
}

TEST(Handover, OfAChirpThatIsDisturbedAnywhereStaysInItsLimits) {
  SweepSettings sweep = modelled(60);
  sweep.follow_velocity = 2.0;
  Limited limited = tightly(sweep);
  limited.plan.dwells.resize(2);
  ToldFinder finder{mode_at(8.0)};
  RunnerSettings settings;
  settings.finder = &finder;
  for (std::uint64_t tick = 60; tick < limited.plan.probe.command.size(); tick += 20) {
    const auto disturbed = run(limited, settings, {tick});
    EXPECT_EQ(trip_of(disturbed), "") << "lost at " << tick;
    EXPECT_EQ(disturbed.sink.points.size(), 2U);
  }
}

TEST(Handover, OfAChirpThatIsGivenUpStaysInItsLimits) {
  const SweepSettings sweep = modelled();
  Limited limited = tightly(sweep);
  limited.plan.dwells.resize(1);
  ToldFinder finder{mode_at(8.0)};
  RunnerSettings settings;
  settings.finder = &finder;
  const std::vector<double>& chirp = limited.plan.probe.command;
  for (std::uint64_t tick = 140; tick < 60 + chirp.size(); tick += 20) {
    const auto given_up = run(limited, settings, {10, 60, tick});
    EXPECT_EQ(trip_of(given_up), "") << "lost at " << tick;
    EXPECT_LE(std::abs(last_command(given_up)), limited.guard.slew_per_s / rate_hz);
  }
}

TEST(Handover, OfASweepThatGoesOnStaysInItsLimits) {
  SweepSettings sweep = modelled(60);
  sweep.follow_velocity = 2.0;
  for (const double room : {1.0, 1.2, 1.4}) {
    const Limited whole = tightly(sweep, room);
    RunnerSettings settings;
    settings.modes = mode_at(8.0);
    for (std::uint32_t done = 1; done < whole.plan.dwells.size(); done += 3) {
      Limited limited = whole;
      limited.plan.dwells.resize(done + 1);
      const auto resumed = run(limited, settings, {}, done);
      EXPECT_EQ(trip_of(resumed), "") << "after " << done << ", room " << room;
      for (const Point& point : resumed.sink.points) {
        if (point.frequency_hz > 20.0) continue;  // more noise than response
        EXPECT_EQ(point.status, PointStatus::good) << point.frequency_hz;
      }
    }
  }
}

TEST(Handover, ToAChirpOnceMoreStaysInItsLimits) {
  for (const double room : {1.0, 1.3}) {
    SweepSettings sweep = modelled(40);
    sweep.start_hz = 0.5;
    sweep.follow_velocity = 2.0;
    const Limited limited = tightly(sweep, room);
    ToldFinder finder{mode_at(20.0)};  // wrong: dwells will refute it
    RunnerSettings settings;
    settings.finder = &finder;
    const auto doubted = run(limited, settings, {}, 0, axis(1e-4));
    EXPECT_EQ(trip_of(doubted), "") << "room " << room;
    EXPECT_TRUE(
        std::any_of(doubted.sink.events.begin(), doubted.sink.events.end(),
                    [](const Event& event) { return event.kind == EventKind::model_doubted; }));
  }
}

TEST(Handover, FadesTheBiasMotionOutAtTheEndWithoutARamp) {
  SweepSettings sweep = modelled(4);
  sweep.settling = Settling::fixed;
  sweep.settle = {.cycles = 1.0, .seconds = 0.0};
  sweep.integrate = {.cycles = 2.0, .seconds = 0.0};
  sweep.target_db = sweep.target_deg = 0.0;
  sweep.start_hz = 2.0;
  sweep.stop_hz = 20.0;
  sweep.amplitude = 0.02;
  sweep.bias_amplitude = 0.8;
  sweep.bias_hz = 0.31;
  const Limited limited{.plan = plan_sweep(sweep, {}, rate_hz), .guard = test::open_guard(1)};
  const auto biased = run(limited, {});
  const double step = two_pi * (0.02 * 20.0 + 0.8 * 0.31) / rate_hz;
  const auto& samples = biased.sink.samples;
  for (std::size_t i = 1; i < samples.size(); ++i) {
    ASSERT_LE(std::abs(samples[i].values[command_channel] - samples[i - 1].values[command_channel]),
              1.01 * step)
        << "at tick " << i;
  }
  EXPECT_LE(std::abs(last_command(biased)), step);
}

TEST(Handover, EndsAfterASoftLimitInTheLastDwellAsItEndsElsewhere) {
  SweepSettings sweep = modelled(3);
  sweep.settling = Settling::detect;
  sweep.start_hz = 2.0;
  sweep.stop_hz = 8.0;
  sweep.bias_amplitude = 0.3;
  sweep.bias_hz = 0.31;
  Limited limited = tightly(sweep);
  limited.guard.command_max = 1.3 + 1e-9;
  limited.guard.command_min = -limited.guard.command_max;
  limited.guard.channels[0].soft_max = 0.1;
  RunnerSettings settings;
  settings.retry = {.soft = 1, .soft_wait_s = 0.1};
  const auto limited_run = run(limited, settings);
  EXPECT_EQ(trip_of(limited_run), "");
  EXPECT_EQ(limited_run.sink.points.back().reason, PointReason::soft_limit);
}

TEST(Handover, MayTakeLongerThanThePlanOfItsDwell) {
  SweepSettings sweep = modelled();
  sweep.settling = Settling::fixed;
  sweep.settle = {};
  sweep.integrate = {.cycles = 1.0, .seconds = 0.0};
  sweep.target_db = sweep.target_deg = 0.0;
  sweep.spacing = Spacing::list;
  sweep.frequencies_hz = {20.0, 15.0, 10.0};
  const Limited limited = tightly(sweep);
  RunnerSettings settings;
  settings.preflight = {.wanted = true, .level = 0.1};
  const auto quiet_first = run(limited, settings);
  EXPECT_EQ(trip_of(quiet_first), "");
  ASSERT_EQ(quiet_first.sink.points.size(), 3U);
  EXPECT_EQ(quiet_first.sink.points[0].status, PointStatus::good);
}

TEST(Probe, IsACycleLongHoweverNarrowTheBand) {
  for (const double ratio : {1.0, 1.2, 2.0, 3.0, 4.0, 5.0, 100.0}) {
    SweepSettings sweep = modelled(ratio > 1.0 ? 5 : 1);
    sweep.start_hz = 0.1;
    sweep.stop_hz = 0.1 * ratio;
    const std::vector<double> chirp = plan_sweep(sweep, {}, rate_hz).probe.command;
    const auto [least, most] = std::minmax_element(chirp.begin(), chirp.end());
    EXPECT_GT(*most, 0.99) << ratio;
    EXPECT_LT(*least, -0.99) << ratio;
    EXPECT_EQ(chirp.back(), 0.0);
  }
}

TEST(Probe, ThatIsTooShortForHalfACycleIsRefused) {
  SweepSettings sweep = modelled(2);
  sweep.start_hz = 0.1;
  sweep.stop_hz = 0.2;
  sweep.probe_s = 1.0;
  EXPECT_THROW(plan_sweep(sweep, {}, rate_hz), PlanRefused);
  sweep.probe_s = 6.0;
  const std::vector<double> chirp = plan_sweep(sweep, {}, rate_hz).probe.command;
  EXPECT_GT(*std::max_element(chirp.begin(), chirp.end()), 0.9);
}

// Looks until it is told to come to an end.
class SlowFinder final : public ModeFinder {
 public:
  bool find(const ProbeRecord&, KnownModes& modes) noexcept override {
    end.wait();
    modes = mode_at(8.0);
    return true;
  }
  std::latch end{1};
};

TEST(Probe, ThatIsGivenUpWaitsForTheSearchAndForgetsIt) {
  const SweepPlan plan = plan_sweep(modelled(), {}, rate_hz);
  SlowFinder finder;
  Prober prober{plan.probe, {1}, rate_hz, &finder, true, Deputy::Where::own_thread};
  const std::vector<Observation> observations(2);
  for (std::size_t i = 0; i < plan.probe.command.size(); ++i) prober.add(observations, false);
  prober.skip();
  EXPECT_TRUE(prober.running());
  finder.end.count_down();
  while (prober.running()) {
    std::this_thread::yield();
    prober.add(observations, false);
  }
  EXPECT_EQ(prober.found(), nullptr);
}

// Whatever the noise of the two sensors has in common is no noise of their ratio.
TEST(MeasuredInput, NeverMissesATargetThatItsIntervalMeets) {
  SweepSettings sweep = modelled(10);
  sweep.settling = Settling::detect;
  sim::SimulatedRigSettings rig = axis();
  rig.sensors = {{.output = 0, .imperfections = {.noise_rms = 1e-4}},
                 {.output = 0, .imperfections = {.noise_rms = 1e-4}}};
  RunnerSettings settings;
  settings.responses = {{.input = 1, .output = 2, .exact_input = false}};
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    rig.seed = seed;
    const auto ratio =
        test::run_virtual(plan_sweep(sweep, {}, rate_hz), rig, test::open_guard(2), settings);
    ASSERT_EQ(ratio.sink.points.size(), 10U);
    for (const Point& point : ratio.sink.points) {
      const bool met =
          point.gain_interval_db <= sweep.target_db && point.phase_interval_deg <= sweep.target_deg;
      // The ringing that both sensors share may still be loud beside the tone.
      if (point.status == PointStatus::distorted) continue;
      EXPECT_EQ(point.status == PointStatus::good, met) << point.frequency_hz;
      if (point.frequency_hz > 50.0) continue;  // more noise than response
      EXPECT_LT(point.seconds, 30.0) << point.frequency_hz;
    }
  }
}

}  // namespace
}  // namespace sinerig
