#include "identify/orthonormal_basis.h"

#include <cmath>
#include <limits>

#include <Eigen/Eigenvalues>

#include "identify/polynomial.h"

namespace sinerig::identify {

using Complex = std::complex<double>;
using Eigen::Index;

OrthonormalBasis::OrthonormalBasis(const Eigen::ArrayXd& x, const Eigen::ArrayXd& weight,
                                   int degree)
    : factor_(x.size(), degree + 1),
      hessenberg_(Eigen::MatrixXd::Zero(degree + 1, degree)),
      log_leading_(degree + 1) {
  Eigen::MatrixXd weighted(x.size(), degree + 1);
  first_ = 1.0 / weight.matrix().norm();
  weighted.col(0) = weight.matrix() * first_;
  log_leading_[0] = std::log(first_);
  for (Index k = 0; k < degree; ++k) {
    const double turn = k % 2 == 0 ? 1.0 : -1.0;
    auto next = weighted.col(k + 1);
    next = turn * (x * weighted.col(k).array()).matrix();
    for (int pass = 0; pass < 2; ++pass) {
      for (Index l = (k + 1) % 2; l <= k; l += 2) {
        const double overlap = weighted.col(l).dot(next);
        hessenberg_(l, k) += overlap;
        next -= overlap * weighted.col(l);
      }
    }
    const double size = std::max(next.norm(), std::numeric_limits<double>::min());
    hessenberg_(k + 1, k) = size;
    next /= size;
    log_leading_[k + 1] = log_leading_[k] - std::log(size);
  }
  factor_ = weighted.array().colwise() / weight;
}

Eigen::ArrayXcd OrthonormalBasis::on_grid(const Eigen::VectorXd& coefficients) const {
  Eigen::ArrayXd even = Eigen::ArrayXd::Zero(factor_.rows());
  Eigen::ArrayXd odd = Eigen::ArrayXd::Zero(factor_.rows());
  for (Index k = 0; k < coefficients.size(); ++k)
    (k % 2 == 0 ? even : odd) += coefficients[k] * factor_.col(k).array();
  Eigen::ArrayXcd values(factor_.rows());
  values.real() = even;
  values.imag() = odd;
  return values;
}

Eigen::VectorXcd OrthonormalBasis::all_at(Complex s) const {
  Eigen::VectorXcd P(degree() + 1);
  P[0] = first_;
  for (Index k = 0; k < degree(); ++k) {
    Complex next = s * P[k];
    for (Index l = (k + 1) % 2; l <= k; l += 2) next -= hessenberg_(l, k) * P[l];
    P[k + 1] = next / hessenberg_(k + 1, k);
  }
  return P;
}

Eigen::VectorXcd OrthonormalBasis::all_slopes_at(Complex s) const {
  const Eigen::VectorXcd P = all_at(s);
  Eigen::VectorXcd slope(degree() + 1);
  slope[0] = 0.0;
  for (Index k = 0; k < degree(); ++k) {
    Complex next = P[k] + s * slope[k];
    for (Index l = (k + 1) % 2; l <= k; l += 2) next -= hessenberg_(l, k) * slope[l];
    slope[k + 1] = next / hessenberg_(k + 1, k);
  }
  return slope;
}

OrthonormalBasis::Value OrthonormalBasis::at(const Eigen::VectorXd& coefficients, Complex s) const {
  const Index terms = coefficients.size();
  Eigen::VectorXcd P(terms);
  Eigen::VectorXcd slope(terms);
  P[0] = first_;
  slope[0] = 0.0;
  Value sum{coefficients[0] * P[0], 0.0};
  for (Index k = 0; k + 1 < terms; ++k) {
    Complex next = s * P[k];
    Complex next_slope = P[k] + s * slope[k];
    for (Index l = (k + 1) % 2; l <= k; l += 2) {
      next -= hessenberg_(l, k) * P[l];
      next_slope -= hessenberg_(l, k) * slope[l];
    }
    P[k + 1] = next / hessenberg_(k + 1, k);
    slope[k + 1] = next_slope / hessenberg_(k + 1, k);
    sum.value += coefficients[k + 1] * P[k + 1];
    sum.derivative += coefficients[k + 1] * slope[k + 1];
  }
  return sum;
}

Eigen::MatrixXd OrthonormalBasis::power_coefficients() const {
  const Index terms = degree() + 1;
  Eigen::MatrixXd powers = Eigen::MatrixXd::Zero(terms, terms);
  powers(0, 0) = first_;
  for (Index k = 0; k + 1 < terms; ++k) {
    powers.row(k + 1).tail(terms - 1) = powers.row(k).head(terms - 1);
    for (Index l = (k + 1) % 2; l <= k; l += 2)
      powers.row(k + 1) -= hessenberg_(l, k) * powers.row(l);
    powers.row(k + 1) /= hessenberg_(k + 1, k);
  }
  return powers;
}

double OrthonormalBasis::significant_leading(const Eigen::VectorXd& coefficients) {
  const double leading = coefficients[coefficients.size() - 1];
  const double smallest = coefficients.cwiseAbs().maxCoeff() * 1e-15;
  return std::copysign(std::max(std::abs(leading), smallest), leading);
}

std::vector<Complex> OrthonormalBasis::roots(const Eigen::VectorXd& coefficients) const {
  const Index n = coefficients.size() - 1;
  std::vector<Complex> found;
  if (n < 1) return found;
  const double leading = significant_leading(coefficients);
  Eigen::MatrixXd comrade = hessenberg_.topLeftCorner(n, n);
  comrade.col(n - 1) -= coefficients.head(n) * (hessenberg_(n, n - 1) / leading);
  if (!comrade.allFinite())
    return std::vector<Complex>(static_cast<std::size_t>(n), Complex{1e300});
  const Eigen::VectorXcd eigenvalues = comrade.eigenvalues();
  Eigen::VectorXd c = coefficients;
  c[n] = leading;
  for (Complex root : eigenvalues) {
    Value here = at(c, root);
    for (int step = 0; step < 5 && here.value != 0.0; ++step) {
      const Complex next = root - here.value / here.derivative;
      const Value there = at(c, next);
      if (!(std::abs(there.value) < std::abs(here.value))) break;
      root = next;
      here = there;
    }
    found.push_back(root);
  }
  tidy_conjugate_pairs(found);
  return found;
}

}  // namespace sinerig::identify
