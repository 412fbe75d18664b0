#include "identify/parameter_covariance.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "identify/hold_model.h"
#include "identify/polynomial.h"

namespace sinerig::identify {

namespace {

using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Rows: coefficients of s^degree … s^0 of Σ c_k P_k(s/scale) as linear functions of c.
MatrixXd descending_powers(const OrthonormalBasis& basis, double scale) {
  MatrixXd map = basis.power_coefficients().transpose().colwise().reverse();
  for (Index i = 0; i < map.rows(); ++i)
    map.row(i) *= std::pow(scale, -static_cast<double>(map.rows() - 1 - i));
  return map;
}

// Multiplication by a polynomial as a matrix on coefficient columns.
MatrixXd multiplied(const MatrixXd& rows, const std::vector<double>& factor) {
  MatrixXd product =
      MatrixXd::Zero(rows.rows() + static_cast<Index>(factor.size()) - 1, rows.cols());
  for (std::size_t i = 0; i < factor.size(); ++i)
    product.middleRows(static_cast<Index>(i), rows.rows()) += factor[i] * rows;
  return product;
}

}  // namespace

ParameterCovariance::ParameterCovariance(OrthonormalBasis N_basis, OrthonormalBasis D_basis,
                                         VectorXd n, VectorXd d, double scale, double delay_s,
                                         ZerosPolesGain fixed, MatrixXd factor)
    : N_basis_(std::move(N_basis)),
      D_basis_(std::move(D_basis)),
      n_(std::move(n)),
      d_(std::move(d)),
      scale_(scale),
      delay_s_(delay_s),
      fixed_(std::move(fixed)),
      factor_(std::move(factor)),
      zpk_(compose(N_basis_, n_, D_basis_, d_, scale_, delay_s_, fixed_)) {}

ParameterCovariance::Row ParameterCovariance::response_sensitivity(Complex s) const {
  const Complex scaled = s / scale_;
  const Complex G = zpk_.at(s);
  Row row = no_sensitivity();
  row.head(n_.size()) = N_basis_.all_at(scaled).transpose() * (G / N_basis_.at(n_, scaled).value);
  row.segment(n_.size(), d_.size()) =
      D_basis_.all_at(scaled).transpose() * (-G / D_basis_.at(d_, scaled).value);
  row[row.size() - 1] = -scaled * G;
  return row;
}

RootEstimate ParameterCovariance::with_covariance(Complex value, const Row& sensitivity) const {
  const Eigen::RowVectorXd re = sensitivity.real() * factor_;
  const Eigen::RowVectorXd im = sensitivity.imag() * factor_;
  return {value, re.squaredNorm(), re.dot(im), im.squaredNorm()};
}

ResponsePoint ParameterCovariance::response(double omega_rad_s) const {
  const Complex s{0.0, omega_rad_s};
  const RootEstimate G = with_covariance(zpk_.at(s), response_sensitivity(s));
  return {omega_rad_s, G.root, G.variance_re, G.covariance, G.variance_im};
}

Estimate ParameterCovariance::delay() const {
  return {zpk_.delay_s, factor_.row(factor_.rows() - 1).norm() / scale_};
}

Estimate ParameterCovariance::static_gain() const {
  const double N_0 = N_basis_.at(n_, 0.0).value.real();
  const double D_0 = D_basis_.at(d_, 0.0).value.real();
  double gain = fixed_.gain * N_0 / D_0;
  for (const Complex pole : fixed_.poles)
    if (pole != 0.0)
      gain /= std::abs(pole) * (pole.imag() == 0.0 ? std::copysign(1.0, -pole.real()) : 1.0);
  Row row = no_sensitivity();
  row.head(n_.size()) = N_basis_.all_at(0.0).transpose() * (gain / N_0);
  row.segment(n_.size(), d_.size()) = D_basis_.all_at(0.0).transpose() * (-gain / D_0);
  return {gain, std::sqrt(with_covariance(gain, row).variance_re)};
}

bool ParameterCovariance::is_fixed_pole(Complex pole) const {
  return std::find(fixed_.poles.begin(), fixed_.poles.end(), pole) != fixed_.poles.end();
}

ParameterCovariance::Row ParameterCovariance::pole_sensitivity(Complex pole) const {
  Row row = no_sensitivity();
  if (is_fixed_pole(pole)) return row;
  const Complex scaled = pole / scale_;
  row.segment(n_.size(), d_.size()) =
      D_basis_.all_at(scaled).transpose() * (-scale_ / D_basis_.at(d_, scaled).derivative);
  return row;
}

ParameterCovariance::Row ParameterCovariance::zero_sensitivity(Complex zero) const {
  Row row = no_sensitivity();
  if (std::find(fixed_.zeros.begin(), fixed_.zeros.end(), zero) != fixed_.zeros.end()) return row;
  const Complex scaled = zero / scale_;
  row.head(n_.size()) =
      N_basis_.all_at(scaled).transpose() * (-scale_ / N_basis_.at(n_, scaled).derivative);
  return row;
}

RootEstimate ParameterCovariance::pole(Complex pole) const {
  return with_covariance(pole, pole_sensitivity(pole));
}

RootEstimate ParameterCovariance::zero(Complex zero) const {
  return with_covariance(zero, zero_sensitivity(zero));
}

// fixed·N/D' : at a simple fitted pole that is the residue of the rational part.
Complex ParameterCovariance::residue_along_D(Complex scaled_pole) const {
  ZerosPolesGain rational = fixed_;
  rational.delay_s = 0.0;
  return rational.at(scaled_pole * scale_) * N_basis_.at(n_, scaled_pole).value /
         D_basis_.at(d_, scaled_pole).derivative * scale_;
}

Mode ParameterCovariance::mode(Complex pole) const {
  const double omega = std::abs(pole);
  const double sigma = pole.real();
  const double omega_d = pole.imag();
  const double damping = -sigma / omega;
  const double cube = omega * omega * omega;
  const Row of_pole = pole_sensitivity(pole);
  const auto error = [&](double by_re, double by_im) {
    return ((by_re * of_pole.real() + by_im * of_pole.imag()) * factor_).norm();
  };
  constexpr double turn = 2.0 * std::numbers::pi;
  Mode mode{{omega / turn, error(sigma, omega_d) / (omega * turn)},
            {damping, error(-omega_d * omega_d / cube, sigma * omega_d / cube)},
            0.0,
            0.0,
            pole};
  if (is_fixed_pole(pole)) return mode;
  const Complex scaled = pole / scale_;
  const Complex N = N_basis_.at(n_, scaled).value;
  const Complex D_slope = D_basis_.at(d_, scaled).derivative;
  mode.residue = residue_along_D(scaled);
  const Complex width = 1e-6 * scaled;
  const Complex by_pole =
      (residue_along_D(scaled + width) - residue_along_D(scaled - width)) / (2.0 * width) / scale_;
  const Eigen::VectorXcd slope_width =
      (D_basis_.all_at(scaled + width) - D_basis_.all_at(scaled - width)) / (2.0 * width);
  Row row = of_pole * by_pole;
  row.head(n_.size()) += N_basis_.all_at(scaled).transpose() * (mode.residue / N);
  row.segment(n_.size(), d_.size()) -= slope_width.transpose() * (mode.residue / D_slope);
  const RootEstimate residue = with_covariance(mode.residue, row);
  mode.residue_standard_error = std::sqrt(residue.variance_re + residue.variance_im);
  return mode;
}

MatrixXd ParameterCovariance::of_coefficients() const {
  MatrixXd num = MatrixXd::Zero(n_.size(), factor_.rows());
  MatrixXd den = MatrixXd::Zero(d_.size(), factor_.rows());
  num.leftCols(n_.size()) = descending_powers(N_basis_, scale_);
  den.middleCols(n_.size(), d_.size()) = descending_powers(D_basis_, scale_);
  const VectorXd num_value = num.leftCols(n_.size()) * n_;
  const VectorXd den_value = den.middleCols(n_.size(), d_.size()) * d_;
  const Eigen::RowVectorXd leading = den.row(0);
  num = ((num - num_value * (leading / den_value[0])) * (fixed_.gain / den_value[0])).eval();
  den = ((den - den_value * (leading / den_value[0])) / den_value[0]).eval();
  num = multiplied(num, polynomial_from_roots(fixed_.zeros));
  den = multiplied(den, polynomial_from_roots(fixed_.poles));
  MatrixXd map = MatrixXd::Zero(num.rows() + den.rows() + 1, factor_.rows());
  map << num, den, Eigen::RowVectorXd::Unit(factor_.rows(), factor_.rows() - 1) / scale_;
  const MatrixXd reached = map * factor_;
  return reached * reached.transpose();
}

RootCovariance ParameterCovariance::of_roots() const {
  RootCovariance out{scale_, {}};
  MatrixXd map = MatrixXd::Zero(coordinates_of(zpk_), factor_.rows());
  Index at = 0;
  const auto add = [&](Complex root, const Row& row) {
    map.row(at++) = row.real();
    if (root.imag() > 0.0) map.row(at++) = row.imag();
  };
  for (const Complex pole : zpk_.poles)
    if (pole.imag() >= 0.0) add(pole, pole_sensitivity(pole));
  for (const Complex zero : zpk_.zeros)
    if (zero.imag() >= 0.0) add(zero, zero_sensitivity(zero));
  const Complex reference{0.0, scale_};
  map.row(at++) = (response_sensitivity(reference) / zpk_.at(reference)).real();
  map(at, factor_.rows() - 1) = 1.0 / scale_;
  const MatrixXd reached = map * factor_;
  out.covariance = reached * reached.transpose();
  return out;
}

ResponsePoint Fit::response(double omega_rad_s) const {
  return parameters->response(omega_rad_s);
}

}  // namespace sinerig::identify
