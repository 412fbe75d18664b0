// How late the loop is, tick by tick, for the benchmarks that run it in real time.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "realtime/latency.h"
#include "sweep/clock.h"
#include "sweep/run_control.h"

namespace sinerig::bench {

// Each bin's latencies spread evenly over its microsecond: those of cyclictest have the same bins.
double quantile_us(const realtime::LatencyHistogram& histogram, double part);

// The latencies of each round.
using Rounds = std::vector<realtime::LatencyHistogram>;

realtime::LatencyHistogram merged(const Rounds& rounds);

// Of two quantiles, with its 95 % interval.
struct Ratio {
  static constexpr double goal = 1.1;  // at most

  double value = 0.0;
  double least = 0.0;
  double most = 0.0;

  bool surely_above() const { return least > goal; }
  const char* mark() const { return surely_above() ? "!" : most > goal ? "?" : " "; }
};

inline constexpr std::array parts{0.5, 0.99, 0.999};

// Ratios of the quantiles `parts` of two contenders that took turns, as many rounds each.
std::array<Ratio, parts.size()> ratios(const Rounds& ours, const Rounds& theirs);

// Notes how late each tick is, and asks for the end after so many.
class NotingClock final : public Clock {
 public:
  NotingClock(double rate_hz, std::uint64_t ticks, RunControl& control)
      : Clock{TickGrid{rate_hz}}, left_{ticks + 1}, control_{control} {}
  Tick wait() noexcept SINERIG_NONBLOCKING override {
    const Tick tick = clock_.wait();
    if (tick.index > 0) latency.add(realtime::latency_ns(grid(), last_, tick));
    last_ = tick.index;
    if (--left_ == 0) control_.stop_requests.store(2, std::memory_order_relaxed);
    return tick;
  }
  Instant now() const noexcept SINERIG_NONBLOCKING override { return clock_.now(); }
  std::int64_t time_ns(Instant instant) const noexcept SINERIG_NONBLOCKING override {
    return clock_.time_ns(instant);
  }
  std::optional<ThreadUsage> usage() const noexcept SINERIG_NONBLOCKING override {
    return clock_.usage();
  }

  realtime::LatencyHistogram latency;

 private:
  MonotonicClock clock_{grid()};
  std::uint64_t left_;
  std::uint64_t last_ = 0;
  RunControl& control_;
};

}  // namespace sinerig::bench
