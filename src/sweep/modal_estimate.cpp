#include "sweep/modal_estimate.h"

#include <algorithm>
#include <cmath>

namespace sinerig {

namespace {

constexpr int most_steps = 8;
constexpr int most_halvings = 6;

// A step that changes the cost by less than this, in units of χ², is the last.
constexpr double negligible_change = 1e-3;

// A mode that cannot have shown this part of the noise in the window is left out of it: its
// amplitude would be anything.
constexpr double invisible = 1e-3;

// … if it is no larger than this multiple of the signal where the dwell begins.
constexpr double largest_transient = 30.0;

double element(std::span<const double> packed, std::size_t i, std::size_t j) noexcept {
  return i >= j ? packed[triangle(i) + j] : packed[triangle(j) + i];
}

}  // namespace

void ModalSolver::find_visible(const ModalSums& sums, std::span<const ModePole> poles,
                               double noise_variance) noexcept {
  const double most = largest_transient * largest_transient * sums.square / sums.count;
  std::size_t row = tone_columns;
  for (std::size_t i = 0; i < poles.size(); ++i) {
    double power = 0.0;
    for (std::size_t k = 0; k < poles[i].size(); ++k)
      power += sums.gram[triangle(row + k) + row + k];
    visible_[i] = power * most > invisible * noise_variance && power > 0.0;
    row += 2 * poles[i].size();
  }
}

void ModalSolver::coefficients_of(std::span<const ModePole> poles,
                                  ModalSolution& at) const noexcept {
  at.coefficients[0] = at.tone.imag();
  at.coefficients[1] = at.tone.real();
  at.coefficients[2] = at.mean;
  std::size_t row = tone_columns;
  std::size_t index = 0;
  for (const ModePole& pole : poles) {
    const double* amplitude = &at.amplitudes[index];
    const double* moved = &at.moved[index];
    double* theta = &at.coefficients[row];
    if (pole.real()) {
      theta[0] = amplitude[0];
      theta[1] = amplitude[0] * moved[0];
    } else {
      theta[0] = amplitude[0];
      theta[1] = amplitude[1];
      theta[2] = amplitude[0] * moved[0] + amplitude[1] * moved[1];
      theta[3] = amplitude[1] * moved[0] - amplitude[0] * moved[1];
    }
    row += 2 * pole.size();
    index += pole.size();
  }
}

void ModalSolver::lay_out(std::span<const ModePole> poles, const ModalSolution& at) noexcept {
  for (std::size_t i = 0; i < columns_; ++i) directions_[i].count = 0;
  for (std::size_t i = 0; i < tone_columns; ++i) directions_[i].set(i, 1.0);
  std::size_t row = tone_columns;
  std::size_t index = 0;
  for (std::size_t i = 0; i < poles.size(); ++i) {
    const ModePole& pole = poles[i];
    const double* a = &at.amplitudes[index];
    const double* d = &at.moved[index];
    Direction* amplitude = &directions_[tone_columns + index];
    Direction* distance = &directions_[tone_columns + parameters_ + index];
    if (!visible_[i]) {
      // No direction: absent from the solution, its poles as believed.
    } else if (pole.real()) {
      amplitude[0].set(row, 1.0);
      amplitude[0].set(row + 1, d[0]);
      distance[0].set(row + 1, a[0]);
    } else {
      amplitude[0].set(row, 1.0);
      amplitude[0].set(row + 2, d[0]);
      amplitude[0].set(row + 3, -d[1]);
      amplitude[1].set(row + 1, 1.0);
      amplitude[1].set(row + 2, d[1]);
      amplitude[1].set(row + 3, d[0]);
      distance[0].set(row + 2, a[0]);
      distance[0].set(row + 3, a[1]);
      distance[1].set(row + 2, a[1]);
      distance[1].set(row + 3, -a[0]);
    }
    row += 2 * pole.size();
    index += pole.size();
  }
}

void ModalSolver::gather(const ModalSums& sums, const PoleBelief& belief,
                         double noise_variance) noexcept {
  const double weight = 1.0 / noise_variance;
  for (std::size_t i = 0; i < columns_; ++i) {
    const Direction& one = directions_[i];
    for (std::size_t j = 0; j <= i; ++j) {
      const Direction& other = directions_[j];
      double sum = 0.0;
      for (std::size_t k = 0; k < one.count; ++k) {
        for (std::size_t l = 0; l < other.count; ++l) {
          sum += one.value[k] * other.value[l] * element(sums.gram, one.row[k], other.row[l]);
        }
      }
      hessian_[triangle(i) + j] = weight * sum;
    }
  }
  const std::size_t first = tone_columns + parameters_;
  for (std::size_t i = 0; i < parameters_; ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      hessian_[triangle(first + i) + first + j] += belief.precision[triangle(i) + j];
    }
  }
}

// Twice the negative logarithm of the posterior, but for a constant; leaves R θ in product_.
double ModalSolver::cost(const ModalSums& sums, const PoleBelief& belief, double noise_variance,
                         ModalSolution& at) noexcept {
  const std::span<const double> theta{at.coefficients.data(), columns_};
  multiply(sums.gram, theta, {product_.data(), columns_});
  double square = sums.square;
  for (std::size_t i = 0; i < columns_; ++i) {
    square += theta[i] * (product_[i] - 2.0 * sums.moments[i]);
  }
  at.residual_square = std::max(0.0, square);
  double doubt = 0.0;
  for (std::size_t i = 0; i < parameters_; ++i) {
    const double one = at.moved[i] - belief.mean[i];
    for (std::size_t j = 0; j < parameters_; ++j) {
      doubt += one * element(belief.precision, i, j) * (at.moved[j] - belief.mean[j]);
    }
  }
  return square / noise_variance + doubt;
}

