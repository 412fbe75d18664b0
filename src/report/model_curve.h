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

// Relative half widths of the 95 % intervals of the model's gain (of the amplitude) and phase
// (rad), one each per frequency; empty where the file holds no covariance of the model.
struct ModelBand {
  std::vector<double> gain;
  std::vector<double> phase_rad;
};
ModelBand model_band(const record::StoredFit& fit, const std::vector<double>& frequency_hz);

// The latest fit of a response by Choe's method, with what led to it; nothing where it has none.
const record::StoredFit* latest_choe(const record::StoredRun& run,
                                     const record::StoredResponse& response);

// The latest fit of a response, nothing where it has none.
const record::StoredFit* latest_fit(const record::StoredRun& run,
                                    const record::StoredResponse& response);

// Frequencies that draw a model from one end of the range to the other: equal ratios, and closer
// around each lightly damped pole and zero, so that no peak is cut off. Rising.
std::vector<double> curve_grid(const record::StoredFit& fit, double from_hz, double to_hz);

}  // namespace sinerig::report
