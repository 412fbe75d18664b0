#include "identify/transfer_function.h"

namespace sinerig::identify {

namespace {

std::complex<double> horner(const std::vector<double>& coefficients, std::complex<double> s) {
  std::complex<double> value = 0.0;
  for (const double coefficient : coefficients) value = value * s + coefficient;
  return value;
}

}  // namespace

std::complex<double> TransferFunction::at(double omega_rad_s) const {
  const std::complex<double> s{0.0, omega_rad_s};
  return horner(num, s) / horner(den, s) * std::polar(1.0, -omega_rad_s * delay_s);
}

}  // namespace sinerig::identify
