#include "sim/linear_system.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <utility>

namespace sinerig::sim {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Diagonal similarity by powers of two that evens out rows and columns (Parlett and Reinsch, 1969),
// so that the exponential series converges fast and loses nothing.
void balance(LinearSystem& system) {
  const Index n = system.states();
  bool changed = true;
  while (changed) {
    changed = false;
    for (Index i = 0; i < n; ++i) {
      double column = 0.0;
      double row = 0.0;
      for (Index j = 0; j < n; ++j) {
        if (j == i) continue;
        column += std::abs(system.a(j, i));
        row += std::abs(system.a(i, j));
      }
      if (column == 0.0 || row == 0.0) continue;
      const double factor = std::exp2(std::round(std::log2(row / column) / 2.0));
      if (column * factor + row / factor >= 0.95 * (column + row)) continue;
      system.a.col(i) *= factor;
      system.a.row(i) /= factor;
      system.b(i) /= factor;
      if (system.force.size() > 0) system.force(i) /= factor;
      system.c.col(i) *= factor;
      if (system.velocity.size() > 0) system.velocity(i) *= factor;
      changed = true;
    }
  }
}

std::vector<double> without_leading_zeros(std::vector<double> coefficients) {
  const auto first = std::find_if(coefficients.begin(), coefficients.end(),
                                  [](double value) { return value != 0.0; });
  coefficients.erase(coefficients.begin(), first);
  return coefficients;
}

// The frequency that brings the monic coefficients near one.
double scaling_frequency(const std::vector<double>& monic) {
  double scale = 0.0;
  for (std::size_t i = 1; i < monic.size(); ++i) {
    scale = std::max(scale, std::pow(std::abs(monic[i]), 1.0 / static_cast<double>(i)));
  }
  return scale > 0.0 ? scale : 1.0;
}

LinearSystem series(const LinearSystem& first, const LinearSystem& second) {
  const Index n1 = first.states();
  const Index n2 = second.states();
  LinearSystem chain;
  chain.a = MatrixXd::Zero(n1 + n2, n1 + n2);
  chain.a.topLeftCorner(n1, n1) = first.a;
  chain.a.bottomRightCorner(n2, n2) = second.a;
  chain.a.bottomLeftCorner(n2, n1) = second.b * first.c.row(0);
  chain.b.resize(n1 + n2);
  chain.b << first.b, second.b * first.d(0);
  chain.c.resize(second.c.rows(), n1 + n2);
  chain.c << second.d * first.c.row(0), second.c;
  chain.d = second.d * first.d(0);
  chain.outputs = second.outputs;
  if (second.velocity.size() > 0) {
    chain.velocity = Eigen::RowVectorXd::Zero(n1 + n2);
    chain.velocity.tail(n2) = second.velocity;
    chain.force = VectorXd::Zero(n1 + n2);
    chain.force.tail(n2) = second.force;
  }
  return chain;
}

bool is_real(std::complex<double> root) {
  return root.imag() == 0.0;
}

// Descending coefficients of (s − r1)(s − r2) for a pair of real roots, (s − r)(s − r*) for one
// complex root.
std::vector<double> quadratic(std::complex<double> root) {
  return {1.0, -2.0 * root.real(), std::norm(root)};
}
std::vector<double> quadratic(double first, double second) {
  return {1.0, -(first + second), first * second};
}

// Groups roots into quadratics, complex ones first, and at most one linear factor at the end.
std::vector<std::vector<double>> quadratic_factors(std::vector<std::complex<double>> roots) {
  std::sort(roots.begin(), roots.end(), [](auto a, auto b) { return std::abs(a) < std::abs(b); });
  std::vector<std::vector<double>> factors;
  std::vector<double> reals;
  for (const auto& root : roots) {
    if (is_real(root)) {
      reals.push_back(root.real());
    } else {
      factors.push_back(quadratic(root));
    }
  }
  std::size_t i = 0;
  for (; i + 1 < reals.size(); i += 2) factors.push_back(quadratic(reals[i], reals[i + 1]));
  if (i < reals.size()) factors.push_back({1.0, -reals[i]});
  return factors;
}

std::size_t root_count(const std::vector<std::complex<double>>& roots) {
  std::size_t count = 0;
  for (const auto& root : roots) count += is_real(root) ? 1U : 2U;
  return count;
}

}  // namespace

