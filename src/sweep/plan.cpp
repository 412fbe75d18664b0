#include "sweep/plan.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

namespace sinerig {

namespace {

constexpr double two_pi = 2.0 * std::numbers::pi;

// A dwell longer than this is a mistake in the rig file, not a measurement: 30 days at 1 kHz.
constexpr double max_dwell_samples = 2.6e9;

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

double sine_slew(double amplitude, double frequency_hz, double rate_hz) {
  return 2.0 * amplitude * std::sin(two_pi * frequency_hz / rate_hz / 2.0) * rate_hz;
}

void check_motion(const SweepSettings& sweep, const MotionLimits& limits, double frequency_hz,
                  double amplitude, double rate_hz) {
  const double omega_rad_s = two_pi * frequency_hz;
  const double slew_per_s = sine_slew(amplitude, frequency_hz, rate_hz);
  const char* amplitude_key = sweep.amplitude_table.empty() ? "amplitude" : "amplitude_table";
  const auto refuse = [&](const char* what, double value, const char* limit_key, double limit) {
    throw PlanRefused("sweep", amplitude_key,
                      std::string{what} + " of " + number(value) + " at " + number(frequency_hz) +
                          " Hz: exceeds [limits] " + limit_key + " = " + number(limit) +
                          "; lower the amplitude there or raise the limit");
  };
  const double baseline = sweep.neutral + sweep.offset;
  const double reach = amplitude + sweep.bias_amplitude;
  if (baseline + reach > limits.command_max) {
    refuse("a command", baseline + reach, "command_max", limits.command_max);
  }
  if (baseline - reach < limits.command_min) {
    refuse("a command", baseline - reach, "command_min", limits.command_min);
  }
  if (slew_per_s > limits.slew_per_s) {
    refuse("a slew", slew_per_s, "slew_per_s", limits.slew_per_s);
  }
  if (amplitude * omega_rad_s > limits.velocity_max) {
    refuse("a peak velocity", amplitude * omega_rad_s, "velocity_max", limits.velocity_max);
  }
  if (amplitude * omega_rad_s * omega_rad_s > limits.acceleration_max) {
    refuse("a peak acceleration", amplitude * omega_rad_s * omega_rad_s, "acceleration_max",
           limits.acceleration_max);
  }
}

// Parts of a block: short enough to see a transient go within a cycle, long enough to be worth
// keeping.
std::uint32_t part_count(std::uint64_t block_samples) {
  constexpr std::uint64_t shortest_part = 16;
  std::uint32_t parts = 1;
  while (parts < 8 && block_samples / 2 / parts >= shortest_part) parts *= 2;
  return parts;
}

// Harmonics that stay below half the rate and apart from their images.
std::uint32_t harmonic_count(std::uint32_t wanted, const CoherentFrequency& base) {
  std::uint32_t highest = 1;
  while (highest < wanted && 2 * base.cycles * (highest + 1) < base.samples) ++highest;
  return highest;
}

Dwell make_dwell(double asked_hz, const SweepSettings& sweep, double rate_hz, const Dwell* before) {
  const CoherentFrequency base = snap(asked_hz, rate_hz, sweep.frequency_tolerance);
  const auto base_samples = static_cast<double>(base.samples);
  const double samples_per_cycle = base_samples / static_cast<double>(base.cycles);
  const auto length = [&](const Span& span, double unit_samples) {
    return whole_units(span, samples_per_cycle, rate_hz, unit_samples);
  };

  const double bases = std::max(1.0, length(sweep.block, base_samples));
  const double block_samples = bases * base_samples;
  const double frequency_hz = base.hz(rate_hz);
  const double amplitude = amplitude_at(sweep, frequency_hz);
  const bool changes = before != nullptr && before->tones.front().amplitude != amplitude;
  const double ramp_samples =
      std::ceil(std::max(sweep.ramp_s * rate_hz, changes ? samples_per_cycle / 2.0 : 0.0) - 1e-9);
  // A fixed wait is whole cycles, so that the reference phase is zero when measuring begins.
  const double settle_unit = sweep.settling == Settling::fixed ? base_samples : 1.0;
  const double settle_samples = settle_unit * std::max(std::ceil(ramp_samples / settle_unit),
                                                       length(sweep.settle, settle_unit));
  const double blocks = std::max(1.0, length(sweep.integrate, block_samples));
  const bool open_ended = sweep.has_target() || sweep.settling == Settling::detect;
  double max_samples = settle_samples + blocks * block_samples;
  if (sweep.settling == Settling::detect)
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
  dwell.tones = {
      {.cycles = base.cycles * static_cast<std::uint64_t>(bases), .amplitude = amplitude}};
  dwell.harmonics = harmonic_count(sweep.harmonics, base);
  return dwell;
}

Baseline make_baseline(const SweepSettings& sweep, double rate_hz) {
  Baseline baseline{.neutral = sweep.neutral, .offset = sweep.offset};
  baseline.ramp_samples = static_cast<std::uint64_t>(std::ceil(sweep.ramp_s * rate_hz - 1e-9));
  if (sweep.bias_amplitude > 0.0) {
    baseline.amplitude = sweep.bias_amplitude;
    baseline.oscillation = snap(sweep.bias_hz, rate_hz, sweep.frequency_tolerance);
  }
  return baseline;
}

void check_baseline(const Baseline& baseline, const MotionLimits& limits, double rate_hz) {
  const double ramp_ticks = std::max(1.0, static_cast<double>(baseline.ramp_samples));
  const double slew_per_s = std::abs(baseline.offset) / ramp_ticks * rate_hz;
  if (slew_per_s <= limits.slew_per_s) return;
  throw PlanRefused("sweep", "offset",
                    "a slew of " + number(slew_per_s) +
                        " on the way from neutral: exceeds [limits] slew_per_s = " +
                        number(limits.slew_per_s) + "; give it a longer ramp_s");
}

// A dwell may begin anywhere in the cycle: a change of amplitude needs half a cycle at least, or
// the command would jump. The envelope adds to the slew of the sine, change / ramp per tick, or
// change · ω from rest where the ramp is shorter than the sine takes to get there.
void check_ramp(const Dwell& dwell, double amplitude_before, const MotionLimits& limits,
                double rate_hz) {
  const double amplitude = dwell.tones.front().amplitude;
  if (dwell.ramp_samples == 0 || amplitude == amplitude_before) return;
  const double frequency_hz = dwell.frequency_hz(rate_hz);
  const double slew_per_s =
      sine_slew(std::max(amplitude, amplitude_before), frequency_hz, rate_hz) +
      std::abs(amplitude - amplitude_before) *
          std::min(rate_hz / static_cast<double>(dwell.ramp_samples), two_pi * frequency_hz);
  if (slew_per_s <= limits.slew_per_s) return;
  throw PlanRefused("sweep", "ramp_s",
                    "a slew of up to " + number(slew_per_s) + " on the ramp to " +
                        number(frequency_hz) +
                        " Hz: exceeds [limits] slew_per_s = " + number(limits.slew_per_s) +
                        "; lengthen the ramp, lower the amplitude there or raise the limit");
}

bool same_frequency(const Dwell& a, const Dwell& b) {
  return a.tones.front().cycles * b.block_samples == b.tones.front().cycles * a.block_samples;
}

}  // namespace

std::uint64_t SweepPlan::min_samples() const {
  std::uint64_t sum = 0;
  for (const Dwell& dwell : dwells) sum += dwell.min_samples();
  return sum;
}

std::uint64_t SweepPlan::max_samples() const {
  std::uint64_t sum = 0;
  for (const Dwell& dwell : dwells) sum += dwell.max_samples;
  return sum;
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
                 .baseline = make_baseline(sweep, rate_hz),
                 .level = sweep.level,
                 .dwells = {}};
  check_baseline(plan.baseline, limits, rate_hz);
  plan.judgement = {.settling = sweep.settling,
                    .target_db = sweep.target_db,
                    .target_deg = sweep.target_deg,
                    .max_distortion = sweep.max_distortion};
  for (const AskedFrequency& each : asked) {
    const Dwell* before = plan.dwells.empty() ? nullptr : &plan.dwells.back();
    Dwell dwell = make_dwell(each.hz, sweep, rate_hz, before);
    dwell.sub_band = each.sub_band;
    const bool duplicate =
        std::any_of(plan.dwells.begin(), plan.dwells.end(),
                    [&](const Dwell& other) { return same_frequency(dwell, other); });
    if (duplicate) continue;
    check_motion(sweep, limits, dwell.frequency_hz(rate_hz), dwell.tones.front().amplitude,
                 rate_hz);
    if (plan.baseline.oscillates()) dwell.bias_hz = plan.baseline.oscillation.hz(rate_hz);
    check_ramp(dwell, before == nullptr ? 0.0 : before->tones.front().amplitude, limits, rate_hz);
    plan.dwells.push_back(std::move(dwell));
  }
  return plan;
}

}  // namespace sinerig
