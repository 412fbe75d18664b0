// [sweep]: frequencies, amplitudes, settling and targets.
#pragma once

#include "config/section.h"
#include "sweep/sweep_settings.h"

namespace sinerig::config {

// All of it but what concerns channels (responses, pre-flight). Throws ConfigError.
SweepSettings read_sweep(const Section& section, double rate_hz);

}  // namespace sinerig::config
