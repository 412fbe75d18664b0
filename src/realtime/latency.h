// How late a thread wakes up, by the method of cyclictest: sleep until an absolute time on a fixed
// grid, read the clock, subtract.
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "realtime/loop_thread.h"
#include "sweep/clock.h"
#include "sweep/thread_usage.h"

namespace sinerig::realtime {

// Latencies in bins of 1 µs, as cyclictest counts them: a latency belongs to the whole microseconds
// that it has completed.
class LatencyHistogram {
 public:
  LatencyHistogram();

  void add(std::int64_t latency_ns) noexcept SINERIG_NONBLOCKING;

  std::uint64_t count() const noexcept { return count_; }
  double max_us() const noexcept { return static_cast<double>(max_ns_) * 1e-3; }

  // The least number of µs that at least the part `part` of all stay at or below; 0 without any.
  double quantile_us(double part) const noexcept;

  // From the bins of another program.
  void add_bin(std::size_t microseconds, std::uint64_t count) noexcept;
  void merge(const LatencyHistogram& other) noexcept;

  // Microseconds and count of each bin that holds something, rising.
  std::vector<std::pair<std::size_t, std::uint64_t>> filled_bins() const;

 private:
  static constexpr std::size_t bins = 100'000;  // the last one holds all that is longer

  std::vector<std::uint64_t> counts_;
  std::uint64_t count_ = 0;
  std::int64_t max_ns_ = 0;
};

// From the time for which the thread had asked, the tick after `last`, to when it woke, however
// many ticks were skipped over it: the lateness of a tick alone never says more than a period.
std::int64_t latency_ns(const TickGrid& grid, std::uint64_t last,
                        const Tick& tick) noexcept SINERIG_NONBLOCKING;

struct WakeUps {
  LatencyHistogram latency;
  std::uint64_t skipped = 0;  // periods that a wake-up came too late for
  ThreadUsage usage;          // of the thread from the first to the last
};

// Starts the thread with the loop's own clock at `rate_hz` (bounds of TickGrid), waits until it has
// woken `wake_ups` times. `thread` has not been started yet.
WakeUps measure_wake_ups(LoopThread& thread, double rate_hz, std::uint64_t wake_ups);

}  // namespace sinerig::realtime
