#include "cli/channel_check.h"

#include <algorithm>
#include <cmath>

namespace sinerig::cli {

namespace {

double seconds_of(std::int64_t ns) {
  return 1e-9 * static_cast<double>(ns);
}

// `part` of the values are at or below the result.
std::int64_t quantile(std::vector<std::int64_t>& values, double part) {
  if (values.empty()) return 0;
  const auto last = static_cast<double>(values.size() - 1);
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(std::llround(part * last));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

struct Series {
  std::vector<std::int64_t> ages_ns;
  std::vector<std::int64_t> times_ns;
};

void evaluate(Series& series, ChannelCheck& check) {
  check.age_median_s = seconds_of(quantile(series.ages_ns, 0.5));
  check.age_99_s = seconds_of(quantile(series.ages_ns, 0.99));
  check.age_most_s = seconds_of(quantile(series.ages_ns, 1.0));
  const std::vector<std::int64_t>& times = series.times_ns;
  if (times.size() < 3) return;
  std::vector<std::int64_t> distances;
  for (std::size_t i = 1; i < times.size(); ++i) distances.push_back(times[i] - times[i - 1]);
  std::vector<std::int64_t> sorted = distances;
  const double usual_s = seconds_of(quantile(sorted, 0.5));
  if (!(usual_s > 0.0)) return;
  double squares = 0.0;
  double counted = 0.0;
  for (const std::int64_t distance : distances) {
    const double steps = std::max(1.0, std::round(seconds_of(distance) / usual_s));
    check.lost += static_cast<std::uint64_t>(steps - 1.0);
    if (steps > 1.0) continue;
    squares += std::pow(seconds_of(distance) - usual_s, 2);
    counted += 1.0;
  }
  check.jitter_s = std::sqrt(squares / std::max(1.0, counted));
  check.rate_hz = static_cast<double>(times.size() - 1) / seconds_of(times.back() - times.front());
}

std::vector<Guard> guards_of(const GuardSettings& settings, double period_s) {
  std::vector<Guard> guards;
  for (const ChannelLimits& limits : settings.channels) {
    GuardSettings alone = settings;
    alone.channels = {limits};
    guards.emplace_back(alone, period_s);
  }
  return guards;
}

}  // namespace

RigCheck check_channels(Clock& clock, std::span<Sensor* const> sensors, const GuardSettings& guard,
                        double seconds, const std::atomic<bool>& stop) {
  const auto ticks = static_cast<std::uint64_t>(std::ceil(seconds * clock.grid().rate_hz()));
  RigCheck check;
  check.channels.resize(sensors.size());
  std::vector<Guard> guards = guards_of(guard, clock.grid().period_s());
  std::vector<Series> series(sensors.size());
  for (Series& each : series) {
    each.ages_ns.reserve(ticks);
    each.times_ns.reserve(ticks);
  }
  std::vector<std::int64_t> lateness_ns;
  lateness_ns.reserve(ticks);
  std::uint64_t next = 0;
  while (next < ticks && !stop.load()) {
    const Tick tick = clock.wait();
    check.loop.skipped += tick.index - next;
    next = tick.index + 1;
    ++check.loop.ticks;
    lateness_ns.push_back(tick.lateness.count());
    for (std::size_t i = 0; i < sensors.size(); ++i) {
      const Sample sample = sensors[i]->read();
      const std::int64_t now_ns = clock.time_ns(clock.now());
      guards[i].observe(0, sample, now_ns, tick.index);
      ChannelCheck& channel = check.channels[i];
      ++channel.faults[static_cast<std::size_t>(sample.fault)];
      if (sample.fault != Fault::none) continue;
      ++channel.samples;
      channel.last_value = sample.value;
      series[i].ages_ns.push_back(now_ns - sample.time_ns);
      series[i].times_ns.push_back(sample.time_ns);
    }
  }
  check.loop.lateness_99_s = seconds_of(quantile(lateness_ns, 0.99));
  check.loop.lateness_most_s = seconds_of(quantile(lateness_ns, 1.0));
  for (std::size_t i = 0; i < sensors.size(); ++i) {
    evaluate(series[i], check.channels[i]);
    check.channels[i].trip = guards[i].trip();
  }
  return check;
}

}  // namespace sinerig::cli
