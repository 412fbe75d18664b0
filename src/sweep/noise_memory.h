// What earlier dwells have taught about the colour of the noise: how far the scatter at the tone
// lies above or below what a white residual would give. Few blocks then suffice for an honest
// interval.
#pragma once

#include <array>
#include <cstddef>
#include <limits>

#include "sweep/estimator.h"
#include "sweep/nonblocking.h"

namespace sinerig {

// A variance and the degrees of freedom behind it.
struct PooledVariance {
  Covariance2 covariance{};  // of H
  double dof = 0.0;          // 0: nothing is known yet
  double expected = 1.0;     // the variance expected before the window was seen, over the above
};

class NoiseMemory {
 public:
  // The variance of H at this frequency, from the clusters of the window and the memory together.
  // With an `exact_input` less scatter than a white residual gives is not expected; what moves two
  // measured signals alike is no scatter of their ratio, however loud.
  PooledVariance pooled(const Estimate& estimate, double frequency_hz,
                        bool exact_input) const noexcept SINERIG_NONBLOCKING;

  // Takes in a finished dwell.
  void learn(const Estimate& estimate, double frequency_hz) noexcept SINERIG_NONBLOCKING;

  // Residual rms of the last dwell; infinite where there is none.
  double last_rms() const noexcept { return last_rms_; }

 private:
  struct Lesson {
    double log_frequency = 0.0;
    double colour = 1.0;  // scatter / white
    double dof = 0.0;
  };

  static constexpr std::size_t capacity = 32;
  std::array<Lesson, capacity> lessons_{};
  std::size_t next_ = 0;
  double last_rms_ = std::numeric_limits<double>::infinity();
};

}  // namespace sinerig
