#include "sweep/motion_check.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "sweep/multitone.h"

namespace sinerig {

namespace {

constexpr double two_pi = 2.0 * std::numbers::pi;

double sine_slew(double amplitude, double frequency_hz, double rate_hz) {
  return 2.0 * amplitude * std::sin(two_pi * frequency_hz / rate_hz / 2.0) * rate_hz;
}

// Of the slow oscillation that all dwells are laid on.
double bias_omega_rad_s(const SweepSettings& sweep) {
  return sweep.bias_amplitude > 0.0 ? two_pi * sweep.bias_hz : 0.0;
}

// What a dwell asks of the rig at most.
struct Motion {
  double amplitude = 0.0;
  double slew_per_s = 0.0;
  double velocity = 0.0;
  double acceleration = 0.0;
};

Motion motion_of(const Dwell& dwell, double rate_hz) {
  const Tone& tone = dwell.tones.front();
  const double omega_rad_s = two_pi * dwell.frequency_hz(rate_hz);
  if (dwell.tones.size() == 1) {
    return {.amplitude = tone.amplitude,
            .slew_per_s = sine_slew(tone.amplitude, dwell.frequency_hz(rate_hz), rate_hz),
            .velocity = tone.amplitude * omega_rad_s,
            .acceleration = tone.amplitude * omega_rad_s * omega_rad_s};
  }
  CommonBlock block{.samples = dwell.block_samples, .cycles = {}};
  std::vector<double> amplitudes;
  std::vector<double> phases_rad;
  for (const Tone& each : dwell.tones) {
    block.cycles.push_back(each.cycles);
    amplitudes.push_back(each.amplitude);
    phases_rad.push_back(each.phase_rad);
  }
  const TonePeaks peaks = peaks_of(block, amplitudes, phases_rad, rate_hz);
  return {.amplitude = peaks.value,
          .slew_per_s = peaks.per_s,
          .velocity = peaks.per_s,
          .acceleration = peaks.per_s2};
}

}  // namespace

void check_motion(const SweepSettings& sweep, const MotionLimits& limits, const Dwell& dwell,
                  double rate_hz) {
  Motion motion = motion_of(dwell, rate_hz);
  const double bias_rad_s = bias_omega_rad_s(sweep);
  motion.slew_per_s += sweep.bias_amplitude * bias_rad_s;
  motion.velocity += sweep.bias_amplitude * bias_rad_s;
  motion.acceleration += sweep.bias_amplitude * bias_rad_s * bias_rad_s;
  const char* amplitude_key = sweep.amplitude_table.empty() ? "amplitude" : "amplitude_table";
  const auto refuse = [&](const char* what, double value, const char* limit_key, double limit) {
    throw PlanRefused("sweep", amplitude_key,
                      std::string{what} + " of " + number(value) + " at " +
                          number(dwell.frequency_hz(rate_hz)) + " Hz: exceeds [limits] " +
                          limit_key + " = " + number(limit) +
                          "; lower the amplitude there or raise the limit");
  };
  const double baseline = sweep.neutral + sweep.offset;
  const double reach = motion.amplitude + sweep.bias_amplitude;
  if (baseline + reach > limits.command_max) {
    refuse("a command", baseline + reach, "command_max", limits.command_max);
  }
  if (baseline - reach < limits.command_min) {
    refuse("a command", baseline - reach, "command_min", limits.command_min);
  }
  if (motion.slew_per_s > limits.slew_per_s) {
    refuse("a slew", motion.slew_per_s, "slew_per_s", limits.slew_per_s);
  }
  if (motion.velocity > limits.velocity_max) {
    refuse("a peak velocity", motion.velocity, "velocity_max", limits.velocity_max);
  }
  if (motion.acceleration > limits.acceleration_max) {
    refuse("a peak acceleration", motion.acceleration, "acceleration_max", limits.acceleration_max);
  }
}

namespace {

// Beside the oscillation's own.
double slew_from_neutral(const Baseline& baseline, double rate_hz) {
  const double ramp_ticks = std::max(1.0, static_cast<double>(baseline.ramp_samples));
  const double growing = std::min(baseline.amplitude / ramp_ticks, baseline.step());
  return (std::abs(baseline.offset) / ramp_ticks + growing) * rate_hz;
}

}  // namespace

void check_baseline(const Baseline& baseline, const MotionLimits& limits, double rate_hz) {
  const double slew_per_s = slew_from_neutral(baseline, rate_hz) + baseline.step() * rate_hz;
  if (slew_per_s <= limits.slew_per_s) return;
  throw PlanRefused("sweep", "offset",
                    "a slew of " + number(slew_per_s) +
                        " on the way from neutral: exceeds [limits] slew_per_s = " +
                        number(limits.slew_per_s) + "; give it a longer ramp_s");
}

// A dwell may begin anywhere in the cycle: a change of amplitude needs half a cycle at least, or
// the command would jump. The envelope adds to the slew of the sine, change / ramp per tick, or
// change · ω from rest where the ramp is shorter than the sine takes to get there. Several tones
// fade in while what was there fades out. The first dwell rides on the way from neutral.
void check_ramp(const Dwell& dwell, const Dwell* before, double least, const Baseline& baseline,
                const MotionLimits& limits, double rate_hz) {
  if (dwell.ramp_samples == 0) return;
  const double frequency_hz = dwell.frequency_hz(rate_hz);
  const double per_s = rate_hz / static_cast<double>(dwell.ramp_samples);
  double slew_per_s = baseline.step() * rate_hz;
  if (before == nullptr) slew_per_s += slew_from_neutral(baseline, rate_hz);
  if (dwell.tones.size() > 1 || (before != nullptr && before->tones.size() > 1)) {
    const Motion motion = motion_of(dwell, rate_hz);
    const double last = before != nullptr ? motion_of(*before, rate_hz).amplitude : 0.0;
    slew_per_s += motion.slew_per_s + (motion.amplitude + last) * per_s;
  } else {
    const double amplitude = dwell.tones.front().amplitude;
    const double planned = before != nullptr ? before->tones.front().amplitude : 0.0;
    const double loudest = std::max(amplitude, planned);
    const double change =
        std::max(std::abs(amplitude - planned), loudest - std::min(least, loudest));
    if (change == 0.0) return;
    slew_per_s +=
        sine_slew(loudest, frequency_hz, rate_hz) + change * std::min(per_s, two_pi * frequency_hz);
  }
  if (slew_per_s <= limits.slew_per_s) return;
  throw PlanRefused("sweep", "ramp_s",
                    "a slew of up to " + number(slew_per_s) + " on the ramp to " +
                        number(frequency_hz) +
                        " Hz: exceeds [limits] slew_per_s = " + number(limits.slew_per_s) +
                        "; lengthen the ramp, lower the amplitude there or raise the limit");
}

void check_bias(const Dwell& dwell, double bias_hz, double rate_hz) {
  for (const Tone& tone : dwell.tones) {
    const double apart_hz = std::abs(dwell.tone_hz(tone, rate_hz) - bias_hz);
    const double resolved_hz = rate_hz / static_cast<double>(dwell.max_samples);
    if (apart_hz >= resolved_hz) continue;
    throw PlanRefused(
        "sweep", "bias_hz",
        number(bias_hz) + ": no dwell at " + number(dwell.tone_hz(tone, rate_hz)) +
            " Hz is long enough to tell the bias motion from the tone; they must be " +
            number(resolved_hz) + " Hz apart at least");
  }
}

}  // namespace sinerig
