#include "cli/channel_check.h"

#include <algorithm>
#include <cmath>

namespace sinerig::cli {

namespace {

double seconds_of(std::int64_t ns) {
  return 1e-9 * static_cast<double>(ns);
}

// At 10 kHz half a minute of each.
constexpr std::size_t room = std::size_t{1} << 18U;

// `part` of the values are at or below the result.
std::int64_t quantile(std::vector<std::int64_t> values, double part) {
  if (values.empty()) return 0;
  const auto last = static_cast<double>(values.size() - 1);
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(std::llround(part * last));
  std::nth_element(values.begin(), at, values.end());
  return *at;
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

void ThinnedSeries::add(std::int64_t value) noexcept {
  most_ = std::max(most_, value);
  if (count_++ % every_ != 0) return;
  if (values_.size() == values_.capacity()) {
    for (std::size_t i = 0; 2 * i < values_.size(); ++i) values_[i] = values_[2 * i];
    values_.resize((values_.size() + 1) / 2);
    every_ *= 2;
    if ((count_ - 1) % every_ != 0) return;
  }
  values_.push_back(value);
}

void DistanceCounts::add(std::int64_t distance_ns) noexcept {
  const double bin = 100.0 * std::log(static_cast<double>(std::max<std::int64_t>(distance_ns, 1)));
  ++counts_[std::min(static_cast<std::size_t>(std::lround(bin)), bins - 1)];
}

std::uint64_t DistanceCounts::missing(double usual_ns) const noexcept {
  double missing = 0.0;
  for (std::size_t bin = 0; bin < bins; ++bin) {
    if (counts_[bin] == 0) continue;
    const double distance_ns = std::exp(0.01 * static_cast<double>(bin));
    const double steps = std::max(1.0, std::round(distance_ns / usual_ns));
    missing += (steps - 1.0) * static_cast<double>(counts_[bin]);
  }
  return static_cast<std::uint64_t>(missing);
}

ChannelCheckRun::Series::Series() : ages_ns{room}, distances_ns{room} {}

void ChannelCheckRun::Series::note(const Sample& sample, std::int64_t now_ns) noexcept {
  const bool first = ages_ns.count() == 0;
  ages_ns.add(now_ns - sample.time_ns);
  if (first) {
    first_ns = sample.time_ns;
  } else {
    distances_ns.add(sample.time_ns - last_ns);
    counts.add(sample.time_ns - last_ns);
  }
  last_ns = sample.time_ns;
}

ChannelCheckRun::ChannelCheckRun(Clock& clock, std::span<Sensor* const> sensors,
                                 const GuardSettings& guard)
    : clock_{clock},
      sensors_{sensors.begin(), sensors.end()},
      guards_{guards_of(guard, clock.grid().period_s())},
      series_(sensors.size()),
      lateness_ns_{room} {
  check_.channels.resize(sensors.size());
}

void ChannelCheckRun::read(double seconds, const RunControl& control) noexcept {
  const auto ticks = static_cast<std::uint64_t>(std::ceil(seconds * clock_.grid().rate_hz()));
  std::uint64_t next = 0;
  while (next < ticks && control.stop_requests.load(std::memory_order_relaxed) == 0) {
    const Tick tick = clock_.wait();
    check_.loop.skipped += tick.index - next;
    next = tick.index + 1;
    ++check_.loop.ticks;
    lateness_ns_.add(tick.lateness.count());
    for (std::size_t i = 0; i < sensors_.size(); ++i) {
      const Sample sample = sensors_[i]->read();
      const std::int64_t now_ns = clock_.time_ns(clock_.now());
      guards_[i].observe(0, sample, now_ns, tick.index);
      ChannelCheck& channel = check_.channels[i];
      ++channel.faults[static_cast<std::size_t>(sample.fault)];
      if (sample.fault != Fault::none) continue;
      ++channel.samples;
      channel.last_value = sample.value;
      series_[i].note(sample, now_ns);
    }
  }
}

void ChannelCheckRun::evaluate(const Series& series, ChannelCheck& check) {
  const std::vector<std::int64_t>& ages = series.ages_ns.values();
  check.age_median_s = seconds_of(quantile(ages, 0.5));
  check.age_99_s = seconds_of(quantile(ages, 0.99));
  check.age_most_s = seconds_of(series.ages_ns.most());
  const std::vector<std::int64_t>& distances = series.distances_ns.values();
  if (distances.size() < 2) return;
  const auto usual_ns = static_cast<double>(quantile(distances, 0.5));
  if (!(usual_ns > 0.0)) return;
  check.lost = series.counts.missing(usual_ns);
  double squares = 0.0;
  double counted = 0.0;
  for (const std::int64_t distance : distances) {
    const auto distance_ns = static_cast<double>(distance);
    if (std::round(distance_ns / usual_ns) > 1.0) continue;
    squares += std::pow(1e-9 * (distance_ns - usual_ns), 2);
    counted += 1.0;
  }
  check.jitter_s = std::sqrt(squares / std::max(1.0, counted));
  check.rate_hz = static_cast<double>(series.distances_ns.count()) /
                  seconds_of(series.last_ns - series.first_ns);
}

RigCheck ChannelCheckRun::evaluate() const {
  RigCheck check = check_;
  check.loop.lateness_99_s = seconds_of(quantile(lateness_ns_.values(), 0.99));
  check.loop.lateness_most_s = seconds_of(lateness_ns_.most());
  for (std::size_t i = 0; i < series_.size(); ++i) {
    evaluate(series_[i], check.channels[i]);
    check.channels[i].trip = guards_[i].trip();
  }
  return check;
}

}  // namespace sinerig::cli
