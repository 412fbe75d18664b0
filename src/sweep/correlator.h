// The streaming correlator: Fourier coefficients of every channel at every tone over one block of
// whole cycles, on the tick's own phasor.
#pragma once

#include <complex>
#include <cstdint>
#include <span>
#include <vector>

#include "sweep/nonblocking.h"
#include "sweep/tone.h"

namespace sinerig {

// y(t) ~ mean + a cos(ωt) + b sin(ωt); a and b are a1, b1 of the paper (Bickerstaff, "more precise"
// equations), the integral taken by the composite trapezoidal rule, which over whole cycles is the
// plain sum.
struct Coefficients {
  double a = 0.0;
  double b = 0.0;
  double mean = 0.0;

  // Amplitude and phase as one number, Y = b + j a: |Y| = sqrt(a² + b²), arg Y = atan2(a, b).
  std::complex<double> phasor() const noexcept { return {b, a}; }
};

// Compensated sum (Knuth's two-sum, free of branches): the error does not grow with the number of
// terms, so that a block of 1e5 samples on a mean of 1e3 signals keeps all its digits.
class CompensatedSum {
 public:
  void add(double term) noexcept {
    const double sum = sum_ + term;
    const double taken = sum - sum_;
    lost_ += (sum_ - (sum - taken)) + (term - taken);
    sum_ = sum;
  }
  double value() const noexcept { return sum_ + lost_; }

 private:
  double sum_ = 0.0;
  double lost_ = 0.0;
};

class Correlator {
 public:
  // Allocates for `channels` signals and up to `max_tones` tones.
  Correlator(std::size_t channels, std::size_t max_tones);

  // Begins a block of `tones` tones and `samples` samples.
  void start(std::size_t tones, std::uint64_t samples) noexcept SINERIG_NONBLOCKING;

  // One tick: a phasor per tone, a value per channel.
  void add(std::span<const Phasor> phasors,
           std::span<const double> values) noexcept SINERIG_NONBLOCKING;

  // All samples of the block are in; coefficients() may be read.
  bool full() const noexcept { return count_ == samples_; }

  Coefficients coefficients(std::size_t channel, std::size_t tone) const noexcept;

 private:
  struct Sums {
    CompensatedSum cosine;
    CompensatedSum sine;
  };

  std::size_t channels_;
  std::size_t tones_ = 0;
  std::uint64_t samples_ = 0;
  std::uint64_t count_ = 0;
  std::vector<CompensatedSum> means_;  // per channel
  std::vector<Sums> sums_;             // channel-major: [channel · tones_ + tone]
};

}  // namespace sinerig
