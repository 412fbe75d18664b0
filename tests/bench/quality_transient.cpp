// Settling detected where modes ring: do the intervals, the allowance for what the transient may
// have left included, hold the truth?
#include <cstdio>
#include <numbers>
#include <vector>

#include "quality.h"
#include "quality_plants.h"
#include "support/virtual_run.h"
#include "sweep/student.h"

namespace sinerig::quality {

namespace {

constexpr double least = 0.93;

struct Count {
  int gain = 0;
  int phase = 0;
  int noise_only = 0;
  int points = 0;
};

// Half width in dB of the interval that knows of the noise only.
double noise_interval_db(const Point& point) {
  const double variance = point.covariance.mean_variance() / std::norm(point.response);
  return 20.0 / std::numbers::ln10 * student_t_975(point.dof) * std::sqrt(variance);
}

Count run_once(const QualityCase& of, std::uint64_t seed) {
  Count count;
  for (const Point& point : test::run_virtual(of.plan, of.rig(seed)).sink.points) {
    const ResponseError error = error_of(point.response, of.plant.response(point.frequency_hz));
    count.gain += error.gain_db <= point.gain_interval_db ? 1 : 0;
    count.phase += error.phase_deg <= point.phase_interval_deg ? 1 : 0;
    count.noise_only += error.gain_db <= noise_interval_db(point) ? 1 : 0;
    count.points += 1;
  }
  return count;
}

}  // namespace

int transient(const Options& options) {
  std::printf(
      "\nCoverage of the 95 %% intervals with settling detected, noise 80 dB below the peak, %u "
      "sweeps; bound: gain and phase >= 93 %%\n\n      gain    phase   noise only (gain)\n",
      options.seeds_or(100));
  int missed = 0;
  for (const char* name : {"g1", "g2"}) {
    const QualityCase of = make_case(load_plant(options.rigs, name), Noise::n80);
    std::vector<Count> counts(options.seeds_or(100));
    in_parallel(counts.size(), options.threads,
                [&](std::size_t i) { counts[i] = run_once(of, options.first_seed + i); });
    Count sum;
    for (const Count& each : counts) {
      sum.gain += each.gain;
      sum.phase += each.phase;
      sum.noise_only += each.noise_only;
      sum.points += each.points;
    }
    const double points = sum.points;
    const bool met = sum.gain >= least * points && sum.phase >= least * points;
    std::printf("%s  %5.1f %%  %5.1f %%  %5.1f %%   %s\n", name, 100.0 * sum.gain / points,
                100.0 * sum.phase / points, 100.0 * sum.noise_only / points, verdict(met));
    missed += met ? 0 : 1;
  }
  return missed;
}

}  // namespace sinerig::quality
