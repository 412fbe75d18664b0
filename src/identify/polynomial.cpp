#include "identify/polynomial.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include <Eigen/Eigenvalues>

namespace sinerig::identify {

namespace {

using Complex = std::complex<double>;

// Scaling s by |c_n/c_0|^(1/n) puts the geometric mean of the roots at one.
double root_scale(const std::vector<double>& c) {
  const auto degree = static_cast<double>(c.size() - 1);
  const double log_ratio = std::log(std::abs(c.back())) - std::log(std::abs(c.front()));
  return std::exp(std::clamp(log_ratio / degree, -600.0, 600.0));
}

// Steps are taken only while they shrink the residual, so a multiple root is left as it is.
Complex polish_root(const std::vector<double>& c, Complex root) {
  double residual = std::abs(evaluate_polynomial(c, root));
  for (int step = 0; step < 4 && residual > 0.0; ++step) {
    Complex value = 0.0;
    Complex slope = 0.0;
    for (const double coefficient : c) {
      slope = slope * root + value;
      value = value * root + coefficient;
    }
    const Complex next = root - value / slope;
    const double next_residual = std::abs(evaluate_polynomial(c, next));
    if (!(next_residual < residual)) break;
    root = next;
    residual = next_residual;
  }
  return root;
}

}  // namespace

Complex evaluate_polynomial(const std::vector<double>& coefficients, Complex s) {
  Complex value = 0.0;
  for (const double coefficient : coefficients) value = value * s + coefficient;
  return value;
}

double leading_coefficient(const std::vector<double>& coefficients) {
  for (const double coefficient : coefficients)
    if (coefficient != 0.0) return coefficient;
  throw std::invalid_argument(
      "polynomial: every coefficient is zero or there is none; at least one must differ from zero");
}

std::vector<double> multiply_polynomials(const std::vector<double>& a,
                                         const std::vector<double>& b) {
  if (a.empty() || b.empty()) return {};
  std::vector<double> product(a.size() + b.size() - 1, 0.0);
  for (std::size_t i = 0; i < a.size(); ++i)
    for (std::size_t j = 0; j < b.size(); ++j) product[i + j] += a[i] * b[j];
  return product;
}

std::vector<double> polynomial_from_roots(const std::vector<Complex>& roots) {
  std::vector<Complex> product{1.0};
  for (const Complex root : roots) {
    product.push_back(0.0);
    for (std::size_t i = product.size() - 1; i > 0; --i) product[i] -= root * product[i - 1];
  }
  std::vector<double> coefficients;
  coefficients.reserve(product.size());
  for (const Complex coefficient : product) coefficients.push_back(coefficient.real());
  return coefficients;
}

void tidy_conjugate_pairs(std::vector<Complex>& roots) {
  constexpr double real_tolerance = 1e-14;
  std::vector<Complex> tidy;
  tidy.reserve(roots.size());
  for (const Complex root : roots) {
    if (std::abs(root.imag()) <= real_tolerance * std::abs(root))
      tidy.emplace_back(root.real());
    else if (root.imag() > 0.0)
      tidy.push_back(root);
  }
  std::sort(tidy.begin(), tidy.end(), [](Complex a, Complex b) {
    return std::abs(a) < std::abs(b) || (std::abs(a) == std::abs(b) && a.real() < b.real());
  });
  roots.clear();
  for (const Complex root : tidy) {
    roots.push_back(root);
    if (root.imag() != 0.0) roots.push_back(std::conj(root));
  }
}

std::vector<Complex> roots_of(const std::vector<double>& coefficients) {
  leading_coefficient(coefficients);
  for (const double coefficient : coefficients)
    if (!std::isfinite(coefficient))
      throw std::invalid_argument("polynomial: a coefficient is not finite");
  const auto not_zero = [](double c) {
    return c != 0.0;
  };
  const auto first = std::find_if(coefficients.begin(), coefficients.end(), not_zero);
  const auto last = std::find_if(coefficients.rbegin(), coefficients.rend(), not_zero).base();
  const std::vector<double> c(first, last);
  std::vector<Complex> roots;
  if (c.size() > 1) {
    const double scale = root_scale(c);
    const auto degree = static_cast<Eigen::Index>(c.size()) - 1;
    std::vector<double> scaled(c);
    for (std::size_t i = 0; i < c.size(); ++i) {
      const double exponent = -static_cast<double>(i) * std::log(scale);
      scaled[i] = c[i] / c[0] * std::exp(exponent);
    }
    Eigen::MatrixXd companion = Eigen::MatrixXd::Zero(degree, degree);
    companion.diagonal(-1).setOnes();
    for (Eigen::Index i = 0; i < degree; ++i)
      companion(0, i) = -scaled[static_cast<std::size_t>(i) + 1];
    const Eigen::VectorXcd eigenvalues = companion.eigenvalues();
    for (const Complex eigenvalue : eigenvalues)
      roots.push_back(polish_root(scaled, eigenvalue) * scale);
    tidy_conjugate_pairs(roots);
  }
  const auto at_origin = static_cast<std::size_t>(coefficients.end() - last);
  roots.insert(roots.begin(), at_origin, Complex{});
  return roots;
}

}  // namespace sinerig::identify
