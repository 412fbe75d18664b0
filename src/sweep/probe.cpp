#include "sweep/probe.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "sweep/asked_frequencies.h"
#include "sweep/dwell_sizing.h"

namespace sinerig {

namespace {

constexpr double two_pi = 2.0 * std::numbers::pi;

// Part of the probe in which the rig is only listened to.
constexpr double quiet_part = 0.1;

// Without a length in the settings: this part of a cycle of the lowest frequency, so many ticks at
// least and at most.
constexpr double cycles_of_lowest = 0.5;
constexpr double least_ticks = 500.0;
constexpr double most_ticks = 200'000.0;

constexpr int most_attempts = 3;

}  // namespace

Probe make_probe(const SweepSettings& sweep, const MotionLimits& limits, double rate_hz) {
  if (sweep.settling != Settling::model || sweep.probe_s == 0.0) return {};
  const std::vector<double> asked = asked_frequencies(sweep);
  const auto [low, high] = std::minmax_element(asked.begin(), asked.end());
  Probe probe{.command = {}, .quiet_samples = 0, .low_hz = *low, .high_hz = *high};
  const double ratio = std::max(probe.high_hz / probe.low_hz, 2.0);
  const double octaves = std::log(ratio);
  // Of the lowest frequency, so that the chirp goes once through a cycle.
  const double once = 1.02 * octaves / ((ratio - 1.0) * (1.0 - quiet_part));
  const double wanted = sweep.probe_s > 0.0
                            ? sweep.probe_s * rate_hz
                            : std::max(cycles_of_lowest, once) / probe.low_hz * rate_hz;
  if (sweep.probe_s > 0.0 && wanted > most_ticks) {
    throw PlanRefused("sweep", "probe_s",
                      number(sweep.probe_s) + ": at this rate the probe lasts " +
                          number(most_ticks / rate_hz) + " s at most");
  }
  const double ticks = std::clamp(wanted, least_ticks, most_ticks);
  const auto quiet = static_cast<std::size_t>(quiet_part * ticks);
  const auto length = static_cast<std::size_t>(ticks);
  probe.quiet_samples = quiet;
  probe.command.assign(length, 0.0);
  const double bias_rad_s = two_pi * sweep.bias_hz;
  const double bias_velocity = sweep.bias_amplitude * bias_rad_s;
  const double velocity_left = limits.velocity_max - bias_velocity;
  const double acceleration_left = limits.acceleration_max - bias_velocity * bias_rad_s;
  double phase = 0.0;
  double slew = 0.0;
  double peak = 0.0;
  std::size_t end = quiet;
  bool whole = false;  // it has come to the end of a cycle
  for (std::size_t k = quiet; k < length; ++k) {
    const double part = static_cast<double>(k - quiet) / static_cast<double>(length - quiet);
    const double hz = std::min(probe.low_hz * std::exp(octaves * part), 0.45 * rate_hz);
    const double omega_rad_s = two_pi * hz;
    const double amplitude = std::min({amplitude_at(sweep, hz), velocity_left / omega_rad_s,
                                       acceleration_left / (omega_rad_s * omega_rad_s)});
    probe.command[k] = amplitude * std::sin(phase);
    phase += omega_rad_s / rate_hz;
    if (k == 0) continue;
    slew = std::max(slew, std::abs(probe.command[k] - probe.command[k - 1]) * rate_hz);
    peak = std::max(peak, std::abs(probe.command[k]));
    const bool rises = probe.command[k] >= 0.0 && probe.command[k - 1] < 0.0;
    const bool falls = probe.command[k] <= 0.0 && probe.command[k - 1] > 0.0;
    if (rises || (falls && !whole)) end = k;
    whole = whole || rises;
  }
  if (end == quiet) {
    throw PlanRefused("sweep", "probe_s",
                      "not even half a cycle of " + number(probe.low_hz) +
                          " Hz fits into a probe of " +
                          number(static_cast<double>(length) / rate_hz) +
                          " s: lengthen it, or set settling = \"detect\"");
  }
  // What is left of a cycle would end in a step.
  std::fill(probe.command.begin() + static_cast<std::ptrdiff_t>(end), probe.command.end(), 0.0);
  const double baseline = sweep.neutral + sweep.offset;
  const double room =
      std::min(limits.command_max - baseline, baseline - limits.command_min) - sweep.bias_amplitude;
  const double free_slew = limits.slew_per_s - bias_velocity;
  // Nothing is known of the rig yet: as quietly as a levelled sweep begins.
  const double loudest = sweep.level.wanted() ? sweep.level.least_amplitude : unlimited;
  const double scale =
      std::max(0.0, std::min({1.0, room / peak, free_slew / slew, loudest / peak}));
  for (double& each : probe.command) each *= scale;
  probe.max_step = scale * slew / rate_hz;
  return probe;
}

Prober::Prober(const Probe& probe, const std::vector<std::size_t>& outputs, double rate_hz,
               ModeFinder* finder, bool at_start, Deputy::Where where)
    : probe_{probe},
      period_s_{1.0 / rate_hz},
      outputs_{outputs},
      finder_{finder},
      stage_{at_start && finder != nullptr && !probe.command.empty() ? Stage::playing
                                                                     : Stage::done},
      applied_(probe.command.size()),
      values_(outputs.size() * probe.command.size()),
      deputy_{[this] { search(); }, finder == nullptr ? Deputy::Where::at_once : where} {
  record_ = {.period_s = period_s_,
             .low_hz = probe.low_hz,
             .high_hz = probe.high_hz,
             .applied = applied_,
             .outputs = {}};
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    record_.outputs.push_back(
        std::span<const double>{values_}.subspan(i * applied_.size(), applied_.size()));
  }
}

void Prober::again() noexcept {
  known_ = false;
  if (finder_ == nullptr || probe_.command.empty()) return;
  stage_ = Stage::playing;
  begins_ = true;
  count_ = 0;
  attempts_ = 0;
}

void Prober::restart() noexcept {
  if (stage_ != Stage::playing) return;
  begins_ = true;
  count_ = 0;
}

void Prober::search() noexcept {
  known_ = finder_->find(record_, found_);
}

void Prober::skip() noexcept {
  if (stage_ == Stage::searching) {
    forgotten_ = true;
    return;
  }
  stage_ = Stage::done;
}

void Prober::hear() noexcept {
  if (!deputy_.idle()) return;
  stage_ = Stage::done;
  if (std::exchange(forgotten_, false)) known_ = false;
}

void Prober::add(std::span<const Observation> observations, bool disturbed) noexcept {
  if (stage_ == Stage::searching) {
    hear();
    return;
  }
  if (disturbed) {
    count_ = 0;
    begins_ = true;
    if (++attempts_ == most_attempts) stage_ = Stage::done;
    return;
  }
  applied_[count_] = observations[0].value;
  for (std::size_t i = 0; i < outputs_.size(); ++i) {
    const Observation& each = observations[outputs_[i]];
    values_[i * applied_.size() + count_] =
        each.missing ? std::numeric_limits<double>::quiet_NaN() : each.value;
  }
  if (++count_ < applied_.size()) return;
  stage_ = Stage::searching;
  deputy_.ask();
  hear();
}

}  // namespace sinerig
