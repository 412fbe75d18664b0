// The command of a dwell: its tones on integer phase, under one amplitude envelope. The same
// phasors drive the output and the correlator.
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
  Excitation(std::size_t max_tones, std::size_t max_bins);

  // Begins a dwell. A single tone goes on from the phase that the single tone before has reached,
  // so that the command has no step; after whole cycles that is zero. Over the ramp the envelope
  // moves from `from_scale` to 1 (a scale of the dwell's own amplitude: the amplitude has no step
  // either).
  void start(const Dwell& dwell, double from_scale) noexcept SINERIG_NONBLOCKING;

  // Moves on by `ticks`.
  void advance(std::uint64_t ticks) noexcept SINERIG_NONBLOCKING;

  double command() const noexcept SINERIG_NONBLOCKING;

  // The commanded tone as b + j a, on the phasors of the same bin.
  std::complex<double> commanded(std::size_t tone) const noexcept {
    return {voices_[tone].in_phase, voices_[tone].quadrature};
  }

  // One per bin: the tones, then the harmonics of the first from the second on.
  std::span<const Phasor> phasors() const noexcept { return {phasors_.data(), bins_}; }

 private:
  struct Voice {
    PhaseCounter phase;
    double in_phase = 0.0;    // amplitude · cos(start phase)
    double quadrature = 0.0;  // amplitude · sin(start phase)
    double start_rad = 0.0;
  };

  double carried_phase_rad() const noexcept;
  void refresh() noexcept;

  std::vector<Voice> voices_;
  std::vector<Phasor> phasors_;
  std::size_t tones_ = 0;
  std::size_t bins_ = 0;
  std::uint64_t elapsed_ = 0;
  std::uint64_t ramp_samples_ = 0;
  double from_scale_ = 1.0;
};

}  // namespace sinerig
