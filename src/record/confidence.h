// 95 % intervals and scatter of a stored point, whichever way they are known.
#pragma once

#include "record/sweep_reader.h"

namespace sinerig::record {

// Half-widths of the 95 % intervals of a point, NaN where they are not known: those that were
// stored with it, else Student's t on its covariance with its degrees of freedom.
struct HalfWidth95 {
  double gain = 0.0;       // relative to |H|
  double phase_rad = 0.0;  // at most π
};
HalfWidth95 half_width95(const StoredPoint& point);

// The covariance as one circular scatter: the variance of each of re and im that explains both
// half-widths on average, so that it holds what a transient may have left. NaN where not known.
double circular_variance(const StoredPoint& point);

// The ordinary coherence γ² of input and output at the tone, as an analyser would find it with
// records of one cycle: 1 / (1 + 2 n σ²/|H|²), with the variance σ² of each of re and im behind n
// cycles (Bendat and Piersol, Random Data, section 9.2.4, solved for γ²). 0 to 1; NaN where scatter
// or rate are not known.
double coherence(const StoredPoint& point, double rate_hz);

// Half-widths that a gain in dB and a phase in degrees have near |H|.
inline constexpr double db_per_relative = 8.685889638065037;
inline constexpr double degrees_per_radian = 57.29577951308232;

}  // namespace sinerig::record
