#include "sweep/guard.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace sinerig {

bool ChannelLimits::watched_closely() const {
  return soft_min > -unlimited || soft_max < unlimited || velocity.set() || acceleration.set() ||
         following.set() || !allowed.empty();
}

Guard::Guard(GuardSettings settings, double period_s)
    : settings_{std::move(settings)},
      // A planned sine reaches its limits, so its rounding must not trip them.
      max_step_{settings_.slew_per_s * period_s * (1.0 + 1e-9)},
      channels_(settings_.channels.size()),
      motions_(settings_.channels.size()),
      last_command_{settings_.neutral} {
  const bool neutral_allowed =
      settings_.command_min <= settings_.neutral && settings_.neutral <= settings_.command_max;
  if (!neutral_allowed) {
    throw std::invalid_argument("the neutral command must lie between command_min and command_max");
  }
  for (ChannelLimits& channel : settings_.channels) {
    if (!(channel.min < channel.max) || !(channel.rate_per_s > 0.0)) {
      throw std::invalid_argument("a channel's window must have min < max and a rate above 0");
    }
    if (!(channel.soft_min < channel.soft_max)) {
      throw std::invalid_argument("a channel's soft window must have min < max");
    }
    if (channel.max_age_ns < 0) channel.max_age_ns = settings_.max_age_ns;
    closely_.push_back(channel.watched_closely());
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
  const bool good = applied.fault == Fault::none && std::isfinite(applied.value);
  if (good) applied_ = applied.value;
  applied_known_ = good;
  if (applied.fault == Fault::device) trip(TripCause::actuator_fault, 0, 0.0, 0.0, tick);
  write_faults_ = good ? 0 : write_faults_ + 1;
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
  if (limits.max_age_ns > 0 && age_ns > limits.max_age_ns) {
    trip(TripCause::channel_age, channel, static_cast<double>(age_ns) * 1e-9,
         static_cast<double>(limits.max_age_ns) * 1e-9, tick);
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
  if (closely_[channel]) watch_closely(channel, sample, tick);
  state = {.last_value = sample.value, .last_good_ns = sample.time_ns, .seen = true};
}

void Guard::watch_closely(std::uint32_t channel, const Sample& sample,
                          std::uint64_t tick) noexcept {
  const ChannelLimits& limits = settings_.channels[channel];
  const double value = sample.value;
  if (value > limits.soft_max) {
    trip(TripCause::channel_limit, channel, value, limits.soft_max, tick, true);
  } else if (value < limits.soft_min) {
    trip(TripCause::channel_limit, channel, value, limits.soft_min, tick, true);
  }
  const auto same = [value](double allowed) {
    return value == allowed;
  };
  if (!limits.allowed.empty() && std::ranges::none_of(limits.allowed, same)) {
    trip(TripCause::channel_code, channel, value, 0.0, tick);
  }
  watch_motion(channel, sample, tick);
  watch_following(channel, sample, tick);
}

void Guard::watch_motion(std::uint32_t channel, const Sample& sample, std::uint64_t tick) noexcept {
  const ChannelLimits& limits = settings_.channels[channel];
  const ChannelState& state = channels_[channel];
  MotionFilter& filter = motions_[channel].filter;
  const double elapsed_s = static_cast<double>(sample.time_ns - state.last_good_ns) * 1e-9;
  if (!state.seen || !(elapsed_s > 0.0)) return;
  filter.update(sample.value - state.last_value, elapsed_s, limits.derivative_filter_s);
  hold(limits.velocity, std::abs(filter.velocity), TripCause::channel_velocity, channel, tick);
  hold(limits.acceleration, std::abs(filter.acceleration), TripCause::channel_acceleration, channel,
       tick);
}

void Guard::watch_following(std::uint32_t channel, const Sample& sample,
                            std::uint64_t tick) noexcept {
  const ChannelLimits& limits = settings_.channels[channel];
  if (!limits.following.set() || !applied_known_) return;
  Motion& motion = motions_[channel];
  const double error = std::abs(applied_ - sample.value);
  const auto lasts = [&](double bound, std::int64_t& since_ns) {
    if (error <= bound) {
      since_ns = -1;
      return false;
    }
    if (since_ns < 0) since_ns = sample.time_ns;
    return sample.time_ns - since_ns >= limits.following_ns;
  };
  if (lasts(limits.following.hard, motion.hard_error_ns)) {
    trip(TripCause::following_error, channel, error, limits.following.hard, tick);
  }
  if (lasts(limits.following.soft, motion.soft_error_ns)) {
    trip(TripCause::following_error, channel, error, limits.following.soft, tick, true);
  }
}

void Guard::hold(const Bound& bound, double value, TripCause cause, std::uint32_t channel,
                 std::uint64_t tick) noexcept {
  if (value > bound.hard) {
    trip(cause, channel, value, bound.hard, tick);
  } else if (value > bound.soft) {
    trip(cause, channel, value, bound.soft, tick, true);
  }
}

void Guard::trip_late(std::int64_t lateness_ns, std::uint64_t tick) noexcept {
  trip(TripCause::loop_late, no_sensor, static_cast<double>(lateness_ns) * 1e-9,
       static_cast<double>(settings_.max_lateness_ns) * 1e-9, tick);
}

void Guard::stop(TripCause cause, std::uint64_t tick, bool at_once) noexcept {
  trip(cause, 0, 0.0, 0.0, tick);
  if (at_once) ramp_left_ = 0;
}

void Guard::trip(TripCause cause, std::uint32_t channel, double value, double limit,
                 std::uint64_t tick, bool soft) noexcept {
  const bool ramping = trip_.tripped();
  if (ramping && (soft || !trip_.soft)) return;
  trip_ = {.cause = cause,
           .soft = soft,
           .channel = channel,
           .value = value,
           .limit = limit,
           .tick = tick};
  if (!ramping) ramp_left_ = settings_.stop_ramp_ticks;
  changed_ = false;
}

void Guard::resume() noexcept {
  trip_ = {};
  changed_ = false;
  ramp_left_ = 0;
  last_command_ = settings_.neutral;
  applied_known_ = false;
  write_faults_ = 0;
  watch_from_ns_ = -1;
  std::fill(channels_.begin(), channels_.end(), ChannelState{});
  std::fill(motions_.begin(), motions_.end(), Motion{});
}

}  // namespace sinerig
