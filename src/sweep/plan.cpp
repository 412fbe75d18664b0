#include "sweep/plan.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "sweep/motion_check.h"
#include "sweep/multitone.h"
#include "sweep/point_interval.h"
#include "sweep/probe.h"

namespace sinerig {

namespace {

constexpr double two_pi = 2.0 * std::numbers::pi;

// A dwell longer than this is a mistake in the rig file, not a measurement: 30 days at 1 kHz.
constexpr double max_dwell_samples = 2.6e9;

// A gap of the first pass is divided into this many for refinement, fewer where all gaps together
// would have more candidates.
constexpr std::size_t finest_pieces = 64;
constexpr std::size_t most_candidates = 20'000;

// In cycles: a change of amplitude takes this long where the transient is modelled. Its slew is
// held against the limits.
constexpr double modelled_ramp = 1.0 / 16.0;

// A candidate may follow any dwell: it always has the ramp of a change.
const Dwell any_dwell{.tones = {{}, {}}};
const Dwell at_rest{.tones = {{}}};

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", value);
  return text;
}

double log_interpolate(const AmplitudeBreak& low, const AmplitudeBreak& high, double frequency_hz) {
  const double position =
      std::log(frequency_hz / low.frequency_hz) / std::log(high.frequency_hz / low.frequency_hz);
  return low.amplitude * std::pow(high.amplitude / low.amplitude, position);
}

double table_amplitude(const std::vector<AmplitudeBreak>& table, double frequency_hz) {
  const auto above = std::find_if(table.begin(), table.end(), [&](const AmplitudeBreak& entry) {
    return entry.frequency_hz > frequency_hz;
  });
  if (above == table.begin()) return table.front().amplitude;
  if (above == table.end()) return table.back().amplitude;
  return log_interpolate(*(above - 1), *above, frequency_hz);
}

// The larger of cycles and seconds, rounded up to whole units of `unit_samples`.
double whole_units(const Span& span, double samples_per_cycle, double rate_hz,
                   double unit_samples) {
  const double samples = std::max(span.cycles * samples_per_cycle, span.seconds * rate_hz);
  // A span of exactly n units must not become n + 1 by a rounding error.
  return std::ceil(samples / unit_samples - 1e-9);
}

void check_band(const SweepSettings& sweep, double rate_hz) {
  const auto check = [&](const char* key, double frequency_hz) {
    if (frequency_hz > 0.0 && frequency_hz < rate_hz / max_dwell_samples) {
      throw PlanRefused("sweep", key,
                        number(frequency_hz) + " Hz: a cycle would last " +
                            number(1.0 / frequency_hz) + " s; " +
                            number(rate_hz / max_dwell_samples) + " Hz is the lowest at this rate");
    }
    if (frequency_hz > 0.0 && frequency_hz < rate_hz / 2.0) return;
    throw PlanRefused("sweep", key,
                      number(frequency_hz) + ": must be above 0 and below half the loop rate (" +
                          number(rate_hz / 2.0) + " Hz)");
  };
  if (sweep.spacing == Spacing::list) {
    for (const double frequency_hz : sweep.frequencies_hz) check("frequencies_hz", frequency_hz);
    return;
  }
  for (const SubBand& band : sweep.sub_bands) {
    check("sub_band_table", band.start_hz);
    check("sub_band_table", band.stop_hz);
  }
  if (!sweep.sub_bands.empty()) return;
  check("start_hz", sweep.start_hz);
  check("stop_hz", sweep.stop_hz);
}

// Parts of a block: short enough to see a transient go within a cycle, long enough to be worth
// keeping.
std::uint32_t part_count(std::uint64_t block_samples) {
  constexpr std::uint64_t shortest_part = 16;
  std::uint32_t parts = 1;
  while (parts < max_parts && block_samples / 2 / parts >= shortest_part) parts *= 2;
  return parts;
}

// Harmonics of the first tone that stay below half the rate, apart from their images and from the
// other tones.
std::uint32_t harmonic_count(std::uint32_t wanted, const CoherentFrequency& base,
                             const std::vector<Tone>& tones) {
  const auto taken = [&](std::uint64_t cycles) {
    return std::any_of(tones.begin(), tones.end(),
                       [=](const Tone& tone) { return tone.cycles == cycles; });
  };
  std::uint32_t highest = 1;
  while (highest < wanted && 2 * base.cycles * (highest + 1) < base.samples &&
         !taken(base.cycles * (highest + 1))) {
    ++highest;
  }
  return highest;
}

// `base` is the shortest block, whole cycles of every tone, and the lowest tone's cycles in it.
Dwell make_dwell(double asked_hz, const CoherentFrequency& base, std::vector<Tone> tones,
                 const SweepSettings& sweep, double rate_hz, const Dwell* before) {
  const auto base_samples = static_cast<double>(base.samples);
  const double samples_per_cycle = base_samples / static_cast<double>(base.cycles);
  const auto length = [&](const Span& span, double unit_samples) {
    return whole_units(span, samples_per_cycle, rate_hz, unit_samples);
  };

  const double bases = std::max(1.0, length(sweep.block, base_samples));
  const double block_samples = bases * base_samples;
  const auto same_amplitude = [&](const Dwell& other) {
    return tones.size() == 1 && other.tones.size() == 1 &&
           other.tones.front().amplitude == tones.front().amplitude;
  };
  const bool changes =
      sweep.level.wanted() || (before == nullptr ? tones.size() > 1 : !same_amplitude(*before));
  const double least_ramp =
      changes ? samples_per_cycle * (sweep.settling == Settling::model ? modelled_ramp : 0.5) : 0.0;
  const double ramp_samples = std::ceil(std::max(sweep.ramp_s * rate_hz, least_ramp) - 1e-9);
  // A fixed wait is whole cycles, so that the reference phase is zero when measuring begins.
  const double settle_unit = sweep.settling == Settling::fixed ? base_samples : 1.0;
  const double settle_samples =
      settle_unit * (std::ceil(ramp_samples / settle_unit) + length(sweep.settle, settle_unit));
  const double blocks = std::max(1.0, length(sweep.integrate, block_samples));
  const bool open_ended = sweep.has_target() || sweep.settling != Settling::fixed;
  double max_samples = settle_samples + blocks * block_samples;
  if (sweep.settling != Settling::fixed)
    max_samples += length(sweep.settle_max, block_samples) * block_samples;
  if (sweep.has_target()) max_samples += length(sweep.integrate_max, block_samples) * block_samples;
  if (max_samples > max_dwell_samples) {
    throw PlanRefused("sweep", open_ended ? "integrate_max_s" : "integrate_s",
                      "the dwell at " + number(asked_hz) + " Hz could last " +
                          number(max_samples / rate_hz) +
                          " s: shorten settling or integration, or loosen frequency_tolerance");
  }

  Dwell dwell;
  dwell.asked_hz = asked_hz;
  dwell.block_samples = static_cast<std::uint64_t>(block_samples);
  dwell.parts = part_count(dwell.block_samples);
  dwell.ramp_samples = static_cast<std::uint64_t>(ramp_samples);
  dwell.settle_samples = static_cast<std::uint64_t>(settle_samples);
  dwell.blocks = static_cast<std::uint32_t>(blocks);
  dwell.max_samples = static_cast<std::uint64_t>(max_samples);
  if (sweep.settling == Settling::model) {
    dwell.least_samples =
        dwell.settle_samples + static_cast<std::uint64_t>(length(sweep.integrate, 1.0));
  }
  dwell.harmonics = harmonic_count(sweep.harmonics, base, tones);
  for (Tone& tone : tones) tone.cycles *= static_cast<std::uint64_t>(bases);
  dwell.tones = std::move(tones);
  return dwell;
}

Dwell make_single(double asked_hz, const SweepSettings& sweep, double rate_hz,
                  const Dwell* before) {
  const CoherentFrequency base = snap(asked_hz, rate_hz, sweep.frequency_tolerance);
  const double amplitude = amplitude_at(sweep, base.hz(rate_hz));
  return make_dwell(asked_hz, base, {{.cycles = base.cycles, .amplitude = amplitude}}, sweep,
                    rate_hz, before);
}

// The tones of a group share the peak that the loudest of them would have alone.
Dwell make_group(const std::vector<double>& asked_hz, const SweepSettings& sweep, double rate_hz,
                 const Dwell* before) {
  if (asked_hz.size() == 1) return make_single(asked_hz.front(), sweep, rate_hz, before);
  const CommonBlock block = common_block(asked_hz, rate_hz, sweep.frequency_tolerance,
                                         sweep.tones_tolerance, sweep.odd_bins);
  if (block.samples == 0) {
    throw PlanRefused("sweep", "tones_tolerance",
                      "no block of up to 256 cycles of " + number(asked_hz.front()) +
                          " Hz is whole cycles of all the tones with it (up to " +
                          number(asked_hz.back()) + " Hz): allow more, or ask for fewer tones");
  }
  const CoherentFrequency base{.cycles = block.cycles.front(), .samples = block.samples};
  std::vector<double> amplitudes;
  for (const std::uint64_t cycles : block.cycles) {
    const CoherentFrequency tone{.cycles = cycles, .samples = block.samples};
    amplitudes.push_back(amplitude_at(sweep, tone.hz(rate_hz)));
  }
  const std::vector<double> phases_rad = low_crest_phases(block, amplitudes);
  const double loudest = *std::max_element(amplitudes.begin(), amplitudes.end());
  const double share =
      std::min(1.0, loudest / peaks_of(block, amplitudes, phases_rad, rate_hz).value);
  std::vector<Tone> tones;
  for (std::size_t i = 0; i < amplitudes.size(); ++i) {
    tones.push_back({.cycles = block.cycles[i],
                     .amplitude = amplitudes[i] * share,
                     .phase_rad = phases_rad[i]});
  }
  return make_dwell(asked_hz.front(), base, std::move(tones), sweep, rate_hz, before);
}

Baseline make_baseline(const SweepSettings& sweep, const MotionLimits& limits, double rate_hz) {
  Baseline baseline{.neutral = sweep.neutral, .offset = sweep.offset};
  baseline.max_step = limits.slew_per_s / rate_hz;
  baseline.ramp_samples = static_cast<std::uint64_t>(std::ceil(sweep.ramp_s * rate_hz - 1e-9));
  if (sweep.bias_amplitude > 0.0) {
    baseline.amplitude = sweep.bias_amplitude;
    baseline.oscillation = snap(sweep.bias_hz, rate_hz, sweep.frequency_tolerance);
  }
  return baseline;
}

// The bias motion becomes a bin of its own; a harmonic that it falls on is not watched, nor are
// those above.
void lay_on(const Baseline& baseline, Dwell& dwell, double rate_hz) {
  const double bias_hz = baseline.oscillation.hz(rate_hz);
  check_bias(dwell, bias_hz, rate_hz);
  dwell.bias_hz = bias_hz;
  const double resolved_hz = rate_hz / static_cast<double>(dwell.max_samples);
  for (std::uint32_t order = 2; order <= dwell.harmonics; ++order) {
    if (std::abs(order * dwell.frequency_hz(rate_hz) - bias_hz) < resolved_hz)
      dwell.harmonics = order - 1;
  }
}

struct AskedGroup {
  std::vector<double> frequencies_hz;
  std::uint32_t sub_band = 0;
};

// What is measured in one dwell each; no group reaches over the edge of a sub-band.
std::vector<AskedGroup> groups_of(const std::vector<AskedFrequency>& asked, std::size_t tones) {
  std::vector<AskedGroup> groups;
  for (std::size_t first = 0; first < asked.size();) {
    const std::uint32_t sub_band = asked[first].sub_band;
    std::vector<double> band;
    for (; first < asked.size() && asked[first].sub_band == sub_band; ++first)
      band.push_back(asked[first].hz);
    if (tones > 1) {
      for (const auto& group : interleaved(band, tones)) groups.push_back({group, sub_band});
    } else {
      for (const double hz : band) groups.push_back({{hz}, sub_band});
    }
  }
  return groups;
}

bool same_frequency(const Dwell& a, const Dwell& b) {
  if (a.tones.size() > 1 || b.tones.size() > 1) return false;
  return a.tones.front().cycles * b.block_samples == b.tones.front().cycles * a.block_samples;
}

Refinement make_refinement(const SweepPlan& plan, const SweepSettings& sweep,
                           const MotionLimits& limits) {
  std::vector<double> measured_hz;
  for (const Dwell& dwell : plan.dwells) {
    for (const Tone& tone : dwell.tones) measured_hz.push_back(dwell.tone_hz(tone, plan.rate_hz));
  }
  std::sort(measured_hz.begin(), measured_hz.end());
  Refinement refinement{
      .candidates = {}, .most_points = sweep.refine_points, .tolerance_db = sweep.refine_db};
  const std::size_t gaps = measured_hz.size() - 1;
  std::size_t pieces = finest_pieces;
  while (pieces > 2 && gaps * (pieces - 1) > most_candidates) pieces /= 2;
  double last_hz = 0.0;
  for (std::size_t gap = 0; gap < gaps; ++gap) {
    const double ratio = measured_hz[gap + 1] / measured_hz[gap];
    for (std::size_t i = 1; i < pieces; ++i) {
      const double asked_hz =
          measured_hz[gap] * std::pow(ratio, static_cast<double>(i) / static_cast<double>(pieces));
      Dwell dwell = make_single(asked_hz, sweep, plan.rate_hz, &any_dwell);
      const double exact_hz = dwell.frequency_hz(plan.rate_hz);
      if (exact_hz <= last_hz || exact_hz <= measured_hz[gap] || exact_hz >= measured_hz[gap + 1]) {
        continue;
      }
      // What the limits do not allow is no candidate: the first pass has been checked.
      try {
        if (plan.baseline.oscillates()) lay_on(plan.baseline, dwell, plan.rate_hz);
        check_motion(sweep, limits, dwell, plan.rate_hz);
        check_ramp(dwell, &at_rest, unlimited, plan.baseline, limits, plan.rate_hz);
      } catch (const PlanRefused&) {
        continue;
      }
      last_hz = exact_hz;
      refinement.candidates.push_back(std::move(dwell));
    }
  }
  return refinement;
}

}  // namespace

