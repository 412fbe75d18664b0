// Sums over the ticks of what the partial fractions of a step response are made of.
#pragma once

#include <complex>

namespace sinerig::identify {

// A delay as whole ticks, and what the last of them is too much: the response is read that part of
// a period after its tick.
struct TickDelay {
  double whole_ticks;
  double fraction;
  TickDelay(double delay_s, double period_s);
};

// Σ_{n≥0} t^q/q! z^−n with t = (n + fraction)·T, for q = 0 … 3.
std::complex<double> sampled_power(int q, double fraction, double period,
                                   std::complex<double> z_inverse);

// Σ_{n≥0} exp(p·t) z^−n and Σ_{n≥0} t·exp(p·t) z^−n, continued to poles that grow: finite for any.
struct SampledExponential {
  std::complex<double> value;
  std::complex<double> slope;  // by the pole
};
SampledExponential sampled_exponential(std::complex<double> pole, double fraction, double period,
                                       std::complex<double> z_inverse);

}  // namespace sinerig::identify
