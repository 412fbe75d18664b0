#include "sweep/noise_memory.h"

#include <algorithm>
#include <cmath>

namespace sinerig {

namespace {

// The colour of noise changes little over a part of an octave: weight e^{−|ln f/f'| / reach}.
constexpr double reach = 0.5;

// Never trust the memory for more than this: noise is not stationary for ever.
constexpr double max_memory_dof = 200.0;

// What is expected of a window leans to white noise as if that had been seen this often. Dwells
// that end when their own scatter happens to be small teach too little scatter, and the next ends
// sooner still: without this and the wait for the expected variance, intervals at 20 dB covered
// 81–90 %.
constexpr double white_dof = 20.0;

// The scatter may be this much more than what was seen of it, where it was seen often enough.
constexpr double most_chance = 2.0;

// Standard errors between what the window shows and what the memory says before it is set aside.
constexpr double disagreement = 3.0;

}  // namespace

PooledVariance NoiseMemory::pooled(const Estimate& estimate, double frequency_hz,
                                   bool exact_input) const noexcept {
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
  double leaned_to = 1.0;
  if (!exact_input && memory_dof > 0.0)
    leaned_to = std::min(1.0, most_chance * remembered);
  else if (!exact_input && estimate.scatter_dof >= white_dof)
    leaned_to = std::min(1.0, most_chance * seen);
  const double expected =
      (memory_dof * remembered + white_dof * leaned_to) / (memory_dof + white_dof);
  return {.covariance = estimate.white.scaled(colour), .dof = dof, .expected = expected / colour};
}

void NoiseMemory::learn(const Estimate& estimate, double frequency_hz) noexcept {
  last_rms_ = estimate.residual_rms;
  const double white = estimate.white.mean_variance();
  if (!(white > 0.0) || estimate.scatter_dof == 0.0) return;
  lessons_[next_] = {.log_frequency = std::log(frequency_hz),
                     .colour = estimate.scatter / white,
                     .dof = estimate.scatter_dof};
  next_ = (next_ + 1) % capacity;
}

}  // namespace sinerig
