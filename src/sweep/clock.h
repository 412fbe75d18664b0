// The fixed grid that the loop runs on: absolute deadlines, whole periods skipped on an overrun,
// phase kept. Virtual and monotonic time behind one interface.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>

#include "sweep/nonblocking.h"
#include "sweep/thread_usage.h"

namespace sinerig {

// Tick times of a fixed rate. The rate is a whole number of millihertz, so that the time of any
// tick follows from integers alone.
class TickGrid {
 public:
  static constexpr double min_rate_hz = 0.1;
  static constexpr double max_rate_hz = 100'000.0;

  // Throws std::invalid_argument outside the bounds or off the millihertz grid.
  explicit TickGrid(double rate_hz);

  double rate_hz() const noexcept { return static_cast<double>(rate_mhz_) / 1000.0; }
  double period_s() const noexcept { return 1000.0 / static_cast<double>(rate_mhz_); }

  // Nanoseconds from tick 0 to `index`, rounded down; exact for ever.
  std::int64_t time_ns(std::uint64_t index) const noexcept SINERIG_NONBLOCKING {
    if (whole_period_ns_ != 0) return static_cast<std::int64_t>(index * whole_period_ns_);
    const std::uint64_t milliticks = index * 1000;
    const std::uint64_t seconds = milliticks / rate_mhz_;
    const std::uint64_t rest = milliticks % rate_mhz_;
    return static_cast<std::int64_t>(seconds * 1'000'000'000 + rest * 1'000'000'000 / rate_mhz_);
  }

  // The last tick at or before `time_ns` >= 0.
  std::uint64_t index_at(std::int64_t time_ns) const noexcept SINERIG_NONBLOCKING;

 private:
  std::uint64_t rate_mhz_;
  std::uint64_t whole_period_ns_;  // 0 where the period is no whole number of nanoseconds
};

struct Tick {
  std::uint64_t index = 0;  // position on the grid, never a count of executed loops
  std::chrono::nanoseconds lateness{0};
};

// A point in time as tick and offset, so that grid arithmetic stays exact at every rate.
struct Instant {
  std::uint64_t tick = 0;
  std::int64_t offset_ns = 0;
};

class Clock {
 public:
  explicit Clock(TickGrid grid) : grid_{grid} {}
  virtual ~Clock() = default;
  Clock(const Clock&) = delete;
  Clock& operator=(const Clock&) = delete;

  // Waits for the next tick; the first call returns tick 0. After an overrun the ticks whose period
  // has passed are skipped.
  virtual Tick wait() noexcept SINERIG_NONBLOCKING = 0;

  // The present, between the last tick waited for and the next; tick 0 before the first wait.
  virtual Instant now() const noexcept SINERIG_NONBLOCKING = 0;

  // The time base of Sample::time_ns.
  virtual std::int64_t time_ns(Instant instant) const noexcept SINERIG_NONBLOCKING = 0;

  // Of the calling thread so far; nothing where time is virtual and the machine does not matter.
  virtual std::optional<ThreadUsage> usage() const noexcept SINERIG_NONBLOCKING { return {}; }

  const TickGrid& grid() const noexcept { return grid_; }

 private:
  TickGrid grid_;
};

// Time is a number: every wait succeeds at once and on time.
class VirtualClock final : public Clock {
 public:
  using Clock::Clock;
  Tick wait() noexcept SINERIG_NONBLOCKING override;
  Instant now() const noexcept SINERIG_NONBLOCKING override;
  std::int64_t time_ns(Instant instant) const noexcept SINERIG_NONBLOCKING override;

 private:
  std::uint64_t next_ = 0;
};

// CLOCK_MONOTONIC with absolute deadlines. Steps of the wall clock do not matter; a suspension of
// the machine is a gap of its whole length.
class MonotonicClock final : public Clock {
 public:
  using Clock::Clock;
  Tick wait() noexcept SINERIG_NONBLOCKING override;
  Instant now() const noexcept SINERIG_NONBLOCKING override;
  std::int64_t time_ns(Instant instant) const noexcept SINERIG_NONBLOCKING override;
  std::optional<ThreadUsage> usage() const noexcept SINERIG_NONBLOCKING override;

 private:
  void note_suspension(std::int64_t asleep_ns) noexcept SINERIG_NONBLOCKING;

  std::int64_t origin_ns_ = 0;  // CLOCK_MONOTONIC at tick 0; 0 before the first wait
  std::int64_t asleep_ns_ = 0;  // CLOCK_BOOTTIME − CLOCK_MONOTONIC, the largest seen
  std::uint64_t last_ = 0;
};

}  // namespace sinerig
