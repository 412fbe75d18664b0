// What imperfect samples do to the estimate, without noise, beside the plain sums that know
// nothing of them: lost samples repeat the one before, every sample counts as taken at its tick.
#include <cstdio>
#include <numbers>
#include <vector>

#include "quality.h"
#include "quality_plants.h"
#include "support/virtual_run.h"

namespace sinerig::quality {

namespace {

constexpr double rate_hz = 1000.0;
constexpr double most = 1e-3;

struct BiasCase {
  const char* name;
  double frequency_hz;
  double lost_fraction;
  double jitter_periods;
  double amplitudes_per_block;
};

constexpr BiasCase cases[] = {
    {"5 % lost samples", 150.0, 0.05, 0.0, 0.0},
    {"jitter of 10 % of the period", 150.0, 0.0, 0.1, 0.0},
    {"drift of 10 amplitudes a block", 15.0, 0.0, 0.0, 10.0},
};

SweepPlan plan_of(double frequency_hz) {
  SweepSettings sweep;
  sweep.spacing = Spacing::list;
  sweep.frequencies_hz = {frequency_hz};
  sweep.frequency_tolerance = 0.01;
  sweep.amplitude = 1.0;
  sweep.settling = Settling::fixed;
  sweep.settle = {.cycles = 1.0, .seconds = 1.0};
  sweep.target_db = 0.0;
  sweep.target_deg = 0.0;
  sweep.integrate = {.cycles = 20.0, .seconds = 0.0};
  return plan_sweep(sweep, {}, rate_hz);
}

// Y/U of the trapezoidal sums over the ticks that were integrated.
std::complex<double> plain_sums(const test::VirtualRun& run, const Dwell& dwell) {
  std::complex<double> applied{};
  std::complex<double> output{};
  for (const TickSamples& tick : run.sink.samples) {
    if (tick.tick < dwell.settle_samples) continue;
    const auto cycles = dwell.tones.front().cycles;
    const double phase = 2.0 * std::numbers::pi *
                         static_cast<double>(cycles * tick.tick % dwell.block_samples) /
                         static_cast<double>(dwell.block_samples);
    const std::complex<double> turn = std::polar(1.0, -phase);
    applied += tick.values[applied_channel] * turn;
    output += tick.values[first_sensor_channel] * turn;
  }
  return output / applied;
}

}  // namespace

int bias(const Options& options) {
  std::printf(
      "\nBias of H, %% of its size, mean of %u noise-free runs; bound 0.1\n\n"
      "                                   regression  plain sums\n",
      options.seeds_or(200));
  const QualityPlant plant = load_plant(options.rigs, "g4");
  int missed = 0;
  for (const BiasCase& each : cases) {
    const SweepPlan plan = plan_of(each.frequency_hz);
    const Dwell& dwell = plan.dwells.front();
    const std::complex<double> truth =
        plant.response(dwell.frequency_hz(rate_hz), each.jitter_periods / rate_hz);
    std::vector<std::complex<double>> own(options.seeds_or(200));
    std::vector<std::complex<double>> plain(own.size());
    in_parallel(own.size(), options.threads, [&](std::size_t i) {
      sim::SimulatedRigSettings rig;
      rig.system = plant.system;
      rig.sensors.resize(1);
      rig.seed = options.first_seed + i;
      auto& sensor = rig.sensors[0].imperfections;
      sensor.lost_fraction = each.lost_fraction;
      sensor.jitter_s = each.jitter_periods / rate_hz;
      sensor.drift_per_s = each.amplitudes_per_block * std::abs(truth) * rate_hz /
                           static_cast<double>(dwell.block_samples);
      RunnerSettings runner;
      runner.record_samples = true;
      const auto run = test::run_virtual(plan, rig, test::open_guard(1), runner);
      own[i] = run.sink.points.front().response / truth - 1.0;
      plain[i] = plain_sums(run, dwell) / truth - 1.0;
    });
    const auto bias_of = [](const std::vector<std::complex<double>>& errors) {
      std::complex<double> sum{};
      for (const auto& error : errors) sum += error;
      return std::abs(sum) / static_cast<double>(errors.size());
    };
    const bool met = bias_of(own) < most;
    std::printf("%-31s %9.5f   %9.2f     %s\n", each.name, 100.0 * bias_of(own),
                100.0 * bias_of(plain), verdict(met));
    missed += met ? 0 : 1;
  }
  return missed;
}

}  // namespace sinerig::quality
