#include "realtime/latency.h"

#include <algorithm>
#include <cmath>

#include "sweep/clock.h"

namespace sinerig::realtime {

LatencyHistogram::LatencyHistogram() : counts_(bins) {}

void LatencyHistogram::add(std::int64_t latency_ns) noexcept {
  const std::int64_t microseconds = std::max<std::int64_t>(latency_ns, 0) / 1000;
  ++counts_[std::min(static_cast<std::size_t>(microseconds), bins - 1)];
  ++count_;
  max_ns_ = std::max(max_ns_, latency_ns);
}

void LatencyHistogram::add_bin(std::size_t microseconds, std::uint64_t count) noexcept {
  if (count == 0) return;
  counts_[std::min(microseconds, bins - 1)] += count;
  count_ += count;
  max_ns_ = std::max(max_ns_, static_cast<std::int64_t>(microseconds) * 1000);
}

void LatencyHistogram::merge(const LatencyHistogram& other) noexcept {
  for (std::size_t i = 0; i < bins; ++i) counts_[i] += other.counts_[i];
  count_ += other.count_;
  max_ns_ = std::max(max_ns_, other.max_ns_);
}

double LatencyHistogram::quantile_us(double part) const noexcept {
  const auto wanted = static_cast<std::uint64_t>(std::ceil(part * static_cast<double>(count_)));
  std::uint64_t seen = 0;
  for (std::size_t i = 0; i < bins; ++i) {
    seen += counts_[i];
    if (seen >= wanted && seen > 0) return static_cast<double>(i);
  }
  return 0.0;
}

std::vector<std::pair<std::size_t, std::uint64_t>> LatencyHistogram::filled_bins() const {
  std::vector<std::pair<std::size_t, std::uint64_t>> filled;
  for (std::size_t i = 0; i < bins; ++i) {
    if (counts_[i] > 0) filled.emplace_back(i, counts_[i]);
  }
  return filled;
}

std::int64_t latency_ns(const TickGrid& grid, std::uint64_t last, const Tick& tick) noexcept {
  return grid.time_ns(tick.index) + tick.lateness.count() - grid.time_ns(last + 1);
}

WakeUps measure_wake_ups(LoopThread& thread, double rate_hz, std::uint64_t wake_ups) {
  WakeUps result;
  MonotonicClock clock{TickGrid{rate_hz}};
  const auto loop = [&]() noexcept {
    clock.wait();
    const ThreadUsage before = clock.usage().value_or(ThreadUsage{});
    std::uint64_t last = 0;
    for (std::uint64_t i = 0; i < wake_ups; ++i) {
      const Tick tick = clock.wait();
      result.latency.add(latency_ns(clock.grid(), last, tick));
      result.skipped += tick.index - last - 1;
      last = tick.index;
    }
    result.usage = clock.usage().value_or(ThreadUsage{}) - before;
  };
  thread.start(loop, {});
  thread.join();
  return result;
}

}  // namespace sinerig::realtime
