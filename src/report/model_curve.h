// The response of a stored model as the loop would have measured it.
#pragma once

#include <complex>
#include <vector>

#include "record/more_columns.h"

namespace sinerig::report {

// G(jω) with its delay, behind the zero-order hold where the fit says that one was in front of it:
// (1 − exp(−jωT))/(jωT). The images of the hold are left out: below a fifth of the rate they are
// smaller than the line is wide for any plant that falls.
std::complex<double> model_at(const record::StoredFit& fit, double frequency_hz);

// `count` frequencies in equal ratios over the range, ends included; one where both are equal.
std::vector<double> log_grid(double from_hz, double to_hz, std::size_t count);

}  // namespace sinerig::report