LinearSystem from_transfer_function(const std::vector<double>& num_in,
                                    const std::vector<double>& den_in) {
  std::vector<double> den = without_leading_zeros(den_in);
  std::vector<double> num = without_leading_zeros(num_in);
  if (den.empty()) throw std::invalid_argument("the denominator must not be zero");
  if (num.size() > den.size()) {
    throw std::invalid_argument("the numerator has a higher order than the denominator");
  }
  num.insert(num.begin(), den.size() - num.size(), 0.0);
  const double lead = den.front();
  for (double& value : num) value /= lead;
  for (double& value : den) value /= lead;

  const double omega = scaling_frequency(den);
  const auto n = static_cast<Index>(den.size()) - 1;
  LinearSystem system;
  system.a = MatrixXd::Zero(n, n);
  system.b = VectorXd::Zero(n);
  system.c = MatrixXd::Zero(1, n);
  system.d = VectorXd::Constant(1, num.front());
  system.outputs = {"y"};
  for (Index i = 0; i < n; ++i) {
    const auto k = static_cast<std::size_t>(i + 1);
    const double unscale = std::pow(omega, -static_cast<double>(k));
    system.a(0, i) = -den[k] * unscale * omega;
    system.c(0, i) = (num[k] - num.front() * den[k]) * unscale;
    if (i > 0) system.a(i, i - 1) = omega;
  }
  if (n > 0) system.b(0) = omega;
  balance(system);
  return system;
}

LinearSystem from_zeros_poles(const std::vector<std::complex<double>>& zeros,
                              const std::vector<std::complex<double>>& poles, double gain) {
  if (root_count(zeros) > root_count(poles)) {
    throw std::invalid_argument("there are more zeros than poles");
  }
  auto pole_factors = quadratic_factors(poles);
  auto zero_factors = quadratic_factors(zeros);
  if (pole_factors.empty()) return from_transfer_function({gain}, {1.0});
  zero_factors.resize(pole_factors.size(), std::vector<double>{1.0});
  // A single zero can stand over any section, a pair only over a pair.
  if (pole_factors.back().size() < zero_factors.back().size()) {
    std::swap(zero_factors.back(), zero_factors.front());
  }
  for (double& coefficient : zero_factors.front()) coefficient *= gain;

  LinearSystem chain = from_transfer_function(zero_factors.front(), pole_factors.front());
  for (std::size_t i = 1; i < pole_factors.size(); ++i) {
    chain = series(chain, from_transfer_function(zero_factors[i], pole_factors[i]));
  }
  balance(chain);
  return chain;
}

LinearSystem from_state_space(MatrixXd a, VectorXd b, MatrixXd c, VectorXd d,
                              std::vector<std::string> outputs) {
  if (a.rows() != a.cols() || b.size() != a.rows() || c.cols() != a.rows() ||
      d.size() != c.rows() || outputs.size() != static_cast<std::size_t>(c.rows())) {
    throw std::invalid_argument(
        "the matrices do not fit: A is n×n, B n, C outputs×n, D one number per output, and every "
        "output has a name");
  }
  LinearSystem system;
  system.a = std::move(a);
  system.b = std::move(b);
  system.c = std::move(c);
  system.d = std::move(d);
  system.outputs = std::move(outputs);
  balance(system);
  return system;
}

LinearSystem from_mechanical_axis(const MechanicalAxis& axis) {
  if (!(axis.inertia > 0.0)) throw std::invalid_argument("the inertia must be above 0");
  const auto n = static_cast<Index>(2 + 2 * axis.modes.size());
  LinearSystem system;
  system.a = MatrixXd::Zero(n, n);
  system.b = VectorXd::Zero(n);
  system.force = VectorXd::Zero(n);
  system.c = MatrixXd::Zero(2, n);
  system.d = VectorXd::Zero(2);
  system.outputs = {"position", "velocity"};

  system.a(0, 1) = 1.0;
  system.a(1, 0) = -axis.stiffness / axis.inertia;
  system.a(1, 1) = -axis.damping / axis.inertia;
  system.b(1) = axis.gain / axis.inertia;
  system.force(1) = 1.0 / axis.inertia;
  system.c(0, 0) = 1.0;
  system.c(1, 1) = 1.0;
  Index row = 2;
  for (const FlexibleMode& mode : axis.modes) {
    const double omega = 2.0 * std::numbers::pi * mode.frequency_hz;
    system.a(row, row + 1) = omega;
    system.a(row + 1, row) = -omega;
    system.a(row + 1, row + 1) = -2.0 * mode.damping * omega;
    system.b(row + 1) = axis.gain * mode.residue / omega;
    system.force(row + 1) = mode.residue / omega;
    system.c(0, row) = 1.0;
    system.c(1, row + 1) = omega;
    row += 2;
  }
  system.velocity = system.c.row(1);
  if (axis.lag_hz > 0.0) {
    const double corner = 2.0 * std::numbers::pi * axis.lag_hz;
    system = series(from_transfer_function({corner}, {1.0, corner}), system);
  }
  balance(system);
  return system;
}

}  // namespace sinerig::sim
