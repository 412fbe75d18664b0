// What a tick costs: the whole loop in virtual time with a fourth-order plant, beside a loop that
// only steps the plant.
#include <benchmark/benchmark.h>

#include "sim/plant.h"
#include "support/virtual_run.h"

namespace {

using namespace sinerig;

constexpr double rate_hz = 1000.0;

sim::LinearSystem fourth_order() {
  return sim::from_zeros_poles({{-1.0, 113.0}}, {{-1.4, 144.0}, -5.0, -900.0}, 4500.0);
}

class NullSink final : public RecordSink {
 public:
  void put(const Record&) noexcept override {}
  void put_sample(const TickSamples&) noexcept override {}
  bool flush() noexcept override { return true; }
};

SweepPlan one_decade() {
  SweepSettings sweep;
  sweep.start_hz = 1.0;
  sweep.stop_hz = 100.0;
  sweep.points = 20;
  sweep.amplitude = 1.0;
  sweep.settling = Settling::fixed;
  sweep.target_db = 0.0;
  sweep.target_deg = 0.0;
  sweep.integrate = {.cycles = 8.0, .seconds = 10.0};
  return plan_sweep(sweep, {}, rate_hz);
}

void plant_only(benchmark::State& state) {
  sim::Plant plant{fourth_order(), 1.0 / rate_hz};
  double output = 0.0;
  std::uint64_t tick = 0;
  for ([[maybe_unused]] auto _ : state) {
    const sim::PlantTime now{.tick = tick++, .fraction = 0.0};
    plant.apply(1.0, now);
    plant.sample(now, {&output, 1});
    benchmark::DoNotOptimize(output);
  }
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(plant_only);

void whole_loop(benchmark::State& state) {
  const SweepPlan plan = one_decade();
  sim::SimulatedRigSettings rig_settings;
  rig_settings.system = fourth_order();
  rig_settings.sensors.resize(1);
  std::uint64_t ticks = 0;
  for ([[maybe_unused]] auto _ : state) {
    VirtualClock clock{TickGrid{rate_hz}};
    sim::SimulatedRig rig{rig_settings, clock};
    Sensor* const sensors[] = {&rig.sensor(0)};
    Guard guard{test::open_guard(1), clock.grid().period_s()};
    NullSink sink;
    SweepRunner runner{plan, {}, clock, rig.actuator(), sensors, guard, sink};
    RunControl control;
    ticks += runner.run(control).ticks;
  }
  state.SetItemsProcessed(static_cast<std::int64_t>(ticks));
  state.counters["ns_per_tick"] = benchmark::Counter(
      static_cast<double>(ticks) * 1e-9, benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}
BENCHMARK(whole_loop)->Unit(benchmark::kMillisecond);

}  // namespace

BENCHMARK_MAIN();
