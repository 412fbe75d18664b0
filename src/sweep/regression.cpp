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

}  // namespace

Regression::Regression(std::size_t channels, std::size_t max_bins, std::size_t checkpoints,
                       std::size_t max_parts)
    : channels_{channels},
      // An odd number of checkpoints, an even one of windows, so that merging keeps the newest.
      capacity_{checkpoints | 1U},
      capacity_width_{full_width(channels, max_bins)},
      omega_(max_bins),
      states_(channels),
      part_gram_{2 + 2 * max_bins, max_parts},
      totals_(capacity_width_),
      block_start_(channels * (3 + 2 * max_bins)),
      x_(2 + 2 * max_bins),
      shifted_(2 + 2 * max_bins),
      samples_(capacity_),
      store_(capacity_ * capacity_width_) {}

void Regression::start(std::span<const double> omega_rad_s, double period_s, double drift_samples,
                       std::size_t parts) noexcept {
  bins_ = omega_rad_s.size();
  period_s_ = period_s;
  drift_scale_ = 1.0 / drift_samples;
  ticks_ = 0;
  std::copy(omega_rad_s.begin(), omega_rad_s.end(), omega_.begin());
  std::fill(states_.begin(), states_.end(), ChannelState{});
  std::fill(totals_.begin(), totals_.end(), 0.0);
  part_gram_.start(order(), parts);
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

void Regression::set_regressors(std::span<const Phasor> phasors, double drift) noexcept {
  x_[constant_row] = 1.0;
  x_[drift_row] = drift;
  for (std::size_t bin = 0; bin < bins_; ++bin) {
    x_[cosine_row(bin)] = phasors[bin].cosine;
    x_[sine_row(bin)] = phasors[bin].sine;
  }
}

// A sample that is not there, or not on the grid: puts right what the shared Gram matrix takes for
// granted. Leaves the regressors of the sample in shifted_.
void Regression::correct(std::size_t channel, std::span<const Phasor> phasors, double drift,
                         std::int64_t off_grid_ns, bool missing) noexcept {
  double* gram = &totals_[gram_at(channel)];
  set_regressors(phasors, drift);
  add_outer(gram, x_.data(), order(), -1.0);
  if (missing) return;
  shift(phasors, static_cast<double>(off_grid_ns) * 1e-9);
  add_outer(gram, shifted_.data(), order(), 1.0);
}

void Regression::add(std::span<const Phasor> phasors,
                     std::span<const Observation> observations) noexcept {
  if (part_gram_.learning()) {
    set_regressors(phasors, static_cast<double>(ticks_ - part_start_) * drift_scale_);
    part_gram_.add(std::span<const double>{x_.data(), order()});
  }
  // Signed, which is one instruction.
  const double drift = static_cast<double>(static_cast<std::int64_t>(ticks_)) * drift_scale_;
  const std::size_t rows = order();
  for (std::size_t channel = 0; channel < channels_; ++channel) {
    const Observation& observation = observations[channel];
    ChannelState& state = states_[channel];
    if (observation.missing) {
      correct(channel, phasors, drift, 0, true);
      continue;
    }
    if (!state.seen) {
      state = {.reference = observation.value, .offset_ns = observation.offset_ns, .seen = true};
    }
    double* moments = &totals_[moments_at(channel)];
    const double value = observation.value - state.reference;
    const std::int64_t off_grid_ns = observation.offset_ns - state.offset_ns;
    if (std::abs(off_grid_ns) > grid_tolerance_ns) {
      correct(channel, phasors, drift, off_grid_ns, false);
      for (std::size_t i = 0; i < rows; ++i) moments[i] += shifted_[i] * value;
    } else {
      moments[constant_row] += value;
      moments[drift_row] += drift * value;
      for (std::size_t bin = 0; bin < bins_; ++bin) {
        moments[cosine_row(bin)] += phasors[bin].cosine * value;
        moments[sine_row(bin)] += phasors[bin].sine * value;
      }
    }
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
          .mean = states_[channel].reference + sum(constant_row) / samples};
}

bool Regression::checkpoint() noexcept {
  part_gram_.end_part(static_cast<double>(part_start_) * drift_scale_,
                      {totals_.data(), triangle(order())});
  part_start_ = ticks_;
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
  part_start_ = ticks_;
  part_gram_.restart();
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

void Regression::staircase(std::size_t channel, std::size_t first, std::size_t last,
                           std::size_t origin, std::size_t step, Staircase& stairs) const noexcept {
  const std::size_t rows = order();
  std::fill_n(stairs.products.begin(), rows, 0.0);
  stairs.square = 0.0;
  stairs.moment = 0.0;
  for (std::size_t begin = first; begin < last;) {
    const std::size_t level = (begin - origin) / step;
    const std::size_t end = std::min(last, origin + (level + 1) * step);
    const double* from = kept(begin);
    const double* to = kept(end);
    const std::size_t own = gram_at(channel);
    const auto height = static_cast<double>(level);
    for (std::size_t row = 0; row < rows; ++row) {
      const std::size_t at = triangle(row) + constant_row;
      stairs.products[row] += height * ((to[at] - from[at]) + (to[own + at] - from[own + at]));
    }
    const std::size_t moments = moments_at(channel);
    stairs.square += height * height * (to[moments + rows + 1] - from[moments + rows + 1]);
    stairs.moment += height * (to[moments + constant_row] - from[moments + constant_row]);
    begin = end;
  }
}

}  // namespace sinerig
