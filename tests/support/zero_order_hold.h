// The closed form that measured responses are held against: the response, from input samples to
// output samples, of a continuous plant behind a zero-order hold.
#pragma once

#include <complex>
#include <cstddef>
#include <vector>

namespace sinerig::test {

using Complex = std::complex<long double>;

// A plant by its partial fractions: G(s) = direct + Σ residue / (s − pole) with simple poles,
// delayed.
struct PartialFractions {
  std::vector<Complex> poles;
  std::vector<Complex> residues;
  long double direct = 0.0L;
  long double delay_s = 0.0L;
};

// gain · Π(s − z) / Π(s − p); every root is listed, conjugates too; simple poles.
PartialFractions partial_fractions(const std::vector<Complex>& zeros,
                                   const std::vector<Complex>& poles, long double gain);

// num(s) / den(s) in descending powers with known simple poles (roots of den).
PartialFractions partial_fractions(const std::vector<long double>& num,
                                   const std::vector<long double>& den,
                                   const std::vector<Complex>& poles);

// H(e^{jωT}) for output samples taken `sample_age_s` (0 <= age < T) before each tick, referred to
// the tick (multiply by e^{jω·age} for the true sampling time). Sum over the partial fractions of
// the exact sampled step responses; long double.
Complex held_response(const PartialFractions& plant, long double omega_rad_s, long double period_s,
                      long double sample_age_s = 0.0L);

// Roots of a polynomial with simple roots (descending powers), by Durand-Kerner and Newton.
std::vector<Complex> roots(const std::vector<long double>& polynomial);

}  // namespace sinerig::test
