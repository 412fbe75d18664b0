// Covariance of the fitted parameters, carried over to the response, roots and coefficients.
#pragma once

#include <complex>

#include <Eigen/Core>

#include "identify/fit.h"
#include "identify/orthonormal_basis.h"
#include "identify/root_covariance.h"

namespace sinerig::identify {

// G(s) = fixed(s) · N(s/scale)/D(s/scale) · exp(−s·delay_s), N = Σ n_k P_k, D = Σ d_k Q_k.
class ParameterCovariance {
 public:
  // factor·factorᵀ: the covariance of n, d and delay·scale, in that order. Parameters that hardly
  // show in the response have variances so far above its own that, formed from the product, that
  // would be rounding, below zero as often as not; formed from the factor it is not.
  ParameterCovariance(OrthonormalBasis N_basis, OrthonormalBasis D_basis, Eigen::VectorXd n,
                      Eigen::VectorXd d, double scale, double delay_s, ZerosPolesGain fixed,
                      Eigen::MatrixXd factor);

  const ZerosPolesGain& zpk() const { return zpk_; }

  // First-order propagation: dG = S δ at s = jω.
  ResponsePoint response(double omega_rad_s) const;
  // lim s^origin·G(s); zero with infinite error where a fitted root lies exactly at the origin.
  Estimate static_gain() const;
  Estimate delay() const;
  // Of a fitted pole (zero): dp = −δD(p)/D'(p). Roots of the fixed part have no error.
  RootEstimate pole(std::complex<double> pole) const;
  RootEstimate zero(std::complex<double> zero) const;
  Mode mode(std::complex<double> pole) const;
  RootCovariance of_roots() const;
  // Of num, den and delay_s of to_transfer_function(zpk()).
  Eigen::MatrixXd of_coefficients() const;

 private:
  using Row = Eigen::RowVectorXcd;
  Row no_sensitivity() const { return Row::Zero(factor_.rows()); }
  Row response_sensitivity(std::complex<double> s) const;
  Row pole_sensitivity(std::complex<double> pole) const;
  Row zero_sensitivity(std::complex<double> zero) const;
  RootEstimate with_covariance(std::complex<double> value, const Row& sensitivity) const;
  std::complex<double> residue_along_D(std::complex<double> scaled_pole) const;
  bool is_fixed_pole(std::complex<double> pole) const;

  OrthonormalBasis N_basis_;
  OrthonormalBasis D_basis_;
  Eigen::VectorXd n_;
  Eigen::VectorXd d_;
  double scale_;
  double delay_s_;
  ZerosPolesGain fixed_;
  Eigen::MatrixXd factor_;
  ZerosPolesGain zpk_;
};

}  // namespace sinerig::identify
