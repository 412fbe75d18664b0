#include "sweep/excitation.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace sinerig {

namespace {

constexpr double two_pi = 2.0 * std::numbers::pi;

// An amplitude is the same within this, relative: what is left are rounding errors.
constexpr double same_loudness = 1e-9;

// What a change of amplitude that no plan has foreseen may add to the step of the tones, where the
// limit leaves no more.
constexpr double least_free_part = 0.02;

std::uint64_t ticks(double samples) noexcept {
  return static_cast<std::uint64_t>(std::ceil(samples));
}

}  // namespace

Excitation::Excitation(std::size_t max_tones, std::size_t max_bins, const Baseline& baseline)
    : baseline_{baseline},
      oscillation_{baseline.oscillation.cycles, baseline.oscillation.samples},
      voices_(max_tones),
      phasors_(max_bins),
      last_{baseline.neutral} {}

// Of the running single tone, one tick on.
double Excitation::carried_phase_rad() const noexcept {
  PhaseCounter next = voices_[0].phase;
  next.advance(1);
  if (next.index() == 0) return voices_[0].start_rad;
  const Phasor at = next.phasor();
  return std::atan2(at.sine, at.cosine) + voices_[0].start_rad;
}

// For what the tones stand above the baseline to go: as fast as they moved, or as is allowed beside
// the oscillation.
std::uint64_t Excitation::fade_samples(std::uint64_t least) const noexcept {
  const double distance = std::abs(tones());
  if (!(tone_step_ > 0.0) || distance <= same_loudness * loudness_) return least;
  const double step = std::min(tone_step_, baseline_.free_step());
  return distance <= step ? least : std::max(least, ticks(distance / step));
}

// The part of its amplitude that the running dwell has reached.
double Excitation::envelope() const noexcept {
  if (elapsed_ >= ramp_samples_) return 1.0;
  const double progress = static_cast<double>(elapsed_) / static_cast<double>(ramp_samples_);
  return from_scale_ + (1.0 - from_scale_) * progress;
}

// For a single tone's way to `loudness`: as planned, or as many ticks as the limit asks for, and
// half a cycle where no change was planned. From rest it needs no ramp, as it begins where it
// crosses zero: where a short one is steeper than the limit, there is none.
std::uint64_t Excitation::ramp_to(const Dwell& dwell, double loudness) const noexcept {
  const bool from_rest = tones_ == 0;
  const double change = from_rest ? loudness : std::abs(loudness - envelope() * loudness_);
  if (change <= same_loudness * loudness) return dwell.ramp_samples;
  if (from_rest && dwell.ramp_samples == 0) return 0;
  const double cycle_samples =
      static_cast<double>(dwell.block_samples) / static_cast<double>(dwell.tones.front().cycles);
  const double step = std::max(loudness, loudness_) * two_pi / cycle_samples;
  const double allowed = baseline_.free_step();
  const double free = std::max(allowed - step, least_free_part * allowed);
  const double least = dwell.ramp_samples == 0 ? 0.5 * cycle_samples : 0.0;
  const std::uint64_t needed = ticks(std::max(least, change / free));
  if (needed <= dwell.ramp_samples) return dwell.ramp_samples;
  const bool steep = static_cast<double>(dwell.ramp_samples) < 0.5 * cycle_samples;
  return from_rest && steep ? 0 : needed;
}

void Excitation::start(const Dwell& dwell, double scale) noexcept {
  const double last = tones();
  const bool crossing = tones_ > 1 || dwell.tones.size() > 1 || (tones_ == 0 && last != 0.0);
  const double carried = tones_ == 1 && dwell.tones.size() == 1 ? carried_phase_rad() : 0.0;
  double loudness = 0.0;
  for (const Tone& tone : dwell.tones) loudness = std::max(loudness, scale * tone.amplitude);
  const double loudness_before = envelope() * loudness_;
  if (crossing) {
    ramp_samples_ = tones_ == 0 ? fade_samples(dwell.ramp_samples) : dwell.ramp_samples;
  } else {
    ramp_samples_ = ramp_to(dwell, loudness);
  }
  resting_ = false;
  tones_ = dwell.tones.size();
  bins_ = dwell.bins();
  elapsed_ = 0;
  waveform_ = {};
  loudness_ = loudness;
  tone_step_ = 0.0;
  for (std::size_t i = 0; i < tones_; ++i) {
    const Tone& tone = dwell.tones[i];
    const double start_rad = std::remainder(tone.phase_rad + carried, two_pi);
    const double amplitude = scale * tone.amplitude;
    voices_[i] = {.phase = PhaseCounter{tone.cycles, dwell.block_samples},
                  .in_phase = amplitude * std::cos(start_rad),
                  .quadrature = amplitude * std::sin(start_rad),
                  .start_rad = start_rad};
    tone_step_ += amplitude * two_pi * static_cast<double>(tone.cycles) /
                  static_cast<double>(dwell.block_samples);
  }
  refresh();
  if (crossing) {
    from_scale_ = 0.0;
    handover_ = last;
  } else {
    from_scale_ = std::min(1.0, loudness_before / loudness);
    handover_ = std::max(0.0, loudness_before / loudness - 1.0) * tones_at_full();
  }
}