std::uint64_t SweepPlan::min_samples() const {
  std::uint64_t sum = probe.command.size();
  for (const Dwell& dwell : dwells) sum += dwell.min_samples();
  return sum;
}

std::uint64_t SweepPlan::max_samples() const {
  std::uint64_t sum = probe.command.size();
  for (const Dwell& dwell : dwells) sum += dwell.max_samples;
  return sum + refinement.max_samples();
}

std::uint64_t Refinement::max_samples() const {
  std::uint64_t longest = 0;
  for (const Dwell& dwell : candidates) longest = std::max(longest, dwell.max_samples);
  return std::min<std::uint64_t>(most_points, candidates.size()) * longest;
}

std::size_t SweepPlan::most_tones() const {
  std::size_t most = 1;
  for (const Dwell& dwell : dwells) most = std::max(most, dwell.tones.size());
  return most;
}

std::size_t SweepPlan::most_bins() const {
  std::size_t most = 1;
  for (const Dwell& dwell : dwells) most = std::max(most, dwell.bins());
  for (const Dwell& dwell : refinement.candidates) most = std::max(most, dwell.bins());
  return most;
}

double Judgement::relative_target() const {
  return has_target() ? smaller_target(target_db, target_deg) : 1e-3;
}

double amplitude_at(const SweepSettings& sweep, double frequency_hz) {
  const double omega_rad_s = two_pi * frequency_hz;
  const double wanted = sweep.amplitude_table.empty()
                            ? sweep.amplitude
                            : table_amplitude(sweep.amplitude_table, frequency_hz);
  return std::min({wanted, sweep.follow_velocity / omega_rad_s,
                   sweep.follow_acceleration / (omega_rad_s * omega_rad_s)});
}

