#include "sweep/dwell_sizing.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sweep/multitone.h"

namespace sinerig {

namespace {

constexpr double two_pi = 2.0 * std::numbers::pi;

// In cycles: a change of amplitude takes this long where the transient is modelled. Its slew is
// held against the limits.
constexpr double modelled_ramp = 1.0 / 16.0;

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

}  // namespace

double amplitude_at(const SweepSettings& sweep, double frequency_hz) {
  const double omega_rad_s = two_pi * frequency_hz;
  const double wanted = sweep.amplitude_table.empty()
                            ? sweep.amplitude
                            : table_amplitude(sweep.amplitude_table, frequency_hz);
  return std::min({wanted, sweep.follow_velocity / omega_rad_s,
                   sweep.follow_acceleration / (omega_rad_s * omega_rad_s)});
}

Dwell make_single(double asked_hz, const SweepSettings& sweep, double rate_hz,
                  const Dwell* before) {
  const CoherentFrequency base = snap(asked_hz, rate_hz, sweep.frequency_tolerance);
  const double amplitude = amplitude_at(sweep, base.hz(rate_hz));
  return make_dwell(asked_hz, base, {{.cycles = base.cycles, .amplitude = amplitude}}, sweep,
                    rate_hz, before);
}

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

}  // namespace sinerig
