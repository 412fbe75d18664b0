// Why a command was taken away: what was seen, what was allowed, when, and what the command was
// changed to.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace sinerig {

inline constexpr std::uint32_t no_sensor = 0xffffffff;

enum class TripCause : std::uint8_t {
  none,
  stop_requested,
  command_limit,
  command_slew,
  command_not_finite,
  channel_limit,
  channel_rate,
  channel_velocity,
  channel_acceleration,
  channel_not_finite,
  channel_age,
  channel_code,
  following_error,
  actuator_fault,
  excitation_missing,
  excitation_other_frequency,
  excitation_reversed,
  preflight_silent,
  preflight_gain,
  preflight_phase,
  preflight_noise,
  recorder_stalled,
  clock_lost,
  loop_late,
  interlock_open,
};

const char* to_string(TripCause cause) noexcept;

struct Trip {
  TripCause cause = TripCause::none;
  bool soft = false;  // of a soft limit: the dwell is tried again at a lower amplitude
  std::uint32_t channel =
      0;  // sensor index where the cause is a channel's; no_sensor: what was applied
  double value = 0.0;
  double limit = 0.0;
  std::uint64_t tick = 0;
  double command = 0.0;  // first command after the trip

  bool tripped() const noexcept { return cause != TripCause::none; }

  // A device has failed, or the connection to it: what may pass by itself or by arming again.
  bool device_fault() const noexcept {
    return cause == TripCause::actuator_fault || cause == TripCause::channel_age ||
           cause == TripCause::channel_code;
  }

  // `channel` is a sensor's.
  bool of_sensor() const noexcept;
};

// One line for people: "gyro = 3.2 is outside its limit 3 (tick 812; command changed to 0)".
std::string describe(const Trip& trip, const std::vector<std::string>& channel_names);

// The same without tick and command: "gyro = 3.2 is outside its limit 3".
std::string describe_cause(const Trip& trip, const std::vector<std::string>& channel_names);

}  // namespace sinerig
