#include "sweep/excitation.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace sinerig {

Excitation::Excitation(std::size_t max_tones, std::size_t max_bins, const Baseline& baseline)
    : baseline_{baseline},
      oscillation_{baseline.oscillation.cycles, baseline.oscillation.samples},
      voices_(max_tones),
      phasors_(max_bins) {}

// Of the running single tone, one tick on.
double Excitation::carried_phase_rad() const noexcept {
  PhaseCounter next = voices_[0].phase;
  next.advance(1);
  if (next.index() == 0) return voices_[0].start_rad;
  const Phasor at = next.phasor();
  return std::atan2(at.sine, at.cosine) + voices_[0].start_rad;
}

void Excitation::start(const Dwell& dwell, double scale) noexcept {
  const double last = tones_ == 0 ? 0.0 : tones();
  const bool several = tones_ > 1 || dwell.tones.size() > 1;
  const double carried = tones_ == 1 && dwell.tones.size() == 1 ? carried_phase_rad() : 0.0;
  tones_ = dwell.tones.size();
  bins_ = dwell.bins();
  elapsed_ = 0;
  ramp_samples_ = dwell.ramp_samples;
  double loudness = 0.0;
  for (const Tone& tone : dwell.tones) loudness = std::max(loudness, scale * tone.amplitude);
  // Only upward: a larger amplitude carried into a dwell would exceed what its plan was checked
  // for.
  from_scale_ = several ? 1.0 : std::min(1.0, loudness_ / loudness);
  handover_ = 0.0;
  loudness_ = loudness;
  for (std::size_t i = 0; i < tones_; ++i) {
    const Tone& tone = dwell.tones[i];
    const double start_rad = std::remainder(tone.phase_rad + carried, 2.0 * std::numbers::pi);
    voices_[i] = {.phase = PhaseCounter{tone.cycles, dwell.block_samples},
                  .in_phase = scale * tone.amplitude * std::cos(start_rad),
                  .quadrature = scale * tone.amplitude * std::sin(start_rad),
                  .start_rad = start_rad};
  }
  refresh();
  if (several) handover_ = last - tones();
}

void Excitation::rest() noexcept {
  tones_ = 0;
  loudness_ = 0.0;
  run_ticks_ = 0;
  handover_ = 0.0;
  waveform_ = {};
}

void Excitation::start(std::span<const double> waveform, std::uint64_t ramp_samples) noexcept {
  handover_ = tones();
  ramp_samples_ = ramp_samples;
  waveform_ = waveform;
  tones_ = 0;
  bins_ = 0;
  elapsed_ = 0;
  loudness_ = 0.0;
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

double Excitation::tones() const noexcept {
  if (tones_ == 0) {
    const double value = elapsed_ < waveform_.size() ? waveform_[elapsed_] : 0.0;
    if (elapsed_ >= ramp_samples_) return value;
    return value +
           handover_ * (1.0 - static_cast<double>(elapsed_) / static_cast<double>(ramp_samples_));
  }
  double sum = 0.0;
  for (std::size_t i = 0; i < tones_; ++i) {
    sum += voices_[i].in_phase * phasors_[i].sine + voices_[i].quadrature * phasors_[i].cosine;
  }
  if (elapsed_ >= ramp_samples_) return sum;
  const double progress = static_cast<double>(elapsed_) / static_cast<double>(ramp_samples_);
  return sum * (from_scale_ + (1.0 - from_scale_) * progress) + handover_ * (1.0 - progress);
}

double Excitation::baseline() const noexcept {
  const double full = baseline_.offset + baseline_.amplitude * oscillation_phasor_.sine;
  if (run_ticks_ >= baseline_.ramp_samples) return baseline_.neutral + full;
  const double progress =
      static_cast<double>(run_ticks_) / static_cast<double>(baseline_.ramp_samples);
  return baseline_.neutral + full * progress;
}

double Excitation::command() const noexcept {
  if (!closing_) return baseline() + tones();
  if (elapsed_ >= closing_samples_) return baseline_.neutral;
  const double left = 1.0 - static_cast<double>(elapsed_) / static_cast<double>(closing_samples_);
  return baseline_.neutral + (closing_from_ - baseline_.neutral) * left;
}

void Excitation::close() noexcept {
  closing_from_ = command();
  closing_samples_ = baseline_.ramp_samples;
  elapsed_ = 0;
  closing_ = true;
}

}  // namespace sinerig
