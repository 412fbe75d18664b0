#include "sweep/regression.h"

#include <algorithm>
#include <cmath>

namespace sinerig {

namespace {

// Time stamps are whole nanoseconds: within this a sample is on the grid.
constexpr std::int64_t grid_tolerance_ns = 1;

std::size_t full_width(std::size_t channels, std::size_t max_bins) {
  const std::size_t order = 2 + 2 * max_bins;
  return triangle(order) + channels * (triangle(order) + order + 2);
}

// gram += sign · x xᵀ, with the order known to the compiler: this is most of what a tick costs.
template <std::size_t order>
void add_outer_of(double* gram, const double* x, double sign) noexcept {
  for (std::size_t i = 0; i < order; ++i) {
    const double factor = sign * x[i];
    for (std::size_t j = 0; j <= i; ++j) gram[triangle(i) + j] += factor * x[j];
  }
}

void add_outer(double* gram, const double* x, std::size_t order, double sign) noexcept {
  switch (order) {
    case 4: return add_outer_of<4>(gram, x, sign);
    case 6: return add_outer_of<6>(gram, x, sign);
    case 8: return add_outer_of<8>(gram, x, sign);
    case 10: return add_outer_of<10>(gram, x, sign);
    default: break;
  }
  for (std::size_t i = 0; i < order; ++i) {
    const double factor = sign * x[i];
    for (std::size_t j = 0; j <= i; ++j) gram[j] += factor * x[j];
    gram += i + 1;
  }
}

}  // namespace

Regression::Regression(std::size_t channels, std::size_t max_bins, std::size_t checkpoints)
    : channels_{channels},
      // An odd number of checkpoints, an even one of windows, so that merging keeps the newest.
      capacity_{checkpoints | 1U},
      capacity_width_{full_width(channels, max_bins)},
      omega_(max_bins),
      references_(channels),
      offsets_(channels),
      seen_(channels),
      totals_(capacity_width_),
      block_start_(channels * (3 + 2 * max_bins)),
      x_(2 + 2 * max_bins),
      shifted_(2 + 2 * max_bins),
      samples_(capacity_),
      store_(capacity_ * capacity_width_) {}

void Regression::start(std::span<const double> omega_rad_s, double period_s,
                       double drift_samples) noexcept {
  bins_ = omega_rad_s.size();
  period_s_ = period_s;
  drift_scale_ = 1.0 / drift_samples;
  ticks_ = 0;
  std::copy(omega_rad_s.begin(), omega_rad_s.end(), omega_.begin());
  std::fill(seen_.begin(), seen_.end(), false);
  std::fill(totals_.begin(), totals_.end(), 0.0);
  forget();
}

// The regressors `seconds` beside the tick.
void Regression::shift(std::span<const Phasor> phasors, double seconds) noexcept {
  shifted_[constant_row] = 1.0;
  shifted_[drift_row] = x_[drift_row] + seconds / period_s_ * drift_scale_;
  for (std::size_t bin = 0; bin < bins_; ++bin) {
    const double cosine = std::cos(omega_[bin] * seconds);
    const double sine = std::sin(omega_[bin] * seconds);
    const Phasor& at_tick = phasors[bin];
    shifted_[cosine_row(bin)] = at_tick.cosine * cosine - at_tick.sine * sine;
    shifted_[sine_row(bin)] = at_tick.sine * cosine + at_tick.cosine * sine;
  }
}

void Regression::add(std::span<const Phasor> phasors,
                     std::span<const Observation> observations) noexcept {
  x_[constant_row] = 1.0;
  x_[drift_row] = static_cast<double>(ticks_) * drift_scale_;
  for (std::size_t bin = 0; bin < bins_; ++bin) {
    x_[cosine_row(bin)] = phasors[bin].cosine;
    x_[sine_row(bin)] = phasors[bin].sine;
  }
  const std::size_t rows = order();
  add_outer(totals_.data(), x_.data(), rows, 1.0);

  for (std::size_t channel = 0; channel < channels_; ++channel) {
    const Observation& observation = observations[channel];
    double* gram = &totals_[gram_at(channel)];
    double* moments = &totals_[moments_at(channel)];
    if (observation.missing) {
      add_outer(gram, x_.data(), rows, -1.0);
      continue;
    }
    if (!seen_[channel]) {
      seen_[channel] = true;
      references_[channel] = observation.value;
      offsets_[channel] = observation.offset_ns;
    }
    const double value = observation.value - references_[channel];
    const std::int64_t off_grid_ns = observation.offset_ns - offsets_[channel];
    const double* x = x_.data();
    if (std::abs(off_grid_ns) > grid_tolerance_ns) {
      shift(phasors, static_cast<double>(off_grid_ns) * 1e-9);
      add_outer(gram, x_.data(), rows, -1.0);
      add_outer(gram, shifted_.data(), rows, 1.0);
      x = shifted_.data();
    }
    for (std::size_t i = 0; i < rows; ++i) moments[i] += x[i] * value;
    moments[rows] += value * value;
    moments[rows + 1] += 1.0;
  }
  ++ticks_;
}

void Regression::begin_block() noexcept {
  for (std::size_t channel = 0; channel < channels_; ++channel) {
    std::copy_n(&totals_[moments_at(channel)], order() + 1, &block_start_[channel * (order() + 1)]);
  }
}

Coefficients Regression::block_coefficients(std::size_t channel, std::size_t bin,
                                            double samples) const noexcept {
  const double* from = &block_start_[channel * (order() + 1)];
  const double* to = &totals_[moments_at(channel)];
  const auto sum = [&](std::size_t row) {
    return to[row] - from[row];
  };
  return {.a = 2.0 / samples * sum(cosine_row(bin)),
          .b = 2.0 / samples * sum(sine_row(bin)),
          .mean = references_[channel] + sum(constant_row) / samples};
}

double Regression::block_power(std::size_t channel, double samples) const noexcept {
  const double* from = &block_start_[channel * (order() + 1)];
  const double* to = &totals_[moments_at(channel)];
  const double mean = (to[constant_row] - from[constant_row]) / samples;
  return (to[order()] - from[order()]) / samples - mean * mean;
}

bool Regression::checkpoint() noexcept {
  ++parts_;
  if (kept_ == capacity_ && parts_ % stride_ == 0) {
    for (std::size_t i = 1; 2 * i < kept_; ++i) {
      std::copy_n(kept(2 * i), width(), &store_[i * capacity_width_]);
      samples_[i] = samples_[2 * i];
    }
    kept_ = (kept_ + 1) / 2;
    stride_ *= 2;
  }
  if (parts_ % stride_ != 0) return false;
  std::copy_n(totals_.data(), width(), &store_[kept_ * capacity_width_]);
  samples_[kept_] = ticks_;
  ++kept_;
  return true;
}

void Regression::forget() noexcept {
  kept_ = 1;
  stride_ = 1;
  parts_ = 0;
  std::copy_n(totals_.data(), width(), store_.data());
  samples_[0] = ticks_;
}

void Regression::window(std::size_t channel, std::size_t first, std::size_t last,
                        NormalSums& sums) const noexcept {
  const double* from = kept(first);
  const double* to = kept(last);
  const std::size_t rows = order();
  const double* own_from = from + gram_at(channel);
  const double* own_to = to + gram_at(channel);
  for (std::size_t i = 0; i < triangle(rows); ++i) {
    sums.gram[i] = (to[i] - from[i]) + (own_to[i] - own_from[i]);
  }
  const double* moments_from = from + moments_at(channel);
  const double* moments_to = to + moments_at(channel);
  for (std::size_t i = 0; i < rows; ++i) sums.moments[i] = moments_to[i] - moments_from[i];
  sums.square = moments_to[rows] - moments_from[rows];
  sums.count = moments_to[rows + 1] - moments_from[rows + 1];
}

}  // namespace sinerig
