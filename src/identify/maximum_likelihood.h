// The default fit: maximum likelihood with delay, hold and outliers.
#pragma once

#include "identify/fit.h"
#include "identify/response.h"

namespace sinerig::identify {

// Minimises χ² = Σ e'C⁻¹e, e the difference of model and response in (re, im) and C the covariance
// of the point (relative errors of equal weight where it is unknown), over the coefficients and the
// delay. Linear stage in orthonormal bases from many starts and delays, then Levenberg–Marquardt
// (Pintelon and Schoukens, System Identification, ch. 9, in the form of Kollár's elis).
// Not converging is a result (Fit::converged, Fit::reason), not an exception.
// Throws std::invalid_argument, saying what, where, which rule and what to do, for points that
// check_response refuses; 2·points < free parameters; impossible orders; given poles that are not
// in conjugate pairs; a hold with frequencies at or above half the rate or a model that is not
// proper; numbers that are not finite.
Fit fit_maximum_likelihood(const Response& response, const FitOptions& options);

}  // namespace sinerig::identify
