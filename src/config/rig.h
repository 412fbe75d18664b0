// What a rig file says that every rig has: loop, sweep, limits, channels, output. The drivers read
// their own keys from the same sections.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "config/section.h"
#include "sweep/guard.h"
#include "sweep/plan.h"
#include "sweep/runner.h"

namespace sinerig::config {

enum class ClockKind { virtual_time, monotonic };

struct Channel {
  std::string name;
  std::string unit;
  std::string driver;
  Section section;
};

struct Rig {
  std::unique_ptr<RigFile> file;

  double rate_hz = 0.0;
  ClockKind clock = ClockKind::monotonic;
  SweepSettings sweep{};
  MotionLimits motion{};
  GuardSettings guard{};
  Channel actuator;
  std::vector<Channel> sensors{};
  RunnerSettings runner{};
  std::string prior{};  // sweep file that the plant's modes are taken from; empty: they are found

  // The plan of this rig; PlanRefused becomes a ConfigError with file and line.
  SweepPlan plan() const;

  std::vector<std::string> sensor_names() const;
};

// Reads the common part. The caller lets the drivers read theirs, then calls
// file->refuse_unread(). Throws ConfigError.
Rig read_rig(std::unique_ptr<RigFile> file);

}  // namespace sinerig::config
