#include "sweep/clock.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <ctime>
#include <stdexcept>

#include <sys/resource.h>

namespace sinerig {

namespace {

constexpr std::int64_t ns_per_s = 1'000'000'000;

// Shorter than any suspension, longer than two readings of one clock differ by.
constexpr std::int64_t least_suspension_ns = 10'000'000;

std::int64_t read_ns(clockid_t clock) noexcept {
  timespec now{};
  clock_gettime(clock, &now);
  return static_cast<std::int64_t>(now.tv_sec) * ns_per_s + now.tv_nsec;
}

std::int64_t monotonic_ns() noexcept {
  return read_ns(CLOCK_MONOTONIC);
}

void sleep_until(std::int64_t time_ns) noexcept {
  const SystemCall waits_by_design;
  const timespec deadline{.tv_sec = time_ns / ns_per_s, .tv_nsec = time_ns % ns_per_s};
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &deadline, nullptr) == EINTR) {
  }
}

}  // namespace

TickGrid::TickGrid(double rate_hz) {
  if (!(rate_hz >= min_rate_hz) || !(rate_hz <= max_rate_hz)) {
    throw std::invalid_argument("the loop rate must be between 0.1 Hz and 100 kHz");
  }
  const double millihertz = std::round(rate_hz * 1000.0);
  if (std::abs(millihertz - rate_hz * 1000.0) > 1e-6) {
    throw std::invalid_argument("the loop rate must be a whole number of millihertz");
  }
  constexpr std::uint64_t ns_per_millitick = 1'000'000'000'000;
  rate_mhz_ = static_cast<std::uint64_t>(millihertz);
  whole_period_ns_ = ns_per_millitick % rate_mhz_ == 0 ? ns_per_millitick / rate_mhz_ : 0;
}

std::uint64_t TickGrid::index_at(std::int64_t time_ns) const noexcept {
  const auto elapsed = static_cast<std::uint64_t>(time_ns);
  const std::uint64_t seconds = elapsed / ns_per_s;
  const std::uint64_t rest = elapsed % ns_per_s;
  // time_ns() rounds down, so the guess can be one tick low.
  std::uint64_t index = (seconds * rate_mhz_ + rest * rate_mhz_ / ns_per_s) / 1000;
  while (this->time_ns(index + 1) <= time_ns) ++index;
  return index;
}

Tick VirtualClock::wait() noexcept {
  return {.index = next_++, .lateness = {}};
}

Instant VirtualClock::now() const noexcept {
  return {.tick = next_ == 0 ? 0 : next_ - 1, .offset_ns = 0};
}

std::int64_t VirtualClock::time_ns(Instant instant) const noexcept {
  return grid().time_ns(instant.tick) + instant.offset_ns;
}

Tick MonotonicClock::wait() noexcept {
  if (origin_ns_ == 0) {
    constexpr int readings = 3;
    for (int n = 0; n < readings; ++n) {
      const std::int64_t boot_ns = read_ns(CLOCK_BOOTTIME);
      origin_ns_ = monotonic_ns();
      asleep_ns_ = std::max(asleep_ns_, boot_ns - origin_ns_);
    }
    return {};
  }
  std::uint64_t index = last_ + 1;
  const std::int64_t deadline_ns = origin_ns_ + grid().time_ns(index);
  if (monotonic_ns() < deadline_ns) sleep_until(deadline_ns);
  const std::int64_t boot_ns = read_ns(CLOCK_BOOTTIME);
  const std::int64_t now_ns = monotonic_ns();
  note_suspension(boot_ns - now_ns);
  const std::int64_t elapsed_ns = now_ns - origin_ns_;
  if (elapsed_ns >= grid().time_ns(index + 1)) index = grid().index_at(elapsed_ns);
  last_ = index;
  return {.index = index, .lateness = std::chrono::nanoseconds{elapsed_ns - grid().time_ns(index)}};
}

// CLOCK_MONOTONIC stands still while the machine sleeps, the mechanism does not: the time asleep
// becomes a gap. CLOCK_BOOTTIME is read first, so that an interruption between the two readings
// makes the sum smaller, never larger.
void MonotonicClock::note_suspension(std::int64_t asleep_ns) noexcept {
  const std::int64_t slept_ns = asleep_ns - asleep_ns_;
  if (slept_ns > least_suspension_ns) origin_ns_ -= slept_ns;
  asleep_ns_ = std::max(asleep_ns_, asleep_ns);
}

Instant MonotonicClock::now() const noexcept {
  if (origin_ns_ == 0) return {};
  return {.tick = last_, .offset_ns = monotonic_ns() - origin_ns_ - grid().time_ns(last_)};
}

std::int64_t MonotonicClock::time_ns(Instant instant) const noexcept {
  return origin_ns_ + grid().time_ns(instant.tick) + instant.offset_ns;
}

std::optional<ThreadUsage> MonotonicClock::usage() const noexcept {
  rusage usage{};
  const SystemCall reads_counters;
  if (getrusage(RUSAGE_THREAD, &usage) != 0) return {};
  return ThreadUsage{.minor_faults = static_cast<std::uint64_t>(usage.ru_minflt),
                     .major_faults = static_cast<std::uint64_t>(usage.ru_majflt),
                     .involuntary_switches = static_cast<std::uint64_t>(usage.ru_nivcsw)};
}

}  // namespace sinerig
