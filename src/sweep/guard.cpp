#include "sweep/guard.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <stdexcept>
#include <utility>

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
    case TripCause::channel_not_finite: return "channel_not_finite";
    case TripCause::channel_age: return "channel_age";
    case TripCause::actuator_fault: return "actuator_fault";
    case TripCause::excitation_missing: return "excitation_missing";
    case TripCause::excitation_other_frequency: return "excitation_other_frequency";
    case TripCause::excitation_reversed: return "excitation_reversed";
    case TripCause::recorder_stalled: return "recorder_stalled";
    case TripCause::clock_lost: return "clock_lost";
    case TripCause::interlock_open: return "interlock_open";
  }
  return "unknown";
}

Guard::Guard(GuardSettings settings, double period_s)
    : settings_{std::move(settings)},
      // A planned sine reaches its limits, so its rounding must not trip them.
      max_step_{settings_.slew_per_s * period_s * (1.0 + 1e-9)},
      channels_(settings_.channels.size()),
      last_command_{settings_.neutral} {
  const bool neutral_allowed =
      settings_.command_min <= settings_.neutral && settings_.neutral <= settings_.command_max;
  if (!neutral_allowed) {
    throw std::invalid_argument("the neutral command must lie between command_min and command_max");
  }
  for (const ChannelLimits& channel : settings_.channels) {
    if (!(channel.min < channel.max) || !(channel.rate_per_s > 0.0)) {
      throw std::invalid_argument("a channel's window must have min < max and a rate above 0");
    }
  }
}

double Guard::admit(double wanted, std::uint64_t tick, std::uint64_t ticks) noexcept {
  if (!trip_.tripped()) {
    const double step = std::abs(wanted - last_command_);
    const double allowed_step = max_step_ * static_cast<double>(ticks);
    if (!std::isfinite(wanted)) {
      trip(TripCause::command_not_finite, 0, wanted, 0.0, tick);
    } else if (wanted > settings_.command_max) {
      trip(TripCause::command_limit, 0, wanted, settings_.command_max, tick);
    } else if (wanted < settings_.command_min) {
      trip(TripCause::command_limit, 0, wanted, settings_.command_min, tick);
    } else if (step > allowed_step) {
      trip(TripCause::command_slew, 0, step, allowed_step, tick);
    }
  }
  if (trip_.tripped()) {
    last_command_ = ramp_down(ticks);
    if (!changed_) trip_.command = last_command_;
    changed_ = true;
  } else {
    last_command_ = wanted;
  }
  return last_command_;
}

double Guard::ramp_down(std::uint64_t ticks) noexcept {
  if (ticks >= ramp_left_) {
    ramp_left_ = 0;
    return settings_.neutral;
  }
  const double remaining =
      static_cast<double>(ramp_left_ - ticks) / static_cast<double>(ramp_left_);
  ramp_left_ -= ticks;
  return settings_.neutral + (last_command_ - settings_.neutral) * remaining;
}

void Guard::observe_write(const Sample& applied, std::uint64_t tick) noexcept {
  if (applied.fault == Fault::stale) return;
  if (applied.fault == Fault::device) trip(TripCause::actuator_fault, 0, 0.0, 0.0, tick);
  write_faults_ = applied.fault == Fault::none ? 0 : write_faults_ + 1;
  if (settings_.max_write_faults != 0 && write_faults_ >= settings_.max_write_faults) {
    trip(TripCause::actuator_fault, 0, write_faults_, settings_.max_write_faults, tick);
  }
}

void Guard::observe(std::uint32_t channel, const Sample& sample, std::int64_t now_ns,
                    std::uint64_t tick) noexcept {
  const ChannelLimits& limits = settings_.channels[channel];
  ChannelState& state = channels_[channel];
  if (watch_from_ns_ < 0) watch_from_ns_ = now_ns;
  if (sample.fault == Fault::interlock)
    trip(TripCause::interlock_open, channel, sample.value, 0.0, tick);

  const bool good = sample.fault == Fault::none;
  const std::int64_t newest_ns =
      good ? sample.time_ns : (state.seen ? state.last_good_ns : watch_from_ns_);
  const std::int64_t age_ns = now_ns - newest_ns;
  if (settings_.max_age_ns > 0 && age_ns > settings_.max_age_ns) {
    trip(TripCause::channel_age, channel, static_cast<double>(age_ns) * 1e-9,
         static_cast<double>(settings_.max_age_ns) * 1e-9, tick);
  }
  if (!good) return;
  if (!std::isfinite(sample.value)) {
    trip(TripCause::channel_not_finite, channel, sample.value, 0.0, tick);
    return;
  }
  if (sample.value > limits.max) {
    trip(TripCause::channel_limit, channel, sample.value, limits.max, tick);
  } else if (sample.value < limits.min) {
    trip(TripCause::channel_limit, channel, sample.value, limits.min, tick);
  }
  const double elapsed_s = static_cast<double>(sample.time_ns - state.last_good_ns) * 1e-9;
  const double change = std::abs(sample.value - state.last_value);
  if (state.seen && elapsed_s > 0.0 && change > limits.rate_per_s * elapsed_s) {
    trip(TripCause::channel_rate, channel, change / elapsed_s, limits.rate_per_s, tick);
  }
  state = {.last_value = sample.value, .last_good_ns = sample.time_ns, .seen = true};
}

void Guard::stop(TripCause cause, std::uint64_t tick, bool at_once) noexcept {
  trip(cause, 0, 0.0, 0.0, tick);
  if (at_once) ramp_left_ = 0;
}

void Guard::trip(TripCause cause, std::uint32_t channel, double value, double limit,
                 std::uint64_t tick) noexcept {
  if (trip_.tripped()) return;
  trip_ = {.cause = cause, .channel = channel, .value = value, .limit = limit, .tick = tick};
  ramp_left_ = settings_.stop_ramp_ticks;
  changed_ = false;
}

std::string describe_cause(const Trip& trip, const std::vector<std::string>& channel_names) {
  const std::string name =
      trip.channel < channel_names.size() ? channel_names[trip.channel] : "what was applied";
  const auto with = [&](const char* format, double a, double b) {
    char text[160];
    std::snprintf(text, sizeof text, format, a, b);
    return std::string{text};
  };
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
      what = name + with(" = %.6g is outside its limit %.6g", trip.value, trip.limit);
      break;
    case TripCause::channel_rate:
      what = name + with(" changes by %.6g per second, its limit is %.6g", trip.value, trip.limit);
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
