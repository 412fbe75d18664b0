// A clock that lets others see how late the loop is: two relaxed stores a tick, nobody waits.
#pragma once

#include <atomic>
#include <cstdint>

#include "sweep/clock.h"

namespace sinerig::dashboard {

// Written by the loop's thread, read by any.
struct Lateness {
  std::atomic<std::int64_t> last_ns{0};
  std::atomic<std::int64_t> max_ns{0};
  std::atomic<std::uint64_t> tick{0};
  std::atomic<std::uint64_t> skipped{0};
};

class WatchedClock final : public Clock {
 public:
  WatchedClock(Clock& clock, Lateness& lateness)
      : Clock{clock.grid()}, clock_{clock}, lateness_{lateness} {}

  Tick wait() noexcept SINERIG_NONBLOCKING override {
    const Tick tick = clock_.wait();
    const std::int64_t late_ns = tick.lateness.count();
    if (late_ns > max_ns_) max_ns_ = late_ns;
    if (begun_) skipped_ += tick.index - last_ - 1;
    begun_ = true;
    last_ = tick.index;
    lateness_.last_ns.store(late_ns, std::memory_order_relaxed);
    lateness_.max_ns.store(max_ns_, std::memory_order_relaxed);
    lateness_.tick.store(tick.index, std::memory_order_relaxed);
    lateness_.skipped.store(skipped_, std::memory_order_relaxed);
    return tick;
  }
  Instant now() const noexcept SINERIG_NONBLOCKING override { return clock_.now(); }
  std::int64_t time_ns(Instant instant) const noexcept SINERIG_NONBLOCKING override {
    return clock_.time_ns(instant);
  }
  std::optional<ThreadUsage> usage() const noexcept SINERIG_NONBLOCKING override {
    return clock_.usage();
  }

 private:
  Clock& clock_;
  Lateness& lateness_;
  std::int64_t max_ns_ = 0;
  std::uint64_t last_ = 0;
  std::uint64_t skipped_ = 0;
  bool begun_ = false;
};

}  // namespace sinerig::dashboard
