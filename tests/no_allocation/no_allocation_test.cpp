// The loop takes no memory between its first tick and the release of the actuator. That the count
// works is tested too: allocations planted in a sensor are found.
#include <array>
#include <cstdlib>
#include <memory>
#include <optional>

#include <gtest/gtest.h>

#include "no_allocation/counting_allocator.h"
#include "sim/simulated_rig.h"
#include "sweep/outbox.h"
#include "sweep/runner.h"

namespace sinerig {
namespace {

// Keeps the compiler from leaving a planted allocation out.
void* volatile planted;

// Watches from the first wait on; loses a tick now and then where it is told to.
class WatchingClock final : public Clock {
 public:
  WatchingClock(double rate_hz, bool gaps) : Clock{TickGrid{rate_hz}}, gaps_{gaps} {}

  Tick wait() noexcept override {
    if (next_ == 0) test::watch_allocations();
    if (gaps_ && next_ % 997 == 0) next_ += 2;
    return {.index = next_++, .lateness = {}};
  }
  Instant now() const noexcept override {
    return {.tick = next_ == 0 ? 0 : next_ - 1, .offset_ns = 0};
  }
  std::int64_t time_ns(Instant instant) const noexcept override {
    return grid().time_ns(instant.tick) + instant.offset_ns;
  }

 private:
  bool gaps_;
  std::uint64_t next_ = 0;
};

// Stops watching where the loop gives the actuator back.
class WatchedActuator final : public Actuator {
 public:
  explicit WatchedActuator(Actuator& inner) : inner_{inner} {}
  Sample write(double command) noexcept override { return inner_.write(command); }
  void release() noexcept override {
    if (!allocations) allocations = test::stop_watching();
    inner_.release();
  }
  std::optional<std::uint64_t> allocations;

 private:
  Actuator& inner_;
};

class PlantingSensor final : public Sensor {
 public:
  PlantingSensor(Sensor& inner, void (*plant)()) : inner_{inner}, plant_{plant} {}
  Sample read() noexcept override {
    if (++reads_ == 500 && plant_ != nullptr) plant_();
    return inner_.read();
  }

 private:
  Sensor& inner_;
  void (*plant_)();
  int reads_ = 0;
};

struct LoopCase {
  const char* name;
  void (*arrange)(sim::SimulatedRigSettings&, GuardSettings&);
  bool gaps = false;
  std::optional<SettledBy> modelled = std::nullopt;  // and how some dwells end
  double check_fraction = 0.0;
  void (*plant)() = nullptr;
};

// Nearly those of the rig: modelled dwells, doubted ones and their fall-back all happen.
KnownModes told_modes() {
  KnownModes known{.prior = {}, .noise_variance = {1e-12, 1e-10}, .noise_dof = 100.0};
  known.prior.modes = 2;
  known.prior.poles[0] = {.sigma_rad_s = -2.5, .omega_rad_s = 12.0};
  known.prior.poles[1] = {.sigma_rad_s = -1.45, .omega_rad_s = 144.5};
  for (std::size_t i = 0; i < 4; ++i) known.prior.covariance[triangle(i) + i] = 0.5;
  return known;
}

using PointsBy = std::array<int, static_cast<std::size_t>(SettledBy::both) + 1>;

// How the points were settled.
class CountingSink final : public RecordSink {
 public:
  explicit CountingSink(RecordSink& inner) : inner_{inner} {}
  void put(const Record& record) noexcept override {
    const auto* point = std::get_if<Point>(&record);
    if (point != nullptr) ++points_[static_cast<std::size_t>(point->settled_by)];
    inner_.put(record);
  }
  void put_sample(const TickSamples& samples) noexcept override { inner_.put_sample(samples); }
  bool flush() noexcept override { return inner_.flush(); }
  const PointsBy& points() const { return points_; }

