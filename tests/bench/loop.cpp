// What a tick costs: the whole loop in virtual time with a fourth-order plant, beside a loop that
// only steps the plant.
#include <cstdio>
#include <map>
#include <string>
#include <vector>

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

// Google Benchmark 1.8 has renamed it.
template <class Run>
bool failed(const Run& run) {
  if constexpr (requires { run.error_occurred; }) {
    return run.error_occurred;
  } else {
    return static_cast<bool>(run.skipped);
  }
}

// The table as ever, and the two loops in ns per tick with their ratio.
class RatioReporter final : public benchmark::ConsoleReporter {
 public:
  void ReportRuns(const std::vector<Run>& runs) override {
    ConsoleReporter::ReportRuns(runs);
    for (const Run& run : runs) {
      const auto items = run.counters.find("items_per_second");
      if (failed(run) || items == run.counters.end()) continue;
      ns_per_tick_[run.benchmark_name()] = 1e9 / items->second.value;
    }
  }
  void Finalize() override {
    ConsoleReporter::Finalize();
    const auto plant = ns_per_tick_.find("plant_only");
    const auto loop = ns_per_tick_.find("whole_loop");
    if (plant == ns_per_tick_.end() || loop == ns_per_tick_.end()) return;
    std::printf("whole loop %.1f ns per tick, plant only %.1f ns per tick, ratio %.2f\n",
                loop->second, plant->second, loop->second / plant->second);
  }

 private:
  std::map<std::string, double> ns_per_tick_;
};

}  // namespace

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  RatioReporter reporter;
  benchmark::RunSpecifiedBenchmarks(&reporter);
  return 0;
}