SweepPlan plan_sweep(const SweepSettings& sweep, const MotionLimits& limits, double rate_hz) {
  const std::vector<AskedFrequency> asked = asked_of(sweep);
  if (asked.empty()) {
    throw PlanRefused("sweep", "points", "no frequency to measure: give at least one");
  }
  check_band(sweep, rate_hz);

  SweepPlan plan{.rate_hz = rate_hz,
                 .baseline = make_baseline(sweep, limits, rate_hz),
                 .level = sweep.level,
                 .dwells = {}};
  check_baseline(plan.baseline, limits, rate_hz);
  plan.judgement = {.settling = sweep.settling,
                    .target_db = sweep.target_db,
                    .target_deg = sweep.target_deg,
                    .target_of_first = sweep.target_of_first,
                    .check_fraction = sweep.check_fraction,
                    .max_distortion = sweep.max_distortion};
  for (const AskedGroup& group : groups_of(asked, sweep.tones)) {
    const Dwell* before = plan.dwells.empty() ? nullptr : &plan.dwells.back();
    Dwell dwell = make_group(group.frequencies_hz, sweep, rate_hz, before);
    dwell.sub_band = group.sub_band;
    const bool duplicate =
        std::any_of(plan.dwells.begin(), plan.dwells.end(),
                    [&](const Dwell& other) { return same_frequency(dwell, other); });
    if (duplicate) continue;
    check_motion(sweep, limits, dwell, rate_hz);
    if (plan.baseline.oscillates()) lay_on(plan.baseline, dwell, rate_hz);
    check_ramp(dwell, before, sweep.level.wanted() ? sweep.level.least_amplitude : unlimited,
               plan.baseline, limits, rate_hz);
    plan.dwells.push_back(std::move(dwell));
  }
  plan.probe = make_probe(sweep, limits, rate_hz);
  if (sweep.refine_points > 0) plan.refinement = make_refinement(plan, sweep, limits);
  return plan;
}

}  // namespace sinerig
