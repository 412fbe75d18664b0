// From a response and its covariance to the half widths of its 95 % intervals.
#pragma once

#include <complex>

#include "sweep/estimator.h"
#include "sweep/noise_memory.h"
#include "sweep/nonblocking.h"

namespace sinerig {

// Half widths of the 95 % intervals of gain and phase.
struct Interval {
  double gain_db = 0.0;
  double phase_deg = 0.0;
};

// `left`: what a transient may have left in H, relative; `scale` multiplies the variance.
Interval interval_of(std::complex<double> response, const PooledVariance& variance, double left,
                     double scale = 1.0) noexcept SINERIG_NONBLOCKING;

// The smaller of two half widths that are wanted, relative to H; 0 is none, and 1 where both are.
double smaller_target(double gain_db, double phase_deg) noexcept SINERIG_NONBLOCKING;

}  // namespace sinerig
