#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <numbers>
#include <random>

#include "cli/found_modes.h"
#include "support/virtual_run.h"
#include "transient.h"

namespace sinerig::transient {

namespace {

using quality::Noise;
using quality::QualityCase;
using quality::QualityPlant;

constexpr double two_pi = 2.0 * std::numbers::pi;

// What a tale of modes that is right is taken to be known to.
constexpr double sure = 1e-4;

void tell(ModePrior& prior, ModePole pole, double frequency, double decay) {
  const std::size_t index = prior.parameters();
  const double size = std::hypot(pole.sigma_rad_s, pole.omega_rad_s);
  const double sigma = std::max(sure, decay) * std::abs(pole.sigma_rad_s);
  const double omega = std::max(sure, frequency) * size;
  prior.covariance[triangle(index) + index] = sigma * sigma;
  if (!pole.real()) prior.covariance[triangle(index + 1) + index + 1] = omega * omega;
  prior.poles[prior.modes++] = pole;
}

KnownModes told(const QualityCase& of, const Trouble& trouble, std::uint64_t seed) {
  std::mt19937_64 random{seed};
  const auto sign = [&] {
    return std::bernoulli_distribution{0.5}(random) ? 1.0 : -1.0;
  };
  KnownModes known;
  known.noise_variance = {of.noise_rms * of.noise_rms};
  known.noise_dof = 100.0;
  for (const auto& each : of.plant.modes.poles) {
    const std::complex<double> pole{each};
    const double hz = std::abs(pole) / two_pi;
    const bool missing = std::abs(hz - trouble.missing_hz) < 0.02 * trouble.missing_hz;
    if (pole.imag() < -1e-9 || missing) continue;
    const bool real = std::abs(pole.imag()) < 1e-9;
    const double decay = real ? std::min(0.1, trouble.decay) : trouble.decay;
    tell(known.prior,
         {.sigma_rad_s = pole.real() * (1.0 + decay * sign()),
          .omega_rad_s = real ? 0.0 : pole.imag() * (1.0 + trouble.frequency * sign())},
         trouble.frequency, decay);
  }
  if (trouble.added_hz > 0.0) {
    const double omega = two_pi * trouble.added_hz;
    tell(known.prior, {.sigma_rad_s = -0.01 * omega, .omega_rad_s = omega}, 0.01, 0.2);
  }
  return known;
}

// A line per sweep: where its time went, and what it doubted.
void print_sweep(std::uint64_t seed, const QualityCase& cell, const test::VirtualRun& run,
                 const std::map<std::uint32_t, Point>& last) {
  std::printf("  seed %llu: %.1f s;", static_cast<unsigned long long>(seed),
              static_cast<double>(run.outcome.ticks) / cell.plan.rate_hz);
  for (const auto& [dwell, point] : last) {
    const bool modelled = point.settled_by == SettledBy::model;
    if (modelled && point.status == PointStatus::good && point.seconds < 4.0) continue;
    const auto error = quality::error_of(point.response, cell.plant.response(point.frequency_hz));
    std::printf(" %.3g Hz %s %.1f s %s %.3f dB;", point.frequency_hz, to_string(point.settled_by),
                point.seconds, to_string(point.status), error.gain_db);
  }
  for (const Event& event : run.sink.events) {
    const bool telling = event.kind == EventKind::model_doubted ||
                         event.kind == EventKind::probed || event.kind == EventKind::remeasured ||
                         event.kind == EventKind::checked || event.kind == EventKind::condemned;
    if (telling) std::printf(" %s(%u) %g;", to_string(event.kind), event.dwell, event.value);
  }
  std::printf("\n");
}

}  // namespace

const std::vector<Case>& cases() {
  static const std::vector<Case> all{
      {"g1_80", "g1", Noise::n80, 174.8},  {"g1_60", "g1", Noise::n60, 302.8},
      {"g1_20", "g1", Noise::l20, 214.1},  {"g2_80", "g2", Noise::n80, 303.6},
      {"g2_60", "g2", Noise::n60, 2658.3}, {"g2_20", "g2", Noise::l20, 462.5},
      {"g3_80", "g3", Noise::n80, 273.6},  {"g3_60", "g3", Noise::n60, 316.0},
      {"g3_20", "g3", Noise::l20, 301.1},  {"g4_80", "g4", Noise::n80, 23.3},
      {"g4_60", "g4", Noise::n60, 80.7},   {"g4_20", "g4", Noise::l20, 58.0}};
  return all;
}

bool Options::wants(const std::string& name) const {
  return cases.empty() || std::find(cases.begin(), cases.end(), name) != cases.end();
}

Tally measure(const Case& of, const Options& options, double cycles, const Trouble& trouble) {
  QualityPlant plant = quality::load_plant(options.rigs, of.plant);
  plant.sweep.settling = Settling::model;
  plant.sweep.integrate.cycles = cycles;
  const QualityCase cell = quality::make_case(plant, of.noise);
  Tally tally;
  double covered = 0.0;
  double points = 0.0;
  for (std::uint64_t seed = options.first_seed; seed < options.first_seed + options.seeds; ++seed) {
    sim::SimulatedRigSettings rig = cell.rig(seed);
    auto& sensor = rig.sensors[0].imperfections;
    sensor.lost_fraction = trouble.lost;
    if (trouble.pink) std::swap(sensor.noise_rms, sensor.pink_noise_rms);
    cli::IdentifiedModes finder;
    RunnerSettings settings;
    settings.finder = &finder;
    if (trouble.told) settings.modes = told(cell, trouble, seed);
    const test::VirtualRun run = test::run_virtual(cell.plan, rig, test::open_guard(1), settings);
    // A dwell that was measured again counts as it was left.
    std::map<std::uint32_t, Point> last;
    for (const Point& point : run.sink.points) last[point.dwell] = point;
    bool within = true;
    bool honest = true;
    for (const auto& [dwell, point] : last) {
      const auto error = quality::error_of(point.response, plant.response(point.frequency_hz));
      const bool good = point.status == PointStatus::good;
      const bool inside = quality::within_bounds(error);
      within = within && inside;
      honest = honest && (inside || !good);
      covered += error.gain_db <= point.gain_interval_db ? 0.5 : 0.0;
      covered += error.phase_deg <= point.phase_interval_deg ? 0.5 : 0.0;
      points += 1.0;
      tally.worst_db = std::max(tally.worst_db, error.gain_db);
      tally.detected += point.settled_by == SettledBy::model ? 0.0 : 1.0;
      const bool gross =
          error.gain_db > 2.0 * quality::bound_db || error.phase_deg > 2.0 * quality::bound_deg;
      tally.silent += good && gross ? 1 : 0;
      const double cap =
          static_cast<double>(cell.plan.dwells[dwell].max_samples + 1) / cell.plan.rate_hz;
      tally.beyond_cap += point.seconds > cap ? 1 : 0;
    }
    if (options.each) print_sweep(seed, cell, run, last);
    tally.within += within ? 1.0 : 0.0;
    tally.within_or_flagged += honest ? 1.0 : 0.0;
    tally.seconds += static_cast<double>(run.outcome.ticks) / cell.plan.rate_hz;
  }
  const double sweeps = options.seeds;
  tally.seconds /= sweeps;
  tally.within /= sweeps;
  tally.within_or_flagged /= sweeps;
  tally.detected /= sweeps;
  tally.coverage = covered / points;
  return tally;
}

}  // namespace sinerig::transient
