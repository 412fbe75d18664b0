#include "dashboard/scope.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace sinerig::dashboard {

namespace {

constexpr std::size_t no_row = std::numeric_limits<std::size_t>::max();

bool limited(double min, double max) {
  return std::isfinite(min) || std::isfinite(max);
}

}  // namespace

double Headroom::used() const {
  if (!seen) return std::numeric_limits<double>::quiet_NaN();
  if (std::isfinite(min) && std::isfinite(max)) {
    const double middle = 0.5 * (min + max);
    return std::max(high - middle, middle - low) / (0.5 * (max - min));
  }
  const double limit = std::isfinite(max) ? max : min;
  return std::isfinite(max) ? high / limit : low / limit;
}

std::vector<Headroom> headroom_rows(const GuardSettings& limits,
                                    const std::vector<std::string>& names,
                                    const std::vector<std::string>& units) {
  std::vector<Headroom> rows;
  const auto add = [&](const std::string& name, const std::string& unit, double min, double max) {
    if (limited(min, max)) rows.push_back({.name = name, .unit = unit, .min = min, .max = max});
  };
  const auto rate_unit = [](const std::string& unit) {
    return unit + "/s";
  };
  add(names[command_channel], units[command_channel], limits.command_min, limits.command_max);
  add(names[command_channel] + " rate", rate_unit(units[command_channel]), -limits.slew_per_s,
      limits.slew_per_s);
  for (std::size_t i = 0; i < limits.channels.size(); ++i) {
    const std::size_t channel = first_sensor_channel + i;
    const ChannelLimits& limit = limits.channels[i];
    add(names[channel], units[channel], limit.min, limit.max);
    add(names[channel] + " rate", rate_unit(units[channel]), -limit.rate_per_s, limit.rate_per_s);
  }
  return rows;
}

Scope::Scope(std::size_t channels, const GuardSettings& limits,
             const std::vector<std::string>& names, const std::vector<std::string>& units,
             double rate_hz)
    : channels_{channels},
      rate_hz_{rate_hz},
      headroom_{headroom_rows(limits, names, units)},
      window_row_(channels, no_row),
      rate_row_(channels, no_row),
      last_(channels),
      ring_(channels) {
  for (std::size_t row = 0; row < headroom_.size(); ++row) {
    for (std::size_t channel = 0; channel < channels; ++channel) {
      if (headroom_[row].name == names[channel]) window_row_[channel] = row;
      if (headroom_[row].name == names[channel] + " rate") rate_row_[channel] = row;
    }
  }
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

void Scope::note(std::size_t row, double value) {
  if (row == no_row || !std::isfinite(value)) return;
  Headroom& room = headroom_[row];
  room.low = room.seen ? std::min(room.low, value) : value;
  room.high = room.seen ? std::max(room.high, value) : value;
  room.seen = true;
}

void Scope::add(const TickSamples& samples) {
  const std::size_t channels = std::min<std::size_t>(channels_, samples.channels);
  const auto ticks = static_cast<double>(samples.tick - last_tick_);
  for (std::size_t channel = 0; channel < channels; ++channel) {
    const double value = samples.values[channel];
    note(window_row_[channel], value);
    if (has_last_ && ticks > 0.0)
      note(rate_row_[channel], (value - last_[channel]) * rate_hz_ / ticks);
    last_[channel] = value;
  }
  last_tick_ = samples.tick;
  has_last_ = true;
  if (samples.tick % stride_ != 0) return;
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
