// The command: the tones of a dwell on integer phase under one amplitude envelope, laid on a
// baseline (an offset, a slow oscillation) that runs through all dwells. The same phasors drive the
// output and the regression.
#pragma once

#include <complex>
#include <cstdint>
#include <span>
#include <vector>

#include "sweep/nonblocking.h"
#include "sweep/plan.h"
#include "sweep/tone.h"

namespace sinerig {

class Excitation {
 public:
  Excitation(std::size_t max_tones, std::size_t max_bins, const Baseline& baseline);

  // Begins a dwell. The command has no step and, on the way, is nowhere beyond the larger of both
  // dwells: a single tone goes on from the phase that the single tone before has reached (after
  // whole cycles that is zero), its envelope moves up over the ramp to `scale` times the planned
  // amplitude, and what a louder one before stood above it fades out; several tones, or one after a
  // waveform, are faded in while what was there fades out.
  void start(const Dwell& dwell, double scale) noexcept SINERIG_NONBLOCKING;

  // Of the dwell that has begun: the planned ramp, or what a change of amplitude takes that no plan
  // has foreseen (after a pre-flight, a soft limit, an interruption).
  std::uint64_t ramp_samples() const noexcept { return ramp_samples_; }

  // The command has been taken to neutral: what is next begins from there.
  void rest() noexcept SINERIG_NONBLOCKING;

  // What is played fades out, then the probe's waveform follows on the baseline, `scale` times one
  // value per tick, zero beyond its end.
  void start(const Probe& probe, double scale) noexcept SINERIG_NONBLOCKING;

  // What is played fades out, no faster than it has moved, over `least` ticks at least.
  void fade(std::uint64_t least) noexcept SINERIG_NONBLOCKING;
  bool fading() const noexcept { return tones_ == 0 && elapsed_ < ramp_samples_; }

  // Moves on by `ticks`.
  void advance(std::uint64_t ticks) noexcept SINERIG_NONBLOCKING;

  // Where the command would be in this tick …
  double command() const noexcept SINERIG_NONBLOCKING;

  // … and where it goes, `ticks` after it was last moved: there, but on the way from one thing to
  // the next no faster than its limit allows.
  double move(std::uint64_t ticks) noexcept SINERIG_NONBLOCKING;

  // Nothing has been played before the dwell that is to begin.
  bool resting() const noexcept { return tones_ == 0; }

  // The dwell's tones are what is played: the ramp is over, and nothing is left to be caught up.
  bool on_course() const noexcept {
    return !closing_ && tones_ > 0 && elapsed_ >= ramp_samples_ && !lagging_;
  }
  // What of it is no tone.
  double baseline() const noexcept SINERIG_NONBLOCKING;

  // The end of the sweep: from here on the command goes from where it is to neutral, no faster than
  // the tones have moved it and than its limit allows.
  void close() noexcept SINERIG_NONBLOCKING;
  bool closed() const noexcept { return closing_ && elapsed_ >= closing_samples_ && !lagging_; }

  // The commanded tone as b + j a, on the phasors of the same bin.
  std::complex<double> commanded(std::size_t tone) const noexcept {
    return {voices_[tone].in_phase, voices_[tone].quadrature};
  }

  // One per bin: the tones, the harmonics of the first from the second on, the oscillation of the
  // baseline where there is one.
  std::span<const Phasor> phasors() const noexcept { return {phasors_.data(), bins_}; }

 private:
  struct Voice {
    PhaseCounter phase;
    double in_phase = 0.0;    // amplitude · cos(start phase)
    double quadrature = 0.0;  // amplitude · sin(start phase)
    double start_rad = 0.0;
  };

  double carried_phase_rad() const noexcept;
  double tones() const noexcept;
  double tones_at_full() const noexcept;
  std::uint64_t fade_samples(std::uint64_t least) const noexcept;
  double envelope() const noexcept;
  std::uint64_t ramp_to(const Dwell& dwell, double loudness) const noexcept;
  void refresh() noexcept;

  Baseline baseline_;
  PhaseCounter oscillation_;
  Phasor oscillation_phasor_;
  std::uint64_t run_ticks_ = 0;
  std::vector<Voice> voices_;
  std::vector<Phasor> phasors_;
  std::size_t tones_ = 0;
  std::size_t bins_ = 0;
  std::uint64_t elapsed_ = 0;
  std::uint64_t ramp_samples_ = 0;
  double loudness_ = 0.0;    // largest amplitude of the running dwell
  double tone_step_ = 0.0;   // the largest change per tick of the tones, or of the waveform
  double handover_ = 0.0;    // what fades out over the ramp
  double from_scale_ = 1.0;  // where the envelope begins, of the running dwell's amplitudes
  std::span<const double> waveform_;
  double waveform_scale_ = 1.0;
  double last_ = 0.0;     // where the command was moved to
  bool lagging_ = false;  // … which is not where it would be
  bool resting_ = true;
  bool closing_ = false;
  std::uint64_t closing_samples_ = 0;
  double closing_from_ = 0.0;
};

}  // namespace sinerig
