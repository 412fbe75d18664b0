// Bench time at equal worst error: the best fixed rules of an oracle that knows plant and noise,
// the rule of Simulink's estimator block, and the adaptive dwell with one setting for all.
#include <algorithm>
#include <cstdio>
#include <vector>

#include "quality.h"
#include "quality_fixed.h"
#include "quality_plants.h"
#include "support/virtual_run.h"
#include "sweep/asked_frequencies.h"

namespace sinerig::quality {

namespace {

constexpr FixedRule simulink{.settle_cycles = 2.0, .integrate_cycles = 4.0};

struct Sweep {
  double seconds = 0.0;
  double worst_db = 0.0;
  double worst_deg = 0.0;
  bool within = true;
  int covered = 0;
  int points = 0;
  int not_good = 0;
};

Sweep measure(const QualityCase& of, std::uint64_t seed) {
  const test::VirtualRun run = test::run_virtual(of.plan, of.rig(seed));
  Sweep sweep;
  for (const Point& point : run.sink.points) {
    const ResponseError error = error_of(point.response, of.plant.response(point.frequency_hz));
    if (point.tone == 0) sweep.seconds += point.seconds;
    sweep.worst_db = std::max(sweep.worst_db, error.gain_db);
    sweep.worst_deg = std::max(sweep.worst_deg, error.phase_deg);
    sweep.within = sweep.within && within_bounds(error);
    sweep.covered += error.gain_db <= point.gain_interval_db ? 1 : 0;
    sweep.covered += error.phase_deg <= point.phase_interval_deg ? 1 : 0;
    sweep.points += 1;
    sweep.not_good += point.status != PointStatus::good ? 1 : 0;
  }
  return sweep;
}

struct Summary {
  double seconds = 0.0;
  double within = 0.0;
  double worst_db = 0.0;  // 95 % of the sweeps stay below
  double worst_deg = 0.0;
  double coverage = 0.0;
  double not_good = 0.0;  // points of a sweep
};

Summary summarise(const std::vector<Sweep>& sweeps) {
  Summary sum;
  std::vector<double> db;
  std::vector<double> deg;
  double covered = 0.0;
  double intervals = 0.0;
  for (const Sweep& sweep : sweeps) {
    sum.seconds += sweep.seconds;
    sum.within += sweep.within ? 1.0 : 0.0;
    sum.not_good += sweep.not_good;
    covered += sweep.covered;
    intervals += 2.0 * sweep.points;
    db.push_back(sweep.worst_db);
    deg.push_back(sweep.worst_deg);
  }
  const auto count = static_cast<double>(sweeps.size());
  const auto quantile = [&](std::vector<double>& values) {
    std::sort(values.begin(), values.end());
    return values[static_cast<std::size_t>(0.95 * (count - 1.0) + 0.5)];
  };
  sum.seconds /= count;
  sum.within /= count;
  sum.not_good /= count;
  sum.coverage = covered / intervals;
  sum.worst_db = quantile(db);
  sum.worst_deg = quantile(deg);
  return sum;
}

int table_row(const QualityPlant& plant, Noise noise, const Options& options) {
  const QualityCase of = make_case(plant, noise);
  const FixedRuleModel model{of};
  const double plain = model.seconds(best_fixed_rule(model, false));
  const double timed = model.seconds(best_fixed_rule(model, true));
  std::vector<Sweep> sweeps(options.seeds_or(200));
  in_parallel(sweeps.size(), options.threads,
              [&](std::size_t i) { sweeps[i] = measure(of, options.first_seed + i); });
  const Summary own = summarise(sweeps);
  const bool damped = plant.name == "g4";
  const double of_plain = own.seconds / plain;
  const double of_timed = own.seconds / timed;
  const bool accurate = own.within >= 0.95;
  const bool quick = damped ? of_timed <= 1.1 : of_plain <= 0.5 && of_timed <= 0.7;
  std::printf(
      "%s %s %9.1f %8.1f | %6.1f %6.2f× | %7.1f  %5.2f  %5.2f  %5.1f %%  %.3f dB %.2f°  %5.1f %%  "
      "%4.2f | %s\n",
      plant.name.c_str(), to_string(noise), plain, timed, model.seconds(simulink),
      model.worst_error(simulink), own.seconds, of_plain, of_timed, 100.0 * own.within,
      own.worst_db, own.worst_deg, 100.0 * own.coverage, own.not_good, verdict(accurate && quick));
  std::fflush(stdout);
  return accurate && quick ? 0 : 1;
}

// The tones of a dwell share the peak of a single one. Twelve: of 6, 8, 10, 12 and 16 the number
// that serves all four plants.
constexpr std::uint32_t tones_in_parallel = 12;
constexpr double most_of_plain = 0.25;

// Bench time of the points one after another cannot fall below a cycle of each; nor in parallel,
// where neighbours have to be told apart.
double cycle_of_each(const QualityCase& of) {
  double seconds = 0.0;
  for (const double hz : asked_frequencies(of.plant.sweep)) seconds += 1.0 / hz;
  return seconds;
}

int tones_row(QualityPlant plant, const Options& options) {
  const QualityCase single = make_case(plant, Noise::n80);
  const FixedRuleModel model{single};
  const double plain = model.seconds(best_fixed_rule(model, false));
  plant.sweep.tones = tones_in_parallel;
  const QualityCase of = make_case(plant, Noise::n80);
  std::vector<Sweep> sweeps(options.seeds_or(200));
  in_parallel(sweeps.size(), options.threads,
              [&](std::size_t i) { sweeps[i] = measure(of, options.first_seed + i); });
  const Summary own = summarise(sweeps);
  const bool met = own.within >= 0.95 && own.seconds <= most_of_plain * plain;
  std::printf("%s %9.1f | %7.1f  %5.2f  %5.1f %%  %.3f dB %.2f°  %5.1f %%  %4.2f | %5.1f | %s\n",
              plant.name.c_str(), plain, own.seconds, own.seconds / plain, 100.0 * own.within,
              own.worst_db, own.worst_deg, 100.0 * own.coverage, own.not_good,
              cycle_of_each(single), verdict(met));
  std::fflush(stdout);
  return met ? 0 : 1;
}

}  // namespace

int parallel_tones(const Options& options) {
  std::printf(
      "\nBench time, s, with %u tones in a dwell under the peak of one, at 80 dB\n"
      "bounds: <= %.2f of the quickest fixed rule; within >= 95 %%\n\n"
      "      fixed |    ours         within  worst in 95 %%   covers  not good | a cycle of each\n",
      tones_in_parallel, most_of_plain);
  int missed = 0;
  for (const char* name : {"g1", "g2", "g3", "g4"}) {
    missed += tones_row(load_plant(options.rigs, name), options);
  }
  return missed;
}

int bench_time(const Options& options) {
  std::printf(
      "\nBench time, s, for 60 points 0.5–200 Hz within 0.1 dB and 1° in 95 %% of the sweeps\n"
      "fixed: the quickest rule for this plant and noise (settle + cycles; the same with a minimum "
      "time)\nbounds: g1–g3 <= 0.50 of the first and <= 0.70 of the second; g4 <= 1.10 of the "
      "second; within >= 95 %%\n\n"
      "            fixed    timed |  Simulink 2+4  |    ours   of 1  of 2   within  worst in 95 %% "
      " "
      "covers  not good\n");
  int missed = 0;
  for (const char* name : {"g1", "g2", "g3", "g4"}) {
    const QualityPlant plant = load_plant(options.rigs, name);
    for (const Noise noise : {Noise::n80, Noise::n60, Noise::l20}) {
      missed += table_row(plant, noise, options);
    }
  }
  return missed;
}

}  // namespace sinerig::quality
