// One dwell from what is asked of it: exact frequencies in whole samples, amplitudes and phases,
// the lengths of ramp, wait, block and the whole. Nothing is held against the limits here.
#pragma once

#include <string>
#include <vector>

#include "sweep/plan.h"

namespace sinerig {

// A dwell longer than this is a mistake in the rig file, not a measurement: 30 days at 1 kHz.
inline constexpr double max_dwell_samples = 2.6e9;

// The amplitude at a frequency: the constant or the table, held under the velocity and acceleration
// that it is to follow.
double amplitude_at(const SweepSettings& sweep, double frequency_hz);

// `before` is the dwell before it, null for the first: between two amplitudes there is a ramp.
// Throw PlanRefused for what cannot be measured at this rate or takes too long.
Dwell make_single(double asked_hz, const SweepSettings& sweep, double rate_hz, const Dwell* before);
// Several tones in one dwell; they share the peak that the loudest of them would have alone.
Dwell make_group(const std::vector<double>& asked_hz, const SweepSettings& sweep, double rate_hz,
                 const Dwell* before);

}  // namespace sinerig