void Excitation::rest() noexcept {
  tones_ = 0;
  loudness_ = 0.0;
  tone_step_ = 0.0;
  run_ticks_ = 0;
  oscillation_ = PhaseCounter{baseline_.oscillation.cycles, baseline_.oscillation.samples};
  handover_ = 0.0;
  waveform_ = {};
  last_ = baseline_.neutral;
  lagging_ = false;
  resting_ = true;
  refresh();
}

void Excitation::start(const Probe& probe, double scale) noexcept {
  fade(0);
  waveform_ = probe.command;
  waveform_scale_ = scale;
  tone_step_ = scale * probe.max_step;
}

void Excitation::fade(std::uint64_t least) noexcept {
  ramp_samples_ = fade_samples(least);
  handover_ = tones();
  waveform_ = {};
  tones_ = 0;
  bins_ = 0;
  elapsed_ = 0;
  loudness_ = 0.0;
  resting_ = false;
}

void Excitation::advance(std::uint64_t ticks) noexcept {
  elapsed_ += ticks;
  run_ticks_ += ticks;
  oscillation_.advance(ticks);
  for (std::size_t i = 0; i < tones_; ++i) voices_[i].phase.advance(ticks);
  refresh();
}

void Excitation::refresh() noexcept {
  if (baseline_.oscillates()) oscillation_phasor_ = oscillation_.phasor();
  if (tones_ == 0) return;
  for (std::size_t i = 0; i < tones_; ++i) phasors_[i] = voices_[i].phase.phasor();
  const Phasor tone = phasors_[0];
  const std::size_t harmonics_end = bins_ - (baseline_.oscillates() ? 1 : 0);
  Phasor harmonic = tone;
  for (std::size_t i = tones_; i < harmonics_end; ++i) {
    harmonic = {.cosine = harmonic.cosine * tone.cosine - harmonic.sine * tone.sine,
                .sine = harmonic.sine * tone.cosine + harmonic.cosine * tone.sine};
    phasors_[i] = harmonic;
  }
  if (baseline_.oscillates()) phasors_[harmonics_end] = oscillation_phasor_;
}

double Excitation::tones_at_full() const noexcept {
  double sum = 0.0;
  for (std::size_t i = 0; i < tones_; ++i) {
    sum += voices_[i].in_phase * phasors_[i].sine + voices_[i].quadrature * phasors_[i].cosine;
  }
  return sum;
}

double Excitation::tones() const noexcept {
  const bool ramping = elapsed_ < ramp_samples_;
  const double progress =
      ramping ? static_cast<double>(elapsed_) / static_cast<double>(ramp_samples_) : 1.0;
  const double fading = ramping ? handover_ * (1.0 - progress) : 0.0;
  if (tones_ > 0) return tones_at_full() * envelope() + fading;
  if (ramping || elapsed_ - ramp_samples_ >= waveform_.size()) return fading;
  return waveform_scale_ * waveform_[elapsed_ - ramp_samples_];
}

double Excitation::baseline() const noexcept {
  const double full = baseline_.offset + baseline_.amplitude * oscillation_phasor_.sine;
  if (run_ticks_ >= baseline_.ramp_samples) return baseline_.neutral + full;
  const double progress =
      static_cast<double>(run_ticks_) / static_cast<double>(baseline_.ramp_samples);
  return baseline_.neutral + full * progress;
}

double Excitation::command() const noexcept {
  if (resting_) return baseline_.neutral;
  if (!closing_) return baseline() + tones();
  if (elapsed_ >= closing_samples_) return baseline_.neutral;
  const double left = 1.0 - static_cast<double>(elapsed_) / static_cast<double>(closing_samples_);
  return baseline_.neutral + (closing_from_ - baseline_.neutral) * left;
}

double Excitation::move(std::uint64_t ticks) noexcept {
  const double wanted = command();
  const double step = wanted - last_;
  const double most = baseline_.max_step * static_cast<double>(ticks);
  lagging_ = !on_course() && std::abs(step) > most;
  last_ = lagging_ ? last_ + std::copysign(most, step) : wanted;
  return last_;
}

void Excitation::close() noexcept {
  closing_from_ = command();
  const double distance = std::abs(closing_from_ - baseline_.neutral);
  closing_samples_ = fade_samples(baseline_.ramp_samples);
  const auto no_faster_than = [&](double step) {
    if (distance > step) closing_samples_ = std::max(closing_samples_, ticks(distance / step));
  };
  no_faster_than(baseline_.max_step);
  if (baseline_.oscillates()) no_faster_than(tone_step_ + baseline_.step());
  resting_ = false;
  elapsed_ = 0;
  closing_ = true;
}

}  // namespace sinerig
