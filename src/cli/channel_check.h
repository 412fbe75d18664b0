// How a rig's sensors behave while nothing is commanded: rate, age, jitter, losses, and what the
// guard of a sweep would say.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "drivers/driver.h"
#include "sweep/clock.h"
#include "sweep/guard.h"

namespace sinerig::cli {

struct ChannelCheck {
  std::uint64_t samples = 0;              // new and good
  std::array<std::uint64_t, 7> faults{};  // by Fault
  std::uint64_t lost = 0;  // samples that the usual distance between two says are missing
  double rate_hz = 0.0;
  double age_median_s = 0.0;  // of a sample when the loop sees it, as the next two
  double age_99_s = 0.0;
  double age_most_s = 0.0;
  double jitter_s = 0.0;  // rms of the distance between two samples about its median, losses aside
  double last_value = 0.0;
  Trip trip{};                   // what would have stopped a sweep
  bool answers_command = false;  // nobody asks while nothing is commanded

  bool silent_as_it_should_be() const { return answers_command && samples == 0; }

  std::uint64_t faulty(Fault fault) const { return faults[static_cast<std::size_t>(fault)]; }
};

struct LoopCheck {
  std::uint64_t ticks = 0;
  std::uint64_t skipped = 0;
  double lateness_99_s = 0.0;
  double lateness_most_s = 0.0;
};

struct RigCheck {
  LoopCheck loop;
  std::vector<ChannelCheck> channels;  // one per sensor, in order
};

// Reads every sensor at every tick for `seconds` of the clock, or until `stop`. `guard` has one
// channel per sensor.
RigCheck check_channels(Clock& clock, std::span<Sensor* const> sensors, const GuardSettings& guard,
                        double seconds, const std::atomic<bool>& stop);

}  // namespace sinerig::cli
