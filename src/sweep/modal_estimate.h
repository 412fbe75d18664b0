// The most probable tone, transient and poles given the sums of a window and what was known of the
// poles before: a pure function of normal equations and prior.
#pragma once

#include <array>
#include <complex>
#include <cstddef>
#include <span>

#include "sweep/estimator.h"
#include "sweep/modal_regression.h"
#include "sweep/mode_prior.h"
#include "sweep/nonblocking.h"
#include "sweep/normal_equations.h"

namespace sinerig {

// The poles as distances from where the regression is linear: d ~ (mean, precision⁻¹).
struct PoleBelief {
  std::array<double, ModePrior::max_parameters> mean{};
  std::array<double, triangle(ModePrior::max_parameters)> precision{};
};

struct ModalSolution {
  std::complex<double> tone;  // b + j a, as Coefficients::phasor()
  double mean = 0.0;
  Covariance2 covariance{};  // of the tone for a noise variance of one; the poles' doubt included
  double residual_square = 0.0;  // Σ of squares left
  double samples = 0.0;
  double unknowns = 0.0;  // that the samples had to determine
  // Of the columns, see ModalRegression.
  std::array<double, max_modal_columns> coefficients{};
  std::array<double, ModePrior::max_parameters> amplitudes{};  // a, or a and b, per mode
  std::array<double, ModePrior::max_parameters> moved{};       // d: posterior mean

  double residual_variance() const noexcept {
    const double dof = samples - unknowns;
    return dof > 0.0 ? residual_square / dof : 0.0;
  }
};

class ModalSolver {
 public:
  ModalSolver() : solver_{max_modal_columns} {}

  // Minimises ‖y − X θ(η)‖²/σ² + (d − μ)ᵀ P⁻¹ (d − μ) over η = (A, B, m, amplitudes, d), where the
  // derivative columns' coefficients are products of amplitude and distance, by Gauss-Newton on
  // the sums alone. `poles` says how the columns are laid out. False where the window does not
  // determine the tone.
  bool solve(const ModalSums& sums, std::span<const ModePole> poles, const PoleBelief& belief,
             double noise_variance, ModalSolution& solution) noexcept SINERIG_NONBLOCKING;

  // Of the last solution: covariance of the distances d, lower triangle by rows.
  void pole_covariance(std::span<double> covariance) noexcept SINERIG_NONBLOCKING;

  // Of the last solution: how much the tone (b + j a) moves with a column's moment, one at a time:
  // the two rows of H⁻¹Jᵀ that belong to sine and cosine, for the influence of parts of a window.
  void tone_gain(std::span<double> by_sine,
                 std::span<double> by_cosine) noexcept SINERIG_NONBLOCKING;

  // gᵀ C g, C the covariance of the columns' coefficients for a noise of one, poles included: what
  // the fit takes out of a moment g.
  double explained(std::span<const double> moment) noexcept SINERIG_NONBLOCKING;

 private:
  // A column of the Jacobian dθ/dη: three rows at most.
  struct Direction {
    std::array<std::size_t, 3> row{};
    std::array<double, 3> value{};
    std::size_t count = 0;
    void set(std::size_t at, double factor) noexcept {
      row[count] = at;
      value[count++] = factor;
    }
  };

  void lay_out(std::span<const ModePole> poles, const ModalSolution& at) noexcept;
  void coefficients_of(std::span<const ModePole> poles, ModalSolution& at) const noexcept;
  void gather(const ModalSums& sums, const PoleBelief& belief, double noise_variance) noexcept;
  double cost(const ModalSums& sums, const PoleBelief& belief, double noise_variance,
              ModalSolution& at) noexcept;
  void find_visible(const ModalSums& sums, std::span<const ModePole> poles,
                    double noise_variance) noexcept;
  void unit(std::size_t index) noexcept;

  NormalSolver solver_;
  std::size_t columns_ = 0;
  std::size_t parameters_ = 0;
  double noise_variance_ = 1.0;
  std::array<bool, ModePrior::max_modes> visible_{};
  std::array<Direction, max_modal_columns> directions_{};
  std::array<double, triangle(max_modal_columns)> hessian_{};
  std::array<double, max_modal_columns> product_{};  // R θ
  std::array<double, max_modal_columns> step_{};
};

}  // namespace sinerig
