// `sinerig night`: the sweeps of a job file one after the other, whatever interrupts them.
#pragma once

#include <string>
#include <vector>

#include "cli/commands.h"
#include "cli/night_job.h"
#include "cli/wall_time.h"

namespace sinerig::cli {

// Runs what is left of the night and returns the exit code. What is left is read from the sweep
// files in its folder: none yet, unfinished or done; a night that was killed at any instant goes on
// when it is called again. `time` may be one that passes at once.
int run_night(const NightOptions& options, const std::vector<DriverKit>& drivers, WallTime& time);

}  // namespace sinerig::cli
