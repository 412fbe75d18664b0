// A rational transfer function with delay: the model that identification ends in.
#pragma once

#include <complex>
#include <vector>

namespace sinerig::identify {

// G(s) = gain · ∏(s − zero) / ∏(s − pole) · exp(−s·delay_s). Roots in rad/s, complex ones in
// conjugate pairs. The form to compute with: products of roots keep their relative accuracy where
// coefficients of order 26 over four decades have lost it.
struct ZerosPolesGain {
  std::vector<std::complex<double>> zeros;
  std::vector<std::complex<double>> poles;
  double gain = 1.0;
  double delay_s = 0.0;

  // G(jω).
  std::complex<double> at(double omega_rad_s) const;
  // G(s) anywhere in the plane.
  std::complex<double> at(std::complex<double> s) const;
};

// G(s) = num(s) / den(s) · exp(−s·delay_s). Coefficients in descending powers of s.
struct TransferFunction {
  std::vector<double> num;
  std::vector<double> den;
  double delay_s = 0.0;

  // G(jω).
  std::complex<double> at(double omega_rad_s) const;
  // G(s) anywhere in the plane.
  std::complex<double> at(std::complex<double> s) const;

  // Roots of den and num in rad/s, those at the origin exact, sorted by magnitude.
  // Throws std::invalid_argument when the polynomial is empty or all zero.
  std::vector<std::complex<double>> poles() const;
  std::vector<std::complex<double>> zeros() const;
};

// The same function in the other form; the coefficients come back with a monic denominator.
TransferFunction to_transfer_function(const ZerosPolesGain& zpk);
ZerosPolesGain to_zeros_poles_gain(const TransferFunction& model);

// Real coefficients, descending, monic, of ∏(s − root); roots in conjugate pairs.
std::vector<double> polynomial_from_roots(const std::vector<std::complex<double>>& roots);

// Roots of a real polynomial in descending powers: leading zeros are dropped, trailing ones give
// exact roots at the origin, the rest are eigenvalues of the frequency-scaled companion matrix,
// polished by Newton steps.
// Throws std::invalid_argument when it is empty, all zero or not finite.
std::vector<std::complex<double>> roots_of(const std::vector<double>& coefficients);

}  // namespace sinerig::identify
