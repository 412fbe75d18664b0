#include "sweep/normal_equations.h"

#include <algorithm>
#include <cmath>

namespace sinerig {

namespace {

// Below this part of its diagonal a pivot is rounding, not information.
constexpr double smallest_pivot = 1e-11;

}  // namespace

NormalSolver::NormalSolver(std::size_t max_order)
    : factor_(triangle(max_order)), scale_(max_order) {}

bool NormalSolver::factor(std::span<const double> gram, std::size_t order,
                          std::size_t needed) noexcept {
  order_ = order;
  for (std::size_t i = 0; i < order; ++i) {
    const double diagonal = gram[triangle(i) + i];
    if (!(diagonal >= 0.0)) return false;
    scale_[i] = diagonal > 0.0 ? 1.0 / std::sqrt(diagonal) : 0.0;
  }
  for (std::size_t i = 0; i < order; ++i) {
    double* row_i = &factor_[triangle(i)];
    for (std::size_t j = 0; j <= i; ++j) {
      const double* row_j = &factor_[triangle(j)];
      double sum = gram[triangle(i) + j] * scale_[i] * scale_[j];
      for (std::size_t k = 0; k < j; ++k) sum -= row_i[k] * row_j[k];
      if (i == j) {
        const bool determined = scale_[i] != 0.0 && !(sum > smallest_pivot);
        if (determined && i < needed) return false;
        if (determined) {
          scale_[i] = 0.0;
          std::fill_n(row_i, i, 0.0);
        }
        row_i[i] = scale_[i] == 0.0 ? 1.0 : std::sqrt(sum);
      } else {
        row_i[j] = sum / row_j[j];
      }
    }
  }
  return true;
}

void NormalSolver::solve(std::span<double> x) const noexcept {
  for (std::size_t i = 0; i < order_; ++i) {
    const double* row = &factor_[triangle(i)];
    double sum = x[i] * scale_[i];
    for (std::size_t k = 0; k < i; ++k) sum -= row[k] * x[k];
    x[i] = sum / row[i];
  }
  for (std::size_t i = order_; i-- > 0;) {
    double sum = x[i];
    for (std::size_t k = i + 1; k < order_; ++k) sum -= factor_[triangle(k) + i] * x[k];
    x[i] = sum / factor_[triangle(i) + i];
  }
  for (std::size_t i = 0; i < order_; ++i) x[i] *= scale_[i];
}

void multiply(std::span<const double> gram, std::span<const double> x,
              std::span<double> y) noexcept {
  const std::size_t order = x.size();
  for (std::size_t i = 0; i < order; ++i) y[i] = 0.0;
  for (std::size_t i = 0; i < order; ++i) {
    const double* row = &gram[triangle(i)];
    for (std::size_t j = 0; j < i; ++j) {
      y[i] += row[j] * x[j];
      y[j] += row[j] * x[i];
    }
    y[i] += row[i] * x[i];
  }
}

}  // namespace sinerig
