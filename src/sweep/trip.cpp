#include "sweep/trip.h"

#include <cstdio>

namespace sinerig {

const char* to_string(TripCause cause) noexcept {
  switch (cause) {
    case TripCause::none: return "none";
    case TripCause::stop_requested: return "stop_requested";
    case TripCause::command_limit: return "command_limit";
    case TripCause::command_slew: return "command_slew";
    case TripCause::command_not_finite: return "command_not_finite";
    case TripCause::channel_limit: return "channel_limit";
    case TripCause::channel_rate: return "channel_rate";
    case TripCause::channel_velocity: return "channel_velocity";
    case TripCause::channel_acceleration: return "channel_acceleration";
    case TripCause::channel_not_finite: return "channel_not_finite";
    case TripCause::channel_age: return "channel_age";
    case TripCause::channel_code: return "channel_code";
    case TripCause::following_error: return "following_error";
    case TripCause::actuator_fault: return "actuator_fault";
    case TripCause::excitation_missing: return "excitation_missing";
    case TripCause::excitation_other_frequency: return "excitation_other_frequency";
    case TripCause::excitation_reversed: return "excitation_reversed";
    case TripCause::preflight_silent: return "preflight_silent";
    case TripCause::preflight_gain: return "preflight_gain";
    case TripCause::preflight_phase: return "preflight_phase";
    case TripCause::preflight_noise: return "preflight_noise";
    case TripCause::recorder_stalled: return "recorder_stalled";
    case TripCause::clock_lost: return "clock_lost";
    case TripCause::loop_late: return "loop_late";
    case TripCause::interlock_open: return "interlock_open";
  }
  return "unknown";
}

bool Trip::of_sensor() const noexcept {
  switch (cause) {
    case TripCause::channel_limit:
    case TripCause::channel_rate:
    case TripCause::channel_velocity:
    case TripCause::channel_acceleration:
    case TripCause::channel_not_finite:
    case TripCause::channel_age:
    case TripCause::channel_code:
    case TripCause::following_error:
    case TripCause::preflight_silent:
    case TripCause::preflight_gain:
    case TripCause::preflight_phase:
    case TripCause::preflight_noise:
    case TripCause::interlock_open: return true;
    case TripCause::excitation_missing:
    case TripCause::excitation_other_frequency:
    case TripCause::excitation_reversed: return channel != no_sensor;
    default: return false;
  }
}

std::string describe_cause(const Trip& trip, const std::vector<std::string>& channel_names) {
  const std::string name =
      trip.channel < channel_names.size() ? channel_names[trip.channel] : "what was applied";
  const auto with = [&](const char* format, double a, double b) {
    char text[160];
    std::snprintf(text, sizeof text, format, a, b);
    return std::string{text};
  };
  const std::string limit = trip.soft ? "soft limit" : "limit";
  std::string what;
  switch (trip.cause) {
    case TripCause::none: return "no trip";
    case TripCause::stop_requested: what = "stop requested"; break;
    case TripCause::command_limit:
      what = with("a command of %.6g is outside its limit %.6g", trip.value, trip.limit);
      break;
    case TripCause::command_slew:
      what = with("a command step of %.6g exceeds the slew limit of %.6g per tick", trip.value,
                  trip.limit);
      break;
    case TripCause::command_not_finite: what = "the command is not a finite number"; break;
    case TripCause::channel_limit:
      what = name + with(" = %.6g", trip.value, 0.0) + " is outside its " + limit +
             with(" %.6g", trip.limit, 0.0);
      break;
    case TripCause::channel_rate:
      what = name + with(" changes by %.6g per second, its limit is %.6g", trip.value, trip.limit);
      break;
    case TripCause::channel_velocity:
      what = name + with(" moves at %.6g per second", trip.value, 0.0) + ", its " + limit +
             with(" is %.6g", trip.limit, 0.0);
      break;
    case TripCause::channel_acceleration:
      what = name + with(" accelerates by %.6g per second squared", trip.value, 0.0) + ", its " +
             limit + with(" is %.6g", trip.limit, 0.0);
      break;
    case TripCause::following_error:
      what = name + with(" is %.6g away from what was applied", trip.value, 0.0) + ", its " +
             limit + with(" is %.6g", trip.limit, 0.0);
      break;
    case TripCause::channel_code:
      what = name + with(" = %.6g is none of its allowed values", trip.value, 0.0);
      break;
    case TripCause::channel_not_finite: what = name + " is not a finite number"; break;
    case TripCause::channel_age:
      what = name + with(" has had no good sample for %.3g s, its limit is %.3g s", trip.value,
                         trip.limit);
      break;
    case TripCause::actuator_fault:
      what = trip.limit == 0.0 ? "the actuator reports a fault"
                               : with("%.0f faulty writes to the actuator in a row (limit %.0f)",
                                      trip.value, trip.limit);
      break;
    case TripCause::excitation_missing:
      what = name + with(
                        " does not hold the commanded sine: %.3g of its amplitude (at least %.3g); "
                        "is the drive enabled and the range right?",
                        trip.value, trip.limit);
      break;
    case TripCause::excitation_other_frequency:
      what =
          name + with(
                     " moves at other frequencies than the command: %.3g of its power is where it "
                     "should be (at least %.3g)",
                     trip.value, trip.limit);
      break;
    case TripCause::excitation_reversed:
      what =
          name + with(" moves against the command: phase %.0f° (at most %.0f°); is a sign wrong?",
                      trip.value, trip.limit);
      break;
    case TripCause::recorder_stalled: what = "the recorder no longer takes points"; break;
    case TripCause::clock_lost:
      what = with("the loop stood still for %.3g s (at most %.3g s)", trip.value, trip.limit);
      break;
    case TripCause::loop_late:
      what = with("the loop was %.3g s late, its limit is %.3g s", trip.value, trip.limit);
      break;
    case TripCause::preflight_silent:
      what = name + with(
                        " does not answer the pre-flight dwell (SNR %.3g dB); is the sensor "
                        "connected, the drive enabled, [sweep] preflight_level loud enough?",
                        trip.value, 0.0);
      break;
    case TripCause::preflight_gain:
      what = name + with(
                        " answers the pre-flight dwell with a gain of %.6g, outside "
                        "[sweep] preflight_gain (%.6g); are unit, range and mechanism right?",
                        trip.value, trip.limit);
      break;
    case TripCause::preflight_phase:
      what = name + with(
                        " answers the pre-flight dwell with a phase of %.4g°, outside "
                        "[sweep] preflight_phase_deg (%.4g°); is a sign wrong?",
                        trip.value, trip.limit);
      break;
    case TripCause::preflight_noise:
      what = name + with(
                        " has an SNR of %.3g dB in the pre-flight dwell, [sweep] preflight_snr_db "
                        "wants %.3g; look for the noise, or raise preflight_level",
                        trip.value, trip.limit);
      break;
    case TripCause::interlock_open: what = name + ": the interlock is open"; break;
  }
  return what;
}

std::string describe(const Trip& trip, const std::vector<std::string>& channel_names) {
  const std::string cause = describe_cause(trip, channel_names);
  if (!trip.tripped()) return cause;
  char where[80];
  std::snprintf(where, sizeof where, " (tick %.0f; command changed to %.6g)",
                static_cast<double>(trip.tick), trip.command);
  return cause + where;
}

}  // namespace sinerig
