// Real polynomials in s, orthonormal on the weighted frequencies of a measurement. Least squares in
// this basis is well conditioned at any order and over any number of decades, where powers of s
// are not (Forsythe 1957; Bultheel and Van Barel's vector orthogonal polynomials).
#pragma once

#include <complex>
#include <vector>

#include <Eigen/Core>

namespace sinerig::identify {

// P_0 … P_degree with real coefficients, deg P_k = k and Σ w_i² Re(conj P_k P_l)(jx_i) = δ_kl.
// P_k(jx) is real for even k and imaginary for odd k, so only its real factor is stored.
class OrthonormalBasis {
 public:
  // x: distinct scaled frequencies above zero, at least degree/2 + 1 of them; weight: positive.
  OrthonormalBasis(const Eigen::ArrayXd& x, const Eigen::ArrayXd& weight, int degree);

  int degree() const { return static_cast<int>(factor_.cols()) - 1; }

  // Column k: P_k(jx_i) for even k, P_k(jx_i)/j for odd k; not weighted.
  const Eigen::MatrixXd& factor() const { return factor_; }

  // Σ coefficients_k P_k at the grid.
  Eigen::ArrayXcd on_grid(const Eigen::VectorXd& coefficients) const;

  struct Value {
    std::complex<double> value;
    std::complex<double> derivative;
  };
  // Σ coefficients_k P_k and its derivative at any scaled s.
  Value at(const Eigen::VectorXd& coefficients, std::complex<double> s) const;

  // All P_k at any scaled s.
  Eigen::VectorXcd all_at(std::complex<double> s) const;

  // Their derivatives there.
  Eigen::VectorXcd all_slopes_at(std::complex<double> s) const;

  // Row k: the coefficients of P_k in ascending powers of scaled s.
  Eigen::MatrixXd power_coefficients() const;

  // Natural logarithm of the leading coefficient of P_k, which is positive.
  double log_leading(int k) const { return log_leading_[k]; }

  // The last coefficient, lifted to 1e-15 of the largest: below that it is rounding and would put a
  // root beyond the range of doubles.
  static double significant_leading(const Eigen::VectorXd& coefficients);

  // Roots of Σ coefficients_k P_k in scaled s: eigenvalues of the comrade matrix, each polished by
  // Newton steps in the basis. Uses significant_leading.
  std::vector<std::complex<double>> roots(const Eigen::VectorXd& coefficients) const;

 private:
  Eigen::MatrixXd factor_;
  Eigen::MatrixXd hessenberg_;  // (degree+1) × degree: s·P_k = Σ_l hessenberg(l, k) P_l
  double first_ = 1.0;          // P_0
  Eigen::VectorXd log_leading_;
};

}  // namespace sinerig::identify
