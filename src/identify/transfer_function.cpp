#include "identify/transfer_function.h"

#include <algorithm>

#include "identify/polynomial.h"

namespace sinerig::identify {

namespace {

std::complex<double> delay_factor(std::complex<double> s, double delay_s) {
  return delay_s == 0.0 ? 1.0 : std::exp(-s * delay_s);
}

}  // namespace

std::complex<double> ZerosPolesGain::at(std::complex<double> s) const {
  std::complex<double> value = gain;
  const std::size_t pairs = std::min(zeros.size(), poles.size());
  for (std::size_t i = 0; i < pairs; ++i) value *= (s - zeros[i]) / (s - poles[i]);
  for (std::size_t i = pairs; i < zeros.size(); ++i) value *= s - zeros[i];
  for (std::size_t i = pairs; i < poles.size(); ++i) value /= s - poles[i];
  return value * delay_factor(s, delay_s);
}

std::complex<double> ZerosPolesGain::at(double omega_rad_s) const {
  return at(std::complex<double>{0.0, omega_rad_s});
}

std::complex<double> TransferFunction::at(std::complex<double> s) const {
  return evaluate_polynomial(num, s) / evaluate_polynomial(den, s) * delay_factor(s, delay_s);
}

std::complex<double> TransferFunction::at(double omega_rad_s) const {
  return at(std::complex<double>{0.0, omega_rad_s});
}

std::vector<std::complex<double>> TransferFunction::poles() const {
  return roots_of(den);
}

std::vector<std::complex<double>> TransferFunction::zeros() const {
  return roots_of(num);
}

TransferFunction to_transfer_function(const ZerosPolesGain& zpk) {
  TransferFunction model{polynomial_from_roots(zpk.zeros), polynomial_from_roots(zpk.poles),
                         zpk.delay_s};
  for (double& coefficient : model.num) coefficient *= zpk.gain;
  return model;
}

ZerosPolesGain to_zeros_poles_gain(const TransferFunction& model) {
  return {model.zeros(), model.poles(),
          leading_coefficient(model.num) / leading_coefficient(model.den), model.delay_s};
}

}  // namespace sinerig::identify
