#include "config/limits.h"

#include <algorithm>
#include <cmath>

namespace sinerig::config {

namespace {

// Behind this many ticks the quantum of an encoder is not taken for speed.
constexpr double default_filter_ticks = 4.0;

constexpr Range any_or_unlimited{.or_unlimited = true};

std::int64_t nanoseconds(double seconds) {
  return std::llround(seconds * 1e9);
}

Bound read_bound(const Section& sensor, const std::string& key) {
  const std::string soft_key = "soft_" + key;
  Bound bound;
  bound.hard = sensor.number(key, above_zero_or_unlimited, bound.hard);
  bound.soft = sensor.number(soft_key, above_zero_or_unlimited, bound.soft);
  if (bound.soft < unlimited && bound.soft >= bound.hard) {
    sensor.refuse(soft_key, "must be below " + key + ", which stops the sweep before it");
  }
  return bound;
}

void read_windows(const Section& sensor, ChannelLimits& limits) {
  limits.min = sensor.number("min", any_number, limits.min);
  limits.max = sensor.number("max", any_number, limits.max);
  if (!(limits.min < limits.max)) sensor.refuse("min", "must be below max");
  limits.soft_min = sensor.number("soft_min", any_or_unlimited, limits.soft_min);
  limits.soft_max = sensor.number("soft_max", any_or_unlimited, limits.soft_max);
  if (!(limits.soft_min < limits.soft_max)) sensor.refuse("soft_min", "must be below soft_max");
  if (limits.soft_min > -unlimited && limits.soft_min <= limits.min) {
    sensor.refuse("soft_min", "must be above min, which stops the sweep before it");
  }
  if (limits.soft_max < unlimited && limits.soft_max >= limits.max) {
    sensor.refuse("soft_max", "must be below max, which stops the sweep before it");
  }
}

// Two numbers in ascending order.
void read_pair(const Section& section, std::string_view key, Range range, double& low,
               double& high) {
  if (!section.has(key)) return;
  const std::vector<double> pair = section.numbers(key, range);
  if (pair.size() != 2 || !(pair[0] < pair[1])) {
    section.refuse(key, "must be [smallest, largest]");
  }
  low = pair[0];
  high = pair[1];
}

std::uint32_t read_count(const Section& section, std::string_view key, std::uint32_t fallback) {
  return static_cast<std::uint32_t>(section.integer(key, {.min = 0.0, .max = 1e6}, fallback));
}

}  // namespace

MotionLimits read_motion(const Section& limits) {
  MotionLimits motion;
  motion.command_min = limits.number("command_min", any_number, motion.command_min);
  motion.command_max = limits.number("command_max", any_number, motion.command_max);
  motion.slew_per_s = limits.number("slew_per_s", above_zero_or_unlimited, motion.slew_per_s);
  motion.velocity_max = limits.number("velocity_max", above_zero_or_unlimited, motion.velocity_max);
  motion.acceleration_max =
      limits.number("acceleration_max", above_zero_or_unlimited, motion.acceleration_max);
  if (!(motion.command_min < motion.command_max)) {
    limits.refuse("command_min", "must be below command_max");
  }
  return motion;
}

GuardSettings read_guard(const Section& limits, const MotionLimits& motion, double rate_hz) {
  GuardSettings guard;
  guard.command_min = motion.command_min;
  guard.command_max = motion.command_max;
  guard.slew_per_s = motion.slew_per_s;
  const double default_age_s = std::max(0.1, 10.0 / rate_hz);
  guard.max_age_ns = nanoseconds(limits.number("age_s", zero_or_more, default_age_s));
  guard.max_write_faults = static_cast<std::uint32_t>(
      limits.integer("write_faults", {.min = 0, .max = 1e6}, guard.max_write_faults));
  guard.stop_ramp_ticks = static_cast<std::uint64_t>(
      std::llround(limits.number("stop_ramp_s", {.min = 0.0, .max = 60.0}, 0.0) * rate_hz));
  const double lateness_s = limits.number("lateness_s", above_zero_or_unlimited, unlimited);
  if (lateness_s < 1e9) guard.max_lateness_ns = nanoseconds(lateness_s);
  return guard;
}

ChannelLimits read_channel_limits(const Section& sensor, double rate_hz, bool comparable) {
  ChannelLimits limits;
  read_windows(sensor, limits);
  limits.rate_per_s = sensor.number("rate_per_s", above_zero_or_unlimited, limits.rate_per_s);
  limits.velocity = read_bound(sensor, "velocity_max");
  limits.acceleration = read_bound(sensor, "acceleration_max");
  limits.derivative_filter_s = sensor.number("derivative_filter_s", {.min = 0.0, .max = 10.0},
                                             default_filter_ticks / rate_hz);
  limits.following = read_bound(sensor, "following_max");
  limits.following_ns = nanoseconds(sensor.number("following_s", {.min = 0.0, .max = 3600.0}, 0.0));
  if (limits.following.set() && !comparable) {
    sensor.refuse(limits.following.hard < unlimited ? "following_max" : "soft_following_max",
                  "needs a sensor in the unit of the command; give it the `unit` of [actuator]");
  }
  if (sensor.has("allowed")) {
    limits.allowed = sensor.numbers("allowed", any_number);
    if (limits.allowed.empty()) sensor.refuse("allowed", "must hold at least one value");
  }
  if (sensor.has("age_s")) limits.max_age_ns = nanoseconds(sensor.number("age_s", zero_or_more));
  return limits;
}

PreflightSettings read_preflight(const Section& sweep) {
  PreflightSettings preflight;
  preflight.wanted = sweep.flag("preflight", preflight.wanted);
  preflight.level =
      sweep.number("preflight_level", {.min = 0.0, .max = 1.0, .open_min = true}, preflight.level);
  read_pair(sweep, "preflight_gain", {.min = 0.0, .or_unlimited = true}, preflight.min_gain,
            preflight.max_gain);
  read_pair(sweep, "preflight_phase_deg", {.min = -720.0, .max = 720.0}, preflight.min_phase_deg,
            preflight.max_phase_deg);
  if (preflight.max_phase_deg - preflight.min_phase_deg > 360.0) {
    sweep.refuse("preflight_phase_deg", "must span a whole turn at most");
  }
  preflight.min_snr_db =
      sweep.number("preflight_snr_db", {.min = -100.0, .max = 200.0}, preflight.min_snr_db);
  return preflight;
}

RetrySettings read_retry(const Section& retry) {
  RetrySettings settings;
  const Range wait{.min = 0.0, .max = 86'400.0};
  settings.faults = read_count(retry, "faults", settings.faults);
  settings.faults_in_all = read_count(retry, "faults_in_all", settings.faults_in_all);
  settings.wait_s = retry.number("wait_s", wait, settings.wait_s);
  settings.soft = read_count(retry, "soft", settings.soft);
  settings.soft_in_all = read_count(retry, "soft_in_all", settings.soft_in_all);
  settings.soft_factor =
      retry.number("soft_factor", {.min = 0.01, .max = 1.0}, settings.soft_factor);
  settings.soft_wait_s = retry.number("soft_wait_s", wait, settings.soft_wait_s);
  return settings;
}

}  // namespace sinerig::config
