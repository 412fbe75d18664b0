// What a rig file says that every rig has: loop, sweep, limits, channels, output. The drivers read
// their own keys from the same sections.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "config/section.h"
#include "realtime/rights.h"
#include "sweep/guard.h"
#include "sweep/runner.h"
#include "sweep/sweep_settings.h"

namespace sinerig::config {

enum class ClockKind { virtual_time, monotonic };

struct Channel {
  std::string name;
  std::string unit;
  std::string driver;
  bool health = false;  // of a device: watched by the guard, no response
  Section section;
};

struct Rig {
  std::unique_ptr<RigFile> file;

  double rate_hz = 0.0;
  ClockKind clock = ClockKind::monotonic;
  realtime::Settings realtime{};  // of the loop's thread; nothing to a virtual clock
  bool require_realtime = false;  // refuse to run where one of its rights is missing
  SweepSettings sweep{};
  MotionLimits motion{};
  GuardSettings guard{};
  Channel actuator;
  std::vector<Channel> sensors{};
  RunnerSettings runner{};
  double max_lag_s = 10.0;  // a finished point that is not on the disk for longer ends the run
  std::string prior{};  // sweep file that the plant's modes are taken from; empty: they are found

  // The plan of this rig; PlanRefused becomes a ConfigError with file and line.
  SweepPlan plan() const;

  std::vector<std::string> sensor_names() const;
};

// Reads the common part. The caller lets the drivers read theirs, then calls
// file->refuse_unread(). Throws ConfigError.
Rig read_rig(std::unique_ptr<RigFile> file);

}  // namespace sinerig::config
