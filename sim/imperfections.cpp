#include "sim/imperfections.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace sinerig::sim {

std::uint64_t stream_seed(std::uint64_t seed, std::uint64_t stream) noexcept {
  std::uint64_t z = seed + (stream + 1) * 0x9E3779B97F4A7C15ULL;
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ULL;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBULL;
  return z ^ (z >> 31);
}

PinkNoise::PinkNoise(double rms, std::uint64_t seed)
    : generator_{seed}, drive_{rms / std::sqrt(static_cast<double>(octaves))} {
  // Corner of process k at rate / 2^(k+2); its innovation is scaled to keep the variance at one.
  for (std::size_t k = 0; k < octaves; ++k) {
    const double corner = std::exp2(-static_cast<double>(k) - 2.0);
    decay_[k] = std::exp(-2.0 * std::numbers::pi * corner);
    state_[k] = normal_(generator_);
  }
}

double PinkNoise::next() noexcept {
  double sum = 0.0;
  for (std::size_t k = 0; k < octaves; ++k) {
    const double innovation = std::sqrt(1.0 - decay_[k] * decay_[k]);
    state_[k] = decay_[k] * state_[k] + innovation * normal_(generator_);
    sum += state_[k];
  }
  return drive_ * sum;
}

double Backlash::pass(double input) noexcept {
  output_ = std::clamp(output_, input - half_gap_, input + half_gap_);
  return output_;
}

}  // namespace sinerig::sim
