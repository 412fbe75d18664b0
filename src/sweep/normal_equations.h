// Least squares by running normal equations: what a dwell accumulates each tick, and what any
// window of it is solved from. Fixed sizes after construction, no allocation in use.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "sweep/nonblocking.h"

namespace sinerig {

// Elements of a symmetric matrix of order n, by rows of its lower triangle.
constexpr std::size_t triangle(std::size_t n) {
  return n * (n + 1) / 2;
}

// Σ x xᵀ, Σ x y, Σ y², count of one signal over a window. x has `order` regressors.
struct NormalSums {
  std::vector<double> gram;     // triangle(order)
  std::vector<double> moments;  // order
  double square = 0.0;
  double count = 0.0;

  explicit NormalSums(std::size_t max_order) : gram(triangle(max_order)), moments(max_order) {}
};

// Cholesky solution of one window.
class NormalSolver {
 public:
  explicit NormalSolver(std::size_t max_order);

  // Factors the Gram matrix, columns scaled. A regressor that was zero throughout is absent: its
  // coefficient is zero. So is one that those before it determine (a pivot below 1e-11 of its
  // diagonal), from row `needed` on; false where it is one of the rows before.
  bool factor(std::span<const double> gram, std::size_t order,
              std::size_t needed) noexcept SINERIG_NONBLOCKING;
  bool factor(std::span<const double> gram, std::size_t order) noexcept SINERIG_NONBLOCKING {
    return factor(gram, order, order);
  }

  // x := G⁻¹ x with the last factor.
  void solve(std::span<double> x) const noexcept SINERIG_NONBLOCKING;

 private:
  std::size_t order_ = 0;
  std::vector<double> factor_;  // lower triangle, unit-free
  std::vector<double> scale_;
};

// y := G x for a stored triangle.
void multiply(std::span<const double> gram, std::span<const double> x,
              std::span<double> y) noexcept SINERIG_NONBLOCKING;

}  // namespace sinerig
