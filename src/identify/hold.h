// The exact response of a continuous plant behind the zero-order hold of a fixed-rate loop.
#pragma once

#include <complex>
#include <vector>

#include <Eigen/Core>

#include "identify/transfer_function.h"

namespace sinerig::identify {

// Y/U on the grid of ticks, u constant over a period, y read in the tick that writes u: the step
// response of G sampled at the ticks, divided by that of an integrator. Evaluated pole by pole from
// the partial fractions of G(s)/s, any delay and up to three poles at the origin included.
// omega_rad_s must be below π/period. Throws std::invalid_argument for a period that is not
// positive, more zeros than poles, or more than three poles at the origin.
Eigen::ArrayXcd held_response(const ZerosPolesGain& plant, double period_s,
                              const Eigen::ArrayXd& omega_rad_s);

// The hold alone, (1 − exp(−jωT))/(jωT): what held_response(G)/G tends to far below 1/T. Dividing
// it out leaves the images Σ G(jω_i)ω/(G(jω)ω_i), ω_i = ω + 2πi/T: up to a tenth of the rate at
// most 3.4 % of G where G falls as 1/ω, 0.34 % as 1/ω², 0.04 % as 1/ω³ (hold_test.cpp measures
// them); a resonance above the band raises them by its own height.
std::complex<double> hold_factor(double omega_rad_s, double period_s);

}  // namespace sinerig::identify
