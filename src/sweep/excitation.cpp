#include "sweep/excitation.h"

#include <cmath>

namespace sinerig {

Excitation::Excitation(std::size_t max_tones, std::size_t max_bins)
    : voices_(max_tones), phasors_(max_bins) {}

void Excitation::start(const Dwell& dwell, double from_scale) noexcept {
  tones_ = dwell.tones.size();
  bins_ = dwell.bins();
  elapsed_ = 0;
  ramp_samples_ = dwell.ramp_samples;
  from_scale_ = from_scale;
  for (std::size_t i = 0; i < tones_; ++i) {
    const Tone& tone = dwell.tones[i];
    voices_[i] = {.phase = PhaseCounter{tone.cycles, dwell.block_samples},
                  .in_phase = tone.amplitude * std::cos(tone.phase_rad),
                  .quadrature = tone.amplitude * std::sin(tone.phase_rad)};
  }
  refresh();
}

void Excitation::advance(std::uint64_t ticks) noexcept {
  elapsed_ += ticks;
  for (std::size_t i = 0; i < tones_; ++i) voices_[i].phase.advance(ticks);
  refresh();
}

void Excitation::refresh() noexcept {
  for (std::size_t i = 0; i < tones_; ++i) phasors_[i] = voices_[i].phase.phasor();
  const Phasor& tone = phasors_[0];
  for (std::size_t i = tones_; i < bins_; ++i) {
    const Phasor& below = i == tones_ ? tone : phasors_[i - 1];
    phasors_[i] = {.cosine = below.cosine * tone.cosine - below.sine * tone.sine,
                   .sine = below.sine * tone.cosine + below.cosine * tone.sine};
  }
}

double Excitation::command() const noexcept {
  double sum = 0.0;
  for (std::size_t i = 0; i < tones_; ++i) {
    sum += voices_[i].in_phase * phasors_[i].sine + voices_[i].quadrature * phasors_[i].cosine;
  }
  if (elapsed_ >= ramp_samples_) return sum;
  const double progress = static_cast<double>(elapsed_) / static_cast<double>(ramp_samples_);
  return sum * (from_scale_ + (1.0 - from_scale_) * progress);
}

}  // namespace sinerig
