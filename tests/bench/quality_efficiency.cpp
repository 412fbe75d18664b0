// Scatter of the estimate against the Cramér-Rao bound of the samples it was made from, white
// noise. The bound on each component of H: 2σ² / (N A²).
#include <cstdio>
#include <numbers>
#include <vector>

#include "quality.h"
#include "quality_plants.h"
#include "support/virtual_run.h"

namespace sinerig::quality {

namespace {

constexpr double rate_hz = 1000.0;
constexpr double most = 1.05;
constexpr double noise_rms = 0.05;

SweepPlan plan_of(double frequency_hz, double cycles) {
  SweepSettings sweep;
  sweep.spacing = Spacing::list;
  sweep.frequencies_hz = {frequency_hz};
  sweep.frequency_tolerance = 0.01;
  sweep.amplitude = 1.0;
  sweep.settling = Settling::fixed;
  sweep.settle = {.cycles = 1.0, .seconds = 0.5};
  sweep.target_db = 0.0;
  sweep.target_deg = 0.0;
  sweep.integrate = {.cycles = cycles, .seconds = 0.0};
  return plan_sweep(sweep, {}, rate_hz);
}

}  // namespace

int efficiency(const Options& options) {
  std::printf(
      "\nVariance of H over the Cramér-Rao bound of its samples, white noise, %u runs; bound 1.05 "
      "(standard error %.3f)\n\n",
      options.seeds_or(4000), 1.0 / std::sqrt(static_cast<double>(options.seeds_or(4000))));
  const QualityPlant plant = load_plant(options.rigs, "g4");
  int missed = 0;
  for (const double frequency_hz : {2.0, 15.0, 150.0}) {
    const SweepPlan plan = plan_of(frequency_hz, 10.0);
    const double exact_hz = plan.dwells.front().frequency_hz(rate_hz);
    const std::complex<double> truth = plant.response(exact_hz);
    std::vector<double> ratios(options.seeds_or(4000));
    in_parallel(ratios.size(), options.threads, [&](std::size_t i) {
      sim::SimulatedRigSettings rig;
      rig.system = plant.system;
      rig.sensors.resize(1);
      rig.sensors[0].imperfections.noise_rms = noise_rms;
      rig.seed = options.first_seed + i;
      const auto run = test::run_virtual(plan, rig);
      const Point& point = run.sink.points.front();
      const double bound = 2.0 * noise_rms * noise_rms / point.samples;
      ratios[i] = std::norm(point.response - truth) / (2.0 * bound);
    });
    double mean = 0.0;
    for (const double ratio : ratios) mean += ratio / static_cast<double>(ratios.size());
    std::printf("%5.1f Hz, 10 cycles  %.3f   %s\n", frequency_hz, mean, verdict(mean <= most));
    missed += mean <= most ? 0 : 1;
  }
  return missed;
}

}  // namespace sinerig::quality
