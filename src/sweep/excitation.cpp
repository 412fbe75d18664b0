#include "sweep/excitation.h"

#include <cmath>
#include <numbers>

namespace sinerig {

Excitation::Excitation(std::size_t max_tones, std::size_t max_bins)
    : voices_(max_tones), phasors_(max_bins) {}

// Of the running single tone, one tick on.
double Excitation::carried_phase_rad() const noexcept {
  PhaseCounter next = voices_[0].phase;
  next.advance(1);
  if (next.index() == 0) return voices_[0].start_rad;
  const Phasor at = next.phasor();
  return std::atan2(at.sine, at.cosine) + voices_[0].start_rad;
}

void Excitation::start(const Dwell& dwell, double from_scale) noexcept {
  const double carried = tones_ == 1 && dwell.tones.size() == 1 ? carried_phase_rad() : 0.0;
  tones_ = dwell.tones.size();
  bins_ = dwell.bins();
  elapsed_ = 0;
  ramp_samples_ = dwell.ramp_samples;
  from_scale_ = from_scale;
  for (std::size_t i = 0; i < tones_; ++i) {
    const Tone& tone = dwell.tones[i];
    const double start_rad = std::remainder(tone.phase_rad + carried, 2.0 * std::numbers::pi);
    voices_[i] = {.phase = PhaseCounter{tone.cycles, dwell.block_samples},
                  .in_phase = tone.amplitude * std::cos(start_rad),
                  .quadrature = tone.amplitude * std::sin(start_rad),
                  .start_rad = start_rad};
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
