// What a rig file says of the guard: limits of the command, of the channels, of the loop; and what
// is done about a soft one, a fault, and before the sweep.
#pragma once

#include "config/section.h"
#include "sweep/guard.h"
#include "sweep/preflight.h"
#include "sweep/retry.h"
#include "sweep/sweep_settings.h"

namespace sinerig::config {

// Each throws ConfigError.
MotionLimits read_motion(const Section& limits);
// The channels are read one by one, after.
GuardSettings read_guard(const Section& limits, const MotionLimits& motion, double rate_hz);

// Of one [sensor.NAME]; `comparable`: it has the unit of the command.
ChannelLimits read_channel_limits(const Section& sensor, double rate_hz, bool comparable);

PreflightSettings read_preflight(const Section& sweep);
RetrySettings read_retry(const Section& retry);

}  // namespace sinerig::config
