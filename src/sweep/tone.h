// Coherent tones: a frequency is a whole number of cycles in a whole number of samples, and the
// phase of a tick is an integer. No error accumulates, however long the dwell.
#pragma once

#include <cstdint>

#include "sweep/nonblocking.h"

namespace sinerig {

// f / rate = cycles / samples, in lowest terms.
struct CoherentFrequency {
  std::uint64_t cycles = 0;
  std::uint64_t samples = 1;

  double hz(double rate_hz) const {
    return rate_hz * static_cast<double>(cycles) / static_cast<double>(samples);
  }
  friend bool operator==(const CoherentFrequency&, const CoherentFrequency&) = default;
};

// The coherent frequency with the fewest samples within `relative_tolerance` of `frequency_hz`:
// the simplest fraction in the interval, found on the Stern-Brocot tree. Needs
// 0 < frequency_hz < rate_hz / 2 and a tolerance in (0, 0.1]; throws std::invalid_argument.
CoherentFrequency snap(double frequency_hz, double rate_hz, double relative_tolerance);

struct Phasor {
  double cosine = 1.0;
  double sine = 0.0;
};

// cos and sin of 2π·index/samples, index < samples. The argument is folded into one octant as an
// integer first, so that symmetric indices give exactly symmetric values and the error stays below
// 2^−52.
Phasor phasor(std::uint64_t index, std::uint64_t samples) noexcept SINERIG_NONBLOCKING;

// The same for whoever asks again and again: with π/4 / samples, which costs a division.
Phasor phasor(std::uint64_t index, std::uint64_t samples,
              double eighth_turn_rad) noexcept SINERIG_NONBLOCKING;
double eighth_turn_rad(std::uint64_t samples) noexcept;

// The phase of the current tick, (cycles · n) mod samples.
class PhaseCounter {
 public:
  PhaseCounter() = default;
  PhaseCounter(std::uint64_t cycles, std::uint64_t samples) noexcept
      : step_{cycles % samples}, samples_{samples}, eighth_turn_rad_{eighth_turn_rad(samples)} {}

  // Moves on by `ticks` ticks (more than one after an overrun).
  void advance(std::uint64_t ticks) noexcept SINERIG_NONBLOCKING {
    index_ += ticks == 1 ? step_ : step_ * (ticks % samples_) % samples_;
    if (index_ >= samples_) index_ -= samples_;
  }
  std::uint64_t index() const noexcept { return index_; }
  Phasor phasor() const noexcept SINERIG_NONBLOCKING {
    return sinerig::phasor(index_, samples_, eighth_turn_rad_);
  }

 private:
  std::uint64_t step_ = 0;
  std::uint64_t samples_ = 1;
  std::uint64_t index_ = 0;
  double eighth_turn_rad_ = eighth_turn_rad(1);
};

}  // namespace sinerig
