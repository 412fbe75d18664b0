#include "dashboard/scope.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace sinerig::dashboard {

double Headroom::used() const {
  const bool both = std::isfinite(min) && std::isfinite(max);
  if (!seen || !both || lasting_s > 0.0) return std::numeric_limits<double>::quiet_NaN();
  const double middle = 0.5 * (min + max);
  return std::max(high - middle, middle - low) / (0.5 * (max - min));
}

double Headroom::left() const {
  if (!seen) return std::numeric_limits<double>::quiet_NaN();
  return std::min(max - high, low - min);
}

std::vector<Headroom> headroom_rows(const GuardSettings& limits,
                                    const std::vector<std::string>& names,
                                    const std::vector<std::string>& units) {
  std::vector<Headroom> rows;
  const auto add = [&](std::size_t channel, Quantity quantity, const std::string& what,
                       const std::string& per, double min, double max) {
    if (!std::isfinite(min) && !std::isfinite(max)) return;
    Headroom row{.name = names[channel] + what, .unit = units[channel] + per};
    row.channel = channel;
    row.quantity = quantity;
    row.min = min;
    row.max = max;
    rows.push_back(row);
  };
  const auto add_bound = [&](std::size_t channel, Quantity quantity, const std::string& what,
                             const std::string& per, const Bound& bound) {
    add(channel, quantity, what, per, -bound.hard, bound.hard);
    add(channel, quantity, what + ", soft", per, -bound.soft, bound.soft);
  };
  add(command_channel, Quantity::value, "", "", limits.command_min, limits.command_max);
  add(command_channel, Quantity::rate, " rate", "/s", -limits.slew_per_s, limits.slew_per_s);
  for (std::size_t i = 0; i < limits.channels.size(); ++i) {
    const std::size_t channel = first_sensor_channel + i;
    const ChannelLimits& limit = limits.channels[i];
    add(channel, Quantity::value, "", "", limit.min, limit.max);
    add(channel, Quantity::value, ", soft", "", limit.soft_min, limit.soft_max);
    add(channel, Quantity::rate, " rate", "/s", -limit.rate_per_s, limit.rate_per_s);
    add_bound(channel, Quantity::velocity, " velocity", "/s", limit.velocity);
    add_bound(channel, Quantity::acceleration, " acceleration", "/s²", limit.acceleration);
    const std::size_t first = rows.size();
    add_bound(channel, Quantity::following, " following error", "", limit.following);
    for (std::size_t row = first; row < rows.size(); ++row)
      rows[row].lasting_s = 1e-9 * static_cast<double>(limit.following_ns);
  }
  return rows;
}

Scope::Scope(std::size_t channels, const GuardSettings& limits,
             const std::vector<std::string>& names, const std::vector<std::string>& units,
             double rate_hz)
    : rate_hz_{rate_hz},
      headroom_{headroom_rows(limits, names, units)},
      channels_(channels),
      ring_(channels) {
  for (std::size_t row = 0; row < headroom_.size(); ++row)
    channels_[headroom_[row].channel].rows.push_back(row);
  for (std::size_t i = 0; i < limits.channels.size(); ++i)
    channels_[first_sensor_channel + i].filter_s = limits.channels[i].derivative_filter_s;
}

void Scope::start(double frequency_hz) {
  const double wanted = static_cast<double>(cycles) * rate_hz_ / frequency_hz;
  stride_ = static_cast<std::uint64_t>(
      std::max(1.0, std::ceil(wanted / static_cast<double>(most_samples))));
  length_ = std::max(least_samples,
                     static_cast<std::size_t>(std::ceil(wanted / static_cast<double>(stride_))));
  for (std::vector<double>& channel : ring_) channel.clear();
  next_ = 0;
  for (Headroom& row : headroom_) row.seen = false;
}

void Scope::note(const Channel& channel, Quantity quantity, double value) {
  if (!std::isfinite(value)) return;
  for (const std::size_t row : channel.rows) {
    Headroom& room = headroom_[row];
    if (room.quantity != quantity) continue;
    room.low = room.seen ? std::min(room.low, value) : value;
    room.high = room.seen ? std::max(room.high, value) : value;
    room.seen = true;
  }
}

// Held values say nothing of the rig: what they are followed by would look like a leap.
void Scope::watch(std::size_t index, const TickSamples& samples) {
  Channel& channel = channels_[index];
  if (channel.rows.empty() || !samples.good(index)) return;
  const double value = samples.values[index];
  note(channel, Quantity::value, value);
  if (index >= first_sensor_channel && applied_known_)
    note(channel, Quantity::following, applied_ - value);
  const double elapsed_s =
      static_cast<double>(samples.tick - channel.last_tick) / rate_hz_ +
      1e-9 * (static_cast<double>(samples.offset_ns[index]) - channel.last_offset_ns);
  if (channel.seen && elapsed_s > 0.0) {
    const double change = value - channel.last;
    channel.motion.update(change, elapsed_s, channel.filter_s);
    note(channel, Quantity::rate, change / elapsed_s);
    note(channel, Quantity::velocity, channel.motion.velocity);
    note(channel, Quantity::acceleration, channel.motion.acceleration);
  }
  channel.last = value;
  channel.last_tick = samples.tick;
  channel.last_offset_ns = samples.offset_ns[index];
  channel.seen = true;
}

void Scope::add(const TickSamples& samples) {
  const std::size_t channels = std::min<std::size_t>(channels_.size(), samples.channels);
  if (samples.good(applied_channel)) {
    applied_ = samples.values[applied_channel];
    applied_known_ = true;
  }
  for (std::size_t channel = 0; channel < channels; ++channel) watch(channel, samples);
  if (samples.tick % stride_ == 0) keep(samples);
}

void Scope::keep(const TickSamples& samples) {
  const std::size_t channels = std::min<std::size_t>(channels_.size(), samples.channels);
  const bool was_full = !ring_.empty() && ring_.front().size() == length_;
  for (std::size_t channel = 0; channel < channels; ++channel) {
    std::vector<double>& ring = ring_[channel];
    if (ring.size() < length_) {
      ring.push_back(samples.values[channel]);
    } else {
      ring[next_] = samples.values[channel];
    }
  }
  if (was_full) next_ = (next_ + 1) % length_;
}

Scope::Trace Scope::trace() const {
  Trace trace{.step_s = static_cast<double>(stride_) / rate_hz_, .channels = ring_};
  for (std::vector<double>& channel : trace.channels) {
    if (channel.size() == length_)
      std::rotate(channel.begin(), channel.begin() + static_cast<std::ptrdiff_t>(next_),
                  channel.end());
  }
  return trace;
}

}  // namespace sinerig::dashboard
