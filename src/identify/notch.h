// Notch filters against resonances that are known with an error and drift.
#pragma once

#include <complex>
#include <vector>

#include "identify/biquad.h"
#include "identify/fit.h"

namespace sinerig::identify {

// Where a resonance may lie.
struct UncertainMode {
  double frequency_hz = 0.0;  // middle of the interval
  double low_hz = 0.0;
  double high_hz = 0.0;
  double damping_low = 0.0;
  double damping_high = 0.0;
};

// The hull of the 95 % intervals of one mode in several fits: its error and its drift.
// Throws std::invalid_argument when there is none, or a mode is not damped between 0 and 1.
UncertainMode uncertain_mode(const std::vector<Mode>& of_each_fit);

// N(s) = (s² + 2·zero_damping·ω0·s + ω0²) / (s² + 2·pole_damping·ω0·s + ω0²), ω0 = 2π·frequency_hz.
// With a rate it stands for its discrete equivalent by Tustin, prewarped at ω0.
struct Notch {
  double frequency_hz = 0.0;
  double zero_damping = 0.0;
  double pole_damping = 0.0;
  double rate_hz = 0.0;  // 0: continuous

  std::complex<double> at(double omega_rad_s) const;
  double depth_db() const;  // at the centre: 20 log10(zero_damping/pole_damping), below zero
  // Between the −3 dB frequencies of a deep notch: 2·pole_damping·f, and less of a discrete one.
  double width_hz() const;
  double phase_deg(double frequency) const;  // negative below the centre; frequency in Hz
  // Poles of the filter in rad/s, and its zeros (continuous form).
  ZerosPolesGain zpk() const;
};

// Coefficients at notch.rate_hz. Throws std::invalid_argument without a rate or with a centre at or
// above half of it.
Biquad biquad_of(const Notch& notch);

struct NotchRequest {
  double attenuation_db = 20.0;  // of the peak of the resonance, wherever in its interval it lies
  double crossover_hz = 0.0;     // where phase is to be saved; below the resonance
  double rate_hz = 0.0;          // of the loop that runs the notch; 0: continuous
};

struct NotchDesign {
  Notch notch;
  double worst_attenuation_db = 0.0;  // of the peak over the interval of the mode
  double phase_cost_deg = 0.0;        // at the crossover, above zero: phase lost
};

// The least attenuation of the mode's peak over its interval of frequency and damping, dB.
double worst_attenuation_db(const Notch& notch, const UncertainMode& mode);

// Of all notches that keep the attenuation over the whole interval, the one that costs least phase
// at the crossover. Where the width of the mode itself does not matter that is the one with
// pole_damping = v/a and zero_damping = v·a, a the gain wanted and v = |1 − x²|/(2x) at the edge
// x = f/f0 of the interval: minimise (ζp − ζz) under (v² + ζz²)/(v² + ζp²) = a². That closed form
// starts a search that counts the mode's own width and the exact phase, in discrete time if a rate
// is given.
// Throws std::invalid_argument for an attenuation that is not above zero, a crossover at or above
// the interval, an interval at or above half the rate, or one too wide for the attenuation (pole
// damping above 2).
NotchDesign design_notch(const UncertainMode& mode, const NotchRequest& request);

}  // namespace sinerig::identify
