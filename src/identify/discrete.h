// Discrete equivalents of a continuous model at any rate.
#pragma once

#include <complex>
#include <vector>

#include "identify/transfer_function.h"

namespace sinerig::identify {

// H(z) = gain · ∏(z − zero)/∏(z − pole) · z^−delay_ticks.
struct DiscreteModel {
  std::vector<std::complex<double>> zeros;
  std::vector<std::complex<double>> poles;
  double gain = 1.0;
  double period_s = 0.0;
  int delay_ticks = 0;

  // H(exp(jωT)).
  std::complex<double> at(double omega_rad_s) const;
  // Descending powers of z without the delay; den monic.
  std::vector<double> num() const;
  std::vector<double> den() const;
};

// All three throw std::invalid_argument when period_s is not positive, the model has more zeros
// than poles, or its delay is negative.
//
// A delay becomes whole ticks and, for Tustin and matched, the fraction d in [0.5, 1.5) of a tick a
// first-order allpass (a z + 1)/(z + a), a = (1 − d)/(1 + d), whose delay is d at low frequency
// (Thiran 1971; Laakso et al., IEEE Signal Processing Magazine 13(1), 1996); below half a tick in
// all, d is all of it.

// s = k (z − 1)/(z + 1), k = ω/tan(ωT/2): exact at prewarp_rad_s, 2/T where that is 0.
// Throws also when prewarp_rad_s is negative or not below π/T.
DiscreteModel tustin(const ZerosPolesGain& model, double period_s, double prewarp_rad_s = 0.0);

// Exact at the ticks behind a zero-order hold, a delay of whole ticks and any fraction included.
// Poles are exp(p·T); zeros are the roots of the numerator that the impulse response gives, so this
// form is for moderate orders; zero_order_hold of state_space.h holds at any.
DiscreteModel hold_equivalent(const ZerosPolesGain& model, double period_s);

// Roots by z = exp(sT); zeros at infinity go to −1, all but one, which becomes a tick of delay in
// the numerator; gain matched at 0, or at 1/1000 of the rate where a root lies at the origin.
// (Franklin, Powell and Workman, section 6.1.)
DiscreteModel matched(const ZerosPolesGain& model, double period_s);

}  // namespace sinerig::identify
