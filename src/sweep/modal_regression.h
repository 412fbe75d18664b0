// The regression that models the transient instead of waiting for it: a channel on the tone, a
// constant and the decaying modes of the plant, with the derivatives by their poles.
//
//   y = A cos φ + B sin φ + m + Σ Re[(a_i − j b_i) e^{s_i t}]
//
// Columns: cos, sin, 1, then per pair Re z, Im z, t Re z, t Im z with z = e^{s t}, per real pole
// z, t z. t counts from the start of the dwell, in seconds.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "sweep/mode_prior.h"
#include "sweep/nonblocking.h"
#include "sweep/normal_equations.h"
#include "sweep/tone.h"

namespace sinerig {

inline constexpr std::size_t tone_columns = 3;
inline constexpr std::size_t max_modal_columns = tone_columns + 4 * ModePrior::max_modes;

constexpr std::size_t modal_columns(std::size_t parameters) {
  return tone_columns + 2 * parameters;
}

// Σ x xᵀ, Σ x y, Σ y² and the count of a stretch of samples.
struct ModalSums {
  std::array<double, triangle(max_modal_columns)> gram{};
  std::array<double, max_modal_columns> moments{};
  double square = 0.0;
  double count = 0.0;

  void clear(std::size_t columns) noexcept;
  void add(const ModalSums& other, std::size_t columns) noexcept;
};

// One sample of a channel.
struct ModalSample {
  Phasor tone;
  double value = 0.0;
  double off_grid_s = 0.0;  // true time minus time of the tick
};

class ModalRegression {
 public:
  // The poles at which the regression is linear; `period_s` of the tick, `omega_rad_s` of the tone.
  void linearise(std::span<const ModePole> poles, double period_s,
                 double omega_rad_s) noexcept SINERIG_NONBLOCKING;

  std::size_t columns() const noexcept { return columns_; }

  // Moves to a tick of the dwell: the next one costs a rotation, another an exponential.
  void go_to(std::uint64_t tick) noexcept SINERIG_NONBLOCKING;

  // Adds the sample of the present tick.
  void add(const ModalSample& sample, ModalSums& sums) noexcept SINERIG_NONBLOCKING;

  // The regressors of the sample added last.
  std::span<const double> regressors() const noexcept { return {x_.data(), columns_}; }

 private:
  struct Mode {
    ModePole pole;
    double step_re = 1.0;  // e^{s · period}
    double step_im = 0.0;
    double re = 1.0;  // e^{s t}
    double im = 0.0;
  };

  void anchor() noexcept;
  void set_regressors(const ModalSample& sample) noexcept;

  double period_s_ = 1.0;
  double omega_rad_s_ = 0.0;
  std::size_t modes_ = 0;
  std::size_t columns_ = tone_columns;
  std::array<Mode, ModePrior::max_modes> mode_{};
  std::uint64_t tick_ = 0;
  std::uint64_t anchored_ = 0;
  std::array<double, max_modal_columns> x_{};
};

}  // namespace sinerig