 private:
  RecordSink& inner_;
  PointsBy points_{};
};

struct LoopRun {
  std::uint64_t allocations = 0;
  PointsBy points{};
  int by(SettledBy settled) const { return points[static_cast<std::size_t>(settled)]; }
};

LoopRun run_of(const LoopCase& loop) {
  SweepSettings sweep;
  sweep.start_hz = 2.0;
  sweep.stop_hz = 400.0;
  sweep.points = 12;
  sweep.amplitude = 0.5;
  sweep.ramp_s = 0.05;
  sweep.settle_max = {.cycles = 4.0, .seconds = 1.0};
  sweep.integrate_max = {.cycles = 4.0, .seconds = 1.0};
  if (loop.modelled) {
    sweep.settling = Settling::model;
    sweep.check_fraction = loop.check_fraction;
    sweep.settle_max = {.cycles = 4.0, .seconds = 10.0};
  }
  const SweepPlan plan = plan_sweep(sweep, {}, 1000.0);

  sim::SimulatedRigSettings rig_settings;
  sim::MechanicalAxis axis;
  axis.inertia = 0.02;
  axis.damping = 0.1;
  axis.stiffness = 3.0;
  axis.modes = {{.frequency_hz = 23.0, .damping = 0.01, .residue = 30.0}};
  axis.lag_hz = 150.0;
  rig_settings.system = sim::from_mechanical_axis(axis);
  rig_settings.system.dead_time_s = 0.0015;
  rig_settings.sensors = {{.output = 0, .imperfections = {}}, {.output = 1, .imperfections = {}}};
  GuardSettings guard_settings;
  guard_settings.channels.resize(2);
  loop.arrange(rig_settings, guard_settings);

  WatchingClock clock{plan.rate_hz, loop.gaps};
  sim::SimulatedRig rig{rig_settings, clock};
  WatchedActuator actuator{rig.actuator()};
  PlantingSensor first{rig.sensor(0), loop.plant};
  Sensor* const sensors[] = {&first, &rig.sensor(1)};
  Guard guard{guard_settings, clock.grid().period_s()};
  Outbox outbox{1 << 12, 1 << 12, Outbox::WhenFull::keep};  // never emptied: it runs full as well
  CountingSink sink{outbox};
  RunnerSettings settings{.responses = {}, .readbacks = {}, .record_samples = true};
  if (loop.modelled) settings.modes = told_modes();
  SweepRunner runner{plan, settings, clock, actuator, sensors, guard, sink};
  RunControl control;
  runner.run(control);
  return {.allocations = actuator.allocations.value(), .points = sink.points()};
}

class TheLoop : public testing::TestWithParam<LoopCase> {};

TEST_P(TheLoop, AllocatesNothing) {
  const LoopRun run = run_of(GetParam());
  EXPECT_EQ(run.allocations, 0U);
  if (!GetParam().modelled) return;
  EXPECT_GT(run.by(*GetParam().modelled), 0);
}

INSTANTIATE_TEST_SUITE_P(
    Rigs, TheLoop,
    testing::Values(
        LoopCase{.name = "Clean",
                 .arrange =
                     [](auto&, auto&) {
                     }},
        LoopCase{.name = "WithEveryImperfection",
                 .arrange =
                     [](auto& rig, auto&) {
                       rig.friction = {.coulomb = 0.01, .breakaway = 0.02};
                       rig.actuator = {.min = -0.4,
                                       .max = 0.4,
                                       .quantum = 1e-3,
                                       .slew_per_s = 300.0,
                                       .dropout_fraction = 0.0005};
                       rig.sensors[0].imperfections = {.delay_s = 0.0023,
                                                       .jitter_s = 0.0004,
                                                       .noise_rms = 1e-4,
                                                       .pink_noise_rms = 1e-4,
                                                       .bias = 0.1,
                                                       .drift_per_s = 1e-3,
                                                       .backlash = 1e-4,
                                                       .quantum = 1e-5,
                                                       .min = -2.0,
                                                       .max = 2.0,
                                                       .lost_fraction = 0.001,
                                                       .late_fraction = 0.001,
                                                       .stuck_at_s = 20.0};
                     }},
        LoopCase{.name = "WithGaps", .arrange = [](auto&, auto&) {}, .gaps = true},
        LoopCase{.name = "WithModelledTransients",
                 .arrange = [](auto&, auto&) {},
                 .modelled = SettledBy::model},
        LoopCase{.name = "WithModelledTransientsThatAreChecked",
                 .arrange = [](auto&, auto&) {},
                 .modelled = SettledBy::both,
                 .check_fraction = 1.0},
        LoopCase{.name = "WithModesThatExplainNothing",
                 .arrange = [](auto& rig, auto&) { rig.sensors[0].imperfections.noise_rms = 1e-3; },
                 .modelled = SettledBy::fallback},
        LoopCase{.name = "StoppedByALimit",
                 .arrange =
                     [](auto&, auto& guard) {
                       guard.channels[1].max = 0.5;
                       guard.stop_ramp_ticks = 20;
                     }}),
    [](const auto& instance) { return std::string{instance.param.name}; });

class ThePlantedAllocation : public testing::TestWithParam<LoopCase> {};

TEST_P(ThePlantedAllocation, IsFound) {
  EXPECT_EQ(run_of(GetParam()).allocations, 1U);
}

INSTANTIATE_TEST_SUITE_P(Calls, ThePlantedAllocation,
                         testing::Values(LoopCase{.name = "New",
                                                  .arrange = [](auto&, auto&) {},
                                                  .plant =
                                                      [] {
                                                        planted = ::operator new(64);
                                                        ::operator delete(planted);
                                                      }},
                                         LoopCase{.name = "Malloc",
                                                  .arrange = [](auto&, auto&) {},
                                                  .plant =
                                                      [] {
                                                        planted = std::malloc(64);
                                                        std::free(planted);
                                                      }},
                                         LoopCase{.name = "Calloc",
                                                  .arrange = [](auto&, auto&) {},
                                                  .plant =
                                                      [] {
                                                        planted = std::calloc(8, 8);
                                                        std::free(planted);
                                                      }},
                                         LoopCase{.name = "Realloc",
                                                  .arrange = [](auto&, auto&) {},
                                                  .plant =
                                                      [] {
                                                        planted = std::realloc(nullptr, 64);
                                                        std::free(planted);
                                                      }},
                                         LoopCase{.name = "AlignedAlloc",
                                                  .arrange = [](auto&, auto&) {},
                                                  .plant =
                                                      [] {
                                                        planted = std::aligned_alloc(64, 64);
                                                        std::free(planted);
                                                      }}),
                         [](const auto& instance) { return std::string{instance.param.name}; });

}  // namespace
}  // namespace sinerig
