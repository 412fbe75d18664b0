#include "sweep/noise_memory.h"

#include <algorithm>
#include <cmath>

namespace sinerig {

namespace {

// The colour of noise changes little over a part of an octave: weight e^{−|ln f/f'| / reach}.
constexpr double reach = 0.5;

// Never trust the memory for more than this: noise is not stationary for ever.
constexpr double max_memory_dof = 60.0;

// Standard errors between what the window shows and what the memory says before it is set aside.
constexpr double disagreement = 3.0;

}  // namespace

PooledVariance NoiseMemory::pooled(const Estimate& estimate, double frequency_hz) const noexcept {
  const double white = estimate.white.mean_variance();
  if (!(white > 0.0)) return {.covariance = {}, .dof = estimate.scatter_dof};
  const double log_frequency = std::log(frequency_hz);
  double weight = 0.0;
  double weighted_colour = 0.0;
  for (const Lesson& lesson : lessons_) {
    const double each =
        lesson.dof * std::exp(-std::abs(lesson.log_frequency - log_frequency) / reach);
    weight += each;
    weighted_colour += each * lesson.colour;
  }
  double memory_dof = std::min(weight, max_memory_dof);
  const double remembered = weight > 0.0 ? weighted_colour / weight : 1.0;
  const double seen = estimate.scatter / white;
  if (estimate.scatter_dof > 0.0 && memory_dof > 0.0 && seen > 0.0) {
    const double spread = std::sqrt(2.0 / estimate.scatter_dof + 2.0 / memory_dof);
    if (std::abs(std::log(seen / remembered)) > disagreement * spread) memory_dof = 0.0;
  }
  const double dof = estimate.scatter_dof + memory_dof;
  if (dof == 0.0) return {.covariance = estimate.white, .dof = 0.0};
  const double colour = (estimate.scatter_dof * seen + memory_dof * remembered) / dof;
  return {.covariance = estimate.white.scaled(colour), .dof = dof};
}

void NoiseMemory::learn(const Estimate& estimate, double frequency_hz) noexcept {
  const double white = estimate.white.mean_variance();
  if (!(white > 0.0) || estimate.scatter_dof == 0.0) return;
  lessons_[next_] = {.log_frequency = std::log(frequency_hz),
                     .colour = estimate.scatter / white,
                     .dof = estimate.scatter_dof};
  next_ = (next_ + 1) % capacity;
}

}  // namespace sinerig
