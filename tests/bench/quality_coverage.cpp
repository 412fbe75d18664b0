// How often the 95 % intervals hold the truth, without a transient: white and 1/f noise, lost
// samples, scattered sample times, with optional stopping and without.
#include <cstdio>
#include <numbers>
#include <vector>

#include "quality.h"
#include "quality_plants.h"
#include "support/virtual_run.h"

namespace sinerig::quality {

namespace {

constexpr double rate_hz = 1000.0;
constexpr double snr = 10.0;  // of the response over the noise, rms: 20 dB
constexpr double least = 0.93;
constexpr double most = 0.97;

enum class Trouble { white, pink, lost, jitter };

const char* to_string(Trouble trouble) {
  switch (trouble) {
    case Trouble::white: return "white noise";
    case Trouble::pink: return "1/f noise";
    case Trouble::lost: return "1 % lost";
    case Trouble::jitter: return "jitter 5 %";
  }
  return "";
}

struct Setting {
  double frequency_hz;
  Trouble trouble;
  std::uint32_t blocks;  // measured, or measured at least
  bool stopping;
};

// Three neighbouring dwells: the first knows nothing of the noise, the last has two to learn from.
SweepPlan plan_of(const Setting& setting) {
  SweepSettings sweep;
  sweep.spacing = Spacing::list;
  for (const double factor : {1.0, 1.05, 1.1}) {
    sweep.frequencies_hz.push_back(factor * setting.frequency_hz);
  }
  sweep.frequency_tolerance = 0.01;
  sweep.amplitude = 1.0;
  sweep.settling = Settling::fixed;
  sweep.settle = {.cycles = 1.0, .seconds = 0.5};  // 33 time constants of g4
  sweep.harmonics = 3;
  sweep.target_db = 0.0;
  sweep.target_deg = 0.0;
  sweep.integrate = {.cycles = 1.0, .seconds = 0.0};
  SweepPlan plan = plan_sweep(sweep, {}, rate_hz);
  for (Dwell& dwell : plan.dwells) {
    dwell.blocks = setting.blocks;
    dwell.max_samples = dwell.min_samples();
    if (!setting.stopping) continue;
    // What white noise reaches after twice the blocks.
    dwell.max_samples += 50 * setting.blocks * dwell.block_samples;
    const double samples = 2.0 * setting.blocks * static_cast<double>(dwell.block_samples);
    const double half = 1.96 / (snr * std::sqrt(samples));
    plan.judgement.target_db = 20.0 / std::numbers::ln10 * half;
    plan.judgement.target_deg = 180.0 / std::numbers::pi * half;
  }
  return plan;
}

struct Count {
  int gain = 0;
  int phase = 0;
  int points = 0;
};

Count run_once(const QualityPlant& plant, const SweepPlan& plan, const Setting& setting,
               std::uint64_t seed) {
  sim::SimulatedRigSettings rig;
  rig.system = plant.system;
  rig.sensors.resize(1);
  rig.seed = seed;
  auto& sensor = rig.sensors[0].imperfections;
  const double noise = std::abs(plant.response(setting.frequency_hz)) / std::numbers::sqrt2 / snr;
  (setting.trouble == Trouble::pink ? sensor.pink_noise_rms : sensor.noise_rms) = noise;
  if (setting.trouble == Trouble::lost) sensor.lost_fraction = 0.01;
  if (setting.trouble == Trouble::jitter) sensor.jitter_s = 0.05 / rate_hz;
  Count count;
  for (const Point& point : test::run_virtual(plan, rig).sink.points) {
    const ResponseError error =
        error_of(point.response, plant.response(point.frequency_hz, sensor.jitter_s));
    count.gain += error.gain_db <= point.gain_interval_db ? 1 : 0;
    count.phase += error.phase_deg <= point.phase_interval_deg ? 1 : 0;
    count.points += 1;
  }
  return count;
}

int table_cell(const QualityPlant& plant, const Setting& setting, const Options& options) {
  const SweepPlan plan = plan_of(setting);
  std::vector<Count> counts(options.seeds_or(1000));
  in_parallel(counts.size(), options.threads, [&](std::size_t i) {
    counts[i] = run_once(plant, plan, setting, options.first_seed + i);
  });
  Count sum;
  for (const Count& each : counts) {
    sum.gain += each.gain;
    sum.phase += each.phase;
    sum.points += each.points;
  }
  const double gain = static_cast<double>(sum.gain) / sum.points;
  const double phase = static_cast<double>(sum.phase) / sum.points;
  const bool met = gain >= least && gain <= most && phase >= least && phase <= most;
  std::printf("  %5.1f %5.1f %c", 100.0 * gain, 100.0 * phase, met ? ' ' : '*');
  std::fflush(stdout);
  return met ? 0 : 1;
}

}  // namespace

int coverage(const Options& options) {
  std::printf(
      "\nCoverage of the 95 %% intervals of gain and of phase, %%; %u runs of three dwells on g4; "
      "bound 93–97, * = missed\n\n                      %-30s  %-30s\n                      ",
      options.seeds_or(1000), "fixed length", "until the target is met");
  for (int i = 0; i < 2; ++i) std::printf("%-15s %-15s ", " 3 blocks", " 30 blocks");
  std::printf("\n");
  const QualityPlant plant = load_plant(options.rigs, "g4");
  int missed = 0;
  for (const Trouble trouble : {Trouble::white, Trouble::pink, Trouble::lost, Trouble::jitter}) {
    for (const double frequency_hz : {1.0, 15.0, 150.0}) {
      std::printf("%-12s %4.0f Hz ", to_string(trouble), frequency_hz);
      for (const bool stopping : {false, true}) {
        for (const std::uint32_t blocks : {3U, 30U}) {
          missed += table_cell(plant, {frequency_hz, trouble, blocks, stopping}, options);
        }
      }
      std::printf("\n");
    }
  }
  return missed;
}

}  // namespace sinerig::quality
