// The response of a stored model as the loop would have measured it.
#pragma once

#include <complex>
#include <vector>

#include "record/sweep_reader.h"

namespace sinerig::report {

// G(jω) with its delay and that of the measuring path, behind the zero-order hold where the fit
// says that one was in front of it: exactly below half the rate where the model allows it, else by
// the factor (1 − exp(−jωT))/(jωT).
std::vector<std::complex<double>> model_response(const record::StoredFit& fit,
                                                 const std::vector<double>& frequency_hz);

// The latest fit of a response, nothing where it has none.
const record::StoredFit* latest_fit(const record::StoredRun& run,
                                    const record::StoredResponse& response);

// `count` frequencies in equal ratios over the range, ends included; one where both are equal.
std::vector<double> log_grid(double from_hz, double to_hz, std::size_t count);

}  // namespace sinerig::report
