#include "sweep/stray.h"

#include <algorithm>
#include <cmath>

namespace sinerig {

StrayEstimator::StrayEstimator(std::size_t max_bins)
    : sums_{2 + 2 * max_bins},
      solver_{1 + 2 * max_bins},
      gram_(triangle(1 + 2 * max_bins)),
      whole_{1 + 2 * max_bins},
      late_{1 + 2 * max_bins},
      input_moved_(max_bins),
      input_noise_(max_bins),
      column_(1 + 2 * max_bins) {}

// All regressors but the drift and the harmonics.
std::size_t StrayEstimator::plain_row(std::size_t i) const noexcept {
  if (i == 0) return Regression::constant_row;
  const std::size_t skipped = i > 2 * tones_ ? 2 * harmonics_ : 0;
  return Regression::cosine_row(0) + i - 1 + skipped;
}

// The stretch in sums_, into plain.
bool StrayEstimator::fit(std::size_t order, Plain& plain) noexcept {
  const std::size_t rows = order - 1 - 2 * harmonics_;
  if (sums_.count <= static_cast<double>(rows)) return false;
  for (std::size_t i = 0; i < rows; ++i) {
    for (std::size_t k = 0; k <= i; ++k) {
      gram_[triangle(i) + k] = sums_.gram[triangle(plain_row(i)) + plain_row(k)];
    }
    plain.beta[i] = sums_.moments[plain_row(i)];
  }
  if (!solver_.factor(gram_, rows)) return false;
  solver_.solve(std::span{plain.beta}.first(rows));
  double explained = 0.0;
  for (std::size_t i = 0; i < rows; ++i) explained += plain.beta[i] * sums_.moments[plain_row(i)];
  plain.variance =
      std::max(0.0, sums_.square - explained) / (sums_.count - static_cast<double>(rows));
  for (std::size_t row = 1; row <= 2 * tones_; ++row) {
    std::fill(column_.begin(), column_.end(), 0.0);
    column_[row] = 1.0;
    solver_.solve(std::span{column_}.first(rows));
    plain.spread[row] = column_[row];
  }
  return true;
}

bool StrayEstimator::estimate(const Regression& regression, const Parts& parts, const Pair& pair,
                              double most_noise, std::size_t harmonics, const Turns& turns,
                              std::span<const Estimate> estimates,
                              std::span<Stray> strays) noexcept {
  const std::size_t order = regression.order();
  const std::size_t tones = estimates.size();
  tones_ = tones;
  harmonics_ = harmonics;
  const auto difference = [&](std::size_t channel) {
    regression.window(channel, parts.first, parts.last, sums_);
    if (!fit(order, whole_)) return false;
    regression.window(channel, parts.late_first, parts.last, sums_);
    return fit(order, late_);
  };
  const auto moved = [&](std::size_t tone) {
    const std::size_t a = 1 + 2 * tone;
    return std::complex<double>{late_.beta[a + 1] - whole_.beta[a + 1],
                                late_.beta[a] - whole_.beta[a]};
  };
  const auto spread = [&](std::size_t tone) {
    const std::size_t a = 1 + 2 * tone;
    return std::max(
        0.0, late_.spread[a] + late_.spread[a + 1] - whole_.spread[a] - whole_.spread[a + 1]);
  };
  std::fill_n(input_moved_.begin(), tones, std::complex<double>{});
  std::fill_n(input_noise_.begin(), tones, 0.0);
  if (!pair.exact_input) {
    if (!difference(pair.input)) return false;
    for (std::size_t tone = 0; tone < tones; ++tone) {
      input_moved_[tone] = moved(tone) * turns.input[tone];
      // Where the window cannot tell noise from a transient, only what is remembered counts.
      if (!std::isfinite(most_noise)) input_noise_[tone] = late_.variance * spread(tone);
    }
  }
  if (!difference(pair.output)) return false;
  const double variance = std::min(late_.variance, most_noise * most_noise);
  for (std::size_t tone = 0; tone < tones; ++tone) {
    const Estimate& estimate = estimates[tone];
    const auto shift = moved(tone) * turns.output[tone] - estimate.response * input_moved_[tone];
    const double noise =
        variance * spread(tone) + std::norm(estimate.response) * input_noise_[tone];
    strays[tone] = {.shift = std::abs(shift / estimate.output),
                    .noise = std::sqrt(noise) / std::abs(estimate.output)};
  }
  return true;
}

}  // namespace sinerig
