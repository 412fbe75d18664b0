// The streaming regression of a dwell: every channel on a constant, a drift and the cosine and sine
// of every bin (tones and their harmonics), each sample at its true time. Running totals, with
// checkpoints from which any window between two of them can be solved.
//
// A missing sample leaves the totals; a sample off the grid enters at its own time. On complete
// uniform windows of whole cycles, without drift, the solution is the plain sums of the definition.
#pragma once

#include <complex>
#include <cstdint>
#include <span>
#include <vector>

#include "sweep/nonblocking.h"
#include "sweep/normal_equations.h"
#include "sweep/part_gram.h"
#include "sweep/tone.h"

namespace sinerig {

// What one channel delivers at a tick.
struct Observation {
  double value = 0.0;
  std::int64_t offset_ns = 0;  // true time minus time of the tick
  bool missing = false;
};

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

// What a staircase z has in common with the regressors and with the channel.
struct Staircase {
  std::vector<double> products;  // Σ z x of every regressor
  double square = 0.0;           // Σ z²
  double moment = 0.0;           // Σ z y

  explicit Staircase(std::size_t max_order) : products(max_order) {}
};

class Regression {
 public:
  static constexpr std::size_t constant_row = 0;
  static constexpr std::size_t drift_row = 1;
  static constexpr std::size_t cosine_row(std::size_t bin) { return 2 + 2 * bin; }
  static constexpr std::size_t sine_row(std::size_t bin) { return 3 + 2 * bin; }

  // Takes all memory: `checkpoints` is how many can be kept at once, `max_parts` in how many a
  // block may be cut.
  Regression(std::size_t channels, std::size_t max_bins, std::size_t checkpoints,
             std::size_t max_parts);

  // Begins a dwell. `omega_rad_s` per bin; `period_s` of the tick; `drift_samples` the length in
  // which the drift regressor moves by one; `parts` in how many a block is cut, at whose ends
  // checkpoint() is called, if all bins are whole cycles in a block, 0 if not.
  void start(std::span<const double> omega_rad_s, double period_s, double drift_samples,
             std::size_t parts) noexcept SINERIG_NONBLOCKING;

  // One tick: a phasor per bin, an observation per channel.
  void add(std::span<const Phasor> phasors,
           std::span<const Observation> observations) noexcept SINERIG_NONBLOCKING;

  // Begins a block of whole cycles; its plain sums once `samples` have been added to it, all of
  // them there and on the grid. A mean is subtracted from each channel before it is summed, so that
  // a large offset costs no digits.
  void begin_block() noexcept SINERIG_NONBLOCKING;
  Coefficients block_coefficients(std::size_t channel, std::size_t bin,
                                  double samples) const noexcept SINERIG_NONBLOCKING;

  // Ends a part. Keeps the totals up to here, or every stride()-th time only: when the memory is
  // full every second checkpoint goes and the stride doubles. True when a checkpoint was kept.
  bool checkpoint() noexcept SINERIG_NONBLOCKING;

  // Forgets everything but the last state: the next window starts here.
  void forget() noexcept SINERIG_NONBLOCKING;

  std::size_t checkpoints() const noexcept { return kept_; }
  std::size_t stride() const noexcept { return stride_; }  // parts between two checkpoints
  std::uint64_t samples_at(std::size_t checkpoint) const noexcept { return samples_[checkpoint]; }
  std::size_t order() const noexcept { return 2 + 2 * bins_; }
  std::size_t channels() const noexcept { return channels_; }
  double reference(std::size_t channel) const noexcept { return states_[channel].reference; }

  // The sums of a channel between two checkpoints.
  void window(std::size_t channel, std::size_t first, std::size_t last,
              NormalSums& sums) const noexcept SINERIG_NONBLOCKING;

  // The sums of a channel between two checkpoints with another regressor than the straight drift
  // for its slope: a staircase that climbs by one every `step` checkpoints, counted from `origin`.
  // Over whole blocks it is orthogonal to all that repeats in each block, harmonics that nobody
  // models included; the slope of the means of the blocks is what it sees.
  void staircase(std::size_t channel, std::size_t first, std::size_t last, std::size_t origin,
                 std::size_t step, Staircase& stairs) const noexcept SINERIG_NONBLOCKING;

  // The offset that the channel's phase is referred to; its coefficients are to be turned by
  // e^{−jω·offset}.
  std::int64_t common_offset_ns(std::size_t channel) const noexcept {
    return states_[channel].offset_ns;
  }

 private:
  // One row of totals: shared Gram, then per channel Gram correction, moments, square, count.
  std::size_t gram_at(std::size_t channel) const noexcept {
    return triangle(order()) + channel * channel_width();
  }
  std::size_t moments_at(std::size_t channel) const noexcept {
    return gram_at(channel) + triangle(order());
  }
  std::size_t channel_width() const noexcept { return triangle(order()) + order() + 2; }
  std::size_t width() const noexcept { return triangle(order()) + channels_ * channel_width(); }
  const double* kept(std::size_t checkpoint) const noexcept {
    return &store_[checkpoint * capacity_width_];
  }

  struct ChannelState {
    double reference = 0.0;      // its first value, which is subtracted
    std::int64_t offset_ns = 0;  // of its first sample from the tick
    bool seen = false;
  };

  void set_regressors(std::span<const Phasor> phasors, double drift) noexcept;
  void correct(std::size_t channel, std::span<const Phasor> phasors, double drift,
               std::int64_t off_grid_ns, bool missing) noexcept;
  void shift(std::span<const Phasor> phasors, double seconds) noexcept;

  std::size_t channels_;
  std::size_t capacity_;
  std::size_t capacity_width_;

  std::size_t bins_ = 0;
  double period_s_ = 1.0;
  double drift_scale_ = 1.0;
  std::uint64_t ticks_ = 0;
  std::vector<double> omega_;
  std::vector<ChannelState> states_;
  PartGram part_gram_;
  std::uint64_t part_start_ = 0;
  std::vector<double> totals_;
  std::vector<double> block_start_;  // moments and square of every channel when the block began
  std::vector<double> x_;
  std::vector<double> shifted_;

  std::size_t kept_ = 0;
  std::size_t stride_ = 1;
  std::uint64_t parts_ = 0;
  std::vector<std::uint64_t> samples_;
  std::vector<double> store_;
};

}  // namespace sinerig
