#include "support/zero_order_hold.h"

#include <algorithm>
#include <cmath>

namespace sinerig::test {

namespace {

Complex horner(const std::vector<long double>& polynomial, Complex s) {
  Complex value = 0.0L;
  for (const long double coefficient : polynomial) value = value * s + coefficient;
  return value;
}

// (e^{p t} − 1) / p, also near p = 0.
Complex held_integral(Complex pole, long double t) {
  const Complex x = pole * t;
  if (std::abs(x) > 1e-3L) return (std::exp(x) - 1.0L) / pole;
  Complex term = t;
  Complex sum = term;
  for (int k = 2; k < 12; ++k) {
    term *= x / static_cast<long double>(k);
    sum += term;
  }
  return sum;
}

}  // namespace

std::vector<Complex> roots(const std::vector<long double>& polynomial) {
  const std::size_t n = polynomial.size() - 1;
  std::vector<long double> monic = polynomial;
  for (long double& value : monic) value /= polynomial.front();
  long double radius = 0.0L;
  for (std::size_t k = 1; k <= n; ++k) {
    radius = std::max(radius, std::pow(std::abs(monic[k]), 1.0L / static_cast<long double>(k)));
  }
  std::vector<Complex> guess(n);
  for (std::size_t i = 0; i < n; ++i) {
    guess[i] = std::polar(radius, 0.4L + 2.0L * std::acos(-1.0L) * static_cast<long double>(i) /
                                             static_cast<long double>(n));
  }
  for (int iteration = 0; iteration < 2000; ++iteration) {
    for (std::size_t i = 0; i < n; ++i) {
      Complex others = 1.0L;
      for (std::size_t j = 0; j < n; ++j) {
        if (j != i) others *= guess[i] - guess[j];
      }
      guess[i] -= horner(monic, guess[i]) / others;
    }
  }
  return guess;
}

PartialFractions partial_fractions(const std::vector<long double>& num,
                                   const std::vector<long double>& den,
                                   const std::vector<Complex>& poles) {
  PartialFractions plant;
  plant.poles = poles;
  if (num.size() == den.size()) plant.direct = num.front() / den.front();
  for (std::size_t i = 0; i < poles.size(); ++i) {
    Complex others = den.front();
    for (std::size_t j = 0; j < poles.size(); ++j) {
      if (j != i) others *= poles[i] - poles[j];
    }
    plant.residues.push_back(horner(num, poles[i]) / others);
  }
  return plant;
}

PartialFractions partial_fractions(const std::vector<Complex>& zeros,
                                   const std::vector<Complex>& poles, long double gain) {
  PartialFractions plant;
  plant.poles = poles;
  if (zeros.size() == poles.size()) plant.direct = gain;
  for (std::size_t i = 0; i < poles.size(); ++i) {
    Complex residue = gain;
    for (const Complex& zero : zeros) residue *= poles[i] - zero;
    for (std::size_t j = 0; j < poles.size(); ++j) {
      if (j != i) residue /= poles[i] - poles[j];
    }
    plant.residues.push_back(residue);
  }
  return plant;
}

// With the delay, the output at tick n − age sees the input u[n − k] from its edge at k T + delay −
// … on. For one pole, x(t) = ∫ e^{p(t−τ)} u(τ) dτ; at t = nT − lag (lag = age + delay = kT + f, 0
// <= f < T) the running period began at (n − k − 1)T and has lasted T − f (with u[n − k − 1]).
Complex held_response(const PartialFractions& plant, long double omega_rad_s, long double period_s,
                      long double sample_age_s) {
  const Complex z = std::exp(Complex{0.0L, omega_rad_s * period_s});
  const long double lag = plant.delay_s + sample_age_s;
  long double whole = std::floor(lag / period_s + 1e-12L);
  const long double fraction = std::max(0.0L, lag - whole * period_s);
  const long double running = fraction > 0.0L ? period_s - fraction : 0.0L;
  if (fraction > 0.0L) whole += 1.0L;
  // State at the last edge: x[m] = Γ u[m−1] / (z − e^{pT}) · z, carried on by `running` with u[m].
  Complex sum = plant.direct;
  for (std::size_t i = 0; i < plant.poles.size(); ++i) {
    const Complex pole = plant.poles[i];
    const Complex at_edge = held_integral(pole, period_s) / (z - std::exp(pole * period_s));
    sum += plant.residues[i] * (std::exp(pole * running) * at_edge + held_integral(pole, running));
  }
  return sum * std::pow(z, -whole);
}

}  // namespace sinerig::test
