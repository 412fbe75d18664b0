// What a planned dwell would ask of the rig, against what the rig can bear.
#pragma once

#include "sweep/plan.h"

namespace sinerig {

// Each throws PlanRefused with the limit that would be exceeded.
void check_motion(const SweepSettings& sweep, const MotionLimits& limits, const Dwell& dwell,
                  double rate_hz);
void check_baseline(const Baseline& baseline, const MotionLimits& limits, double rate_hz);
void check_ramp(const Dwell& dwell, double amplitude_before, const MotionLimits& limits,
                double rate_hz);

}  // namespace sinerig
