// The guard sees every sample and has the last word on every command. From a violation to a changed
// command: at most one tick.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "drivers/driver.h"
#include "sweep/nonblocking.h"
#include "sweep/plan.h"

namespace sinerig {

struct ChannelLimits {
  double min = -unlimited;
  double max = unlimited;
  double rate_per_s = unlimited;  // |change between two samples| / time between them
};

struct GuardSettings {
  double command_min = -unlimited;
  double command_max = unlimited;
  double slew_per_s = unlimited;
  double neutral = 0.0;                 // the command that leaves the rig at rest
  std::int64_t max_age_ns = 0;          // of the newest good sample of a channel; 0 = not watched
  std::uint32_t max_write_faults = 2;   // this many faulty writes in a row are a dead actuator
  std::uint64_t stop_ramp_ticks = 0;    // from the last command to neutral; 0 = at once
  std::vector<ChannelLimits> channels;  // one per sensor, in order
};

inline constexpr std::uint32_t no_sensor = 0xffffffff;

enum class TripCause : std::uint8_t {
  none,
  stop_requested,
  command_limit,
  command_slew,
  command_not_finite,
  channel_limit,
  channel_rate,
  channel_not_finite,
  channel_age,
  actuator_fault,
  excitation_missing,
  excitation_other_frequency,
  excitation_reversed,
  recorder_stalled,
  clock_lost,
  interlock_open,
};

const char* to_string(TripCause cause) noexcept;

// Why the command was taken away: what was seen, what was allowed, when, and what the command was
// changed to.
struct Trip {
  TripCause cause = TripCause::none;
  std::uint32_t channel =
      0;  // sensor index where the cause is a channel's; no_sensor: what was applied
  double value = 0.0;
  double limit = 0.0;
  std::uint64_t tick = 0;
  double command = 0.0;  // first command after the trip

  bool tripped() const noexcept { return cause != TripCause::none; }
};

class Guard {
 public:
  // `period_s` is the tick. Throws std::invalid_argument for limits that exclude the neutral
  // command or cross each other.
  Guard(GuardSettings settings, double period_s);

  // What may go out at this tick instead of `wanted`: the same while all is well, the ramp to
  // neutral after a trip. `ticks` have passed since the last call.
  double admit(double wanted, std::uint64_t tick, std::uint64_t ticks) noexcept SINERIG_NONBLOCKING;

  // What the actuator answered, and what each sensor read.
  void observe_write(const Sample& applied, std::uint64_t tick) noexcept SINERIG_NONBLOCKING;
  void observe(std::uint32_t channel, const Sample& sample, std::int64_t now_ns,
               std::uint64_t tick) noexcept SINERIG_NONBLOCKING;

  // Starts the ramp to neutral for a reason from outside; the first cause is the one kept.
  // A ramp already under way is cut short by `at_once`.
  void stop(TripCause cause, std::uint64_t tick, bool at_once = false) noexcept SINERIG_NONBLOCKING;

  // The same with the figure behind it; `channel` is a sensor's index.
  void trip(TripCause cause, std::uint32_t channel, double value, double limit,
            std::uint64_t tick) noexcept SINERIG_NONBLOCKING;

  const Trip& trip() const noexcept { return trip_; }

  // The ramp has ended: nothing is left but to release.
  bool finished() const noexcept { return trip_.tripped() && ramp_left_ == 0 && changed_; }

 private:
  struct ChannelState {
    double last_value = 0.0;
    std::int64_t last_good_ns = 0;
    bool seen = false;
  };

  double ramp_down(std::uint64_t ticks) noexcept;

  GuardSettings settings_;
  double max_step_;
  std::vector<ChannelState> channels_;
  Trip trip_;
  double last_command_;
  bool changed_ = false;  // a command after the trip has gone out
  std::uint64_t ramp_left_ = 0;
  std::uint32_t write_faults_ = 0;
  std::int64_t watch_from_ns_ = -1;
};

// One line for people: "gyro = 3.2 is above its maximum 3 at tick 812; command ramped to 0".
std::string describe(const Trip& trip, const std::vector<std::string>& channel_names);

// The same without tick and command: "gyro = 3.2 is outside its limit 3".
std::string describe_cause(const Trip& trip, const std::vector<std::string>& channel_names);

}  // namespace sinerig
