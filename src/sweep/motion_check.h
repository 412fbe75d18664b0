// What a planned dwell would ask of the rig, against what the rig can bear.
#pragma once

#include "sweep/plan.h"

namespace sinerig {

// Each throws PlanRefused with the limit that would be exceeded.
void check_motion(const SweepSettings& sweep, const MotionLimits& limits, const Dwell& dwell,
                  double rate_hz);
void check_baseline(const Baseline& baseline, const MotionLimits& limits, double rate_hz);
// `before` is null for the first dwell; `least` is the least amplitude that levelling may choose
// for either, infinite without it.
void check_ramp(const Dwell& dwell, const Dwell* before, double least, const Baseline& baseline,
                const MotionLimits& limits, double rate_hz);
// The bias motion has a bin of its own: throws where a dwell could not tell it from a tone.
void check_bias(const Dwell& dwell, double bias_hz, double rate_hz);

}  // namespace sinerig
