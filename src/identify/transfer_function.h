// A rational transfer function with delay: the model that identification ends in.
#pragma once

#include <complex>
#include <vector>

namespace sinerig::identify {

// G(s) = num(s) / den(s) · exp(−s·delay_s). Coefficients in descending powers of s.
struct TransferFunction {
  std::vector<double> num;
  std::vector<double> den;
  double delay_s = 0.0;

  // G(jω).
  std::complex<double> at(double omega_rad_s) const;
};

}  // namespace sinerig::identify