bool ModalSolver::solve(const ModalSums& sums, std::span<const ModePole> poles,
                        const PoleBelief& belief, double noise_variance,
                        ModalSolution& solution) noexcept {
  parameters_ = 0;
  for (const ModePole& pole : poles) parameters_ += pole.size();
  columns_ = modal_columns(parameters_);
  noise_variance_ = noise_variance;
  if (!(sums.count > static_cast<double>(tone_columns + parameters_)) || !(noise_variance > 0.0)) {
    return false;
  }
  find_visible(sums, poles, noise_variance);
  solution = {};
  solution.samples = sums.count;
  coefficients_of(poles, solution);
  double now = cost(sums, belief, noise_variance, solution);
  for (int step = 0; step < most_steps; ++step) {
    lay_out(poles, solution);
    gather(sums, belief, noise_variance);
    for (std::size_t i = 0; i < columns_; ++i) {
      double slope = 0.0;
      const Direction& direction = directions_[i];
      for (std::size_t k = 0; k < direction.count; ++k) {
        const std::size_t row = direction.row[k];
        slope += direction.value[k] * (sums.moments[row] - product_[row]);
      }
      step_[i] = slope / noise_variance;
    }
    const std::size_t first = tone_columns + parameters_;
    for (std::size_t i = 0; i < parameters_; ++i) {
      for (std::size_t j = 0; j < parameters_; ++j) {
        step_[first + i] -= element(belief.precision, i, j) * (solution.moved[j] - belief.mean[j]);
      }
    }
    if (!solver_.factor(hessian_, columns_)) return false;
    solver_.solve({step_.data(), columns_});
    // Halved until it helps: the products of amplitude and distance may carry it too far.
    const ModalSolution from = solution;
    double scale = 1.0;
    double then = now;
    for (int halving = 0; halving <= most_halvings; ++halving, scale *= 0.5) {
      solution.tone = from.tone + scale * std::complex<double>{step_[1], step_[0]};
      solution.mean = from.mean + scale * step_[2];
      for (std::size_t i = 0; i < parameters_; ++i) {
        solution.amplitudes[i] = from.amplitudes[i] + scale * step_[tone_columns + i];
        solution.moved[i] = from.moved[i] + scale * step_[first + i];
      }
      coefficients_of(poles, solution);
      then = cost(sums, belief, noise_variance, solution);
      if (then <= now) break;
    }
    const double gained = now - then;
    if (!std::isfinite(then)) return false;
    now = std::min(now, then);
    if (gained < negligible_change && step > 0) break;
  }
  lay_out(poles, solution);
  gather(sums, belief, noise_variance);
  if (!solver_.factor(hessian_, columns_)) return false;
  solution.unknowns = static_cast<double>(tone_columns);
  for (std::size_t i = 0; i < poles.size(); ++i) {
    if (visible_[i]) solution.unknowns += static_cast<double>(poles[i].size());
  }
  unit(1);
  solution.covariance.re_re = step_[1] / noise_variance;
  solution.covariance.re_im = step_[0] / noise_variance;
  unit(0);
  solution.covariance.im_im = step_[0] / noise_variance;
  return std::isfinite(solution.covariance.re_re + solution.covariance.im_im);
}

// step_ := H⁻¹ e
void ModalSolver::unit(std::size_t index) noexcept {
  std::fill_n(step_.begin(), columns_, 0.0);
  step_[index] = 1.0;
  solver_.solve({step_.data(), columns_});
}

void ModalSolver::pole_covariance(std::span<double> covariance) noexcept {
  const std::size_t first = tone_columns + parameters_;
  for (std::size_t i = 0; i < parameters_; ++i) {
    unit(first + i);
    for (std::size_t j = 0; j <= i; ++j) covariance[triangle(i) + j] = step_[first + j];
  }
}

double ModalSolver::explained(std::span<const double> moment) noexcept {
  std::array<double, max_modal_columns> along{};
  for (std::size_t i = 0; i < columns_; ++i) {
    const Direction& direction = directions_[i];
    for (std::size_t k = 0; k < direction.count; ++k) {
      along[i] += direction.value[k] * moment[direction.row[k]];
    }
  }
  std::copy_n(along.begin(), columns_, step_.begin());
  solver_.solve({step_.data(), columns_});
  double sum = 0.0;
  for (std::size_t i = 0; i < columns_; ++i) sum += along[i] * step_[i];
  return sum / noise_variance_;
}

void ModalSolver::tone_gain(std::span<double> by_sine, std::span<double> by_cosine) noexcept {
  const auto spread = [&](std::size_t index, std::span<double> gain) {
    unit(index);
    std::fill_n(gain.begin(), columns_, 0.0);
    for (std::size_t i = 0; i < columns_; ++i) {
      const Direction& direction = directions_[i];
      for (std::size_t k = 0; k < direction.count; ++k) {
        gain[direction.row[k]] += direction.value[k] * step_[i] / noise_variance_;
      }
    }
  };
  spread(1, by_sine);
  spread(0, by_cosine);
}

}  // namespace sinerig
