#include "drivers/can/time_stamps.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <limits>
#include <utility>

namespace sinerig::can {
namespace {

std::int64_t read_clock(clockid_t clock) noexcept {
  timespec time{};
  clock_gettime(clock, &time);
  return std::int64_t{time.tv_sec} * 1'000'000'000 + time.tv_nsec;
}

}  // namespace

std::int64_t monotonic_ns() noexcept {
  return read_clock(CLOCK_MONOTONIC);
}

Clocks read_clocks() noexcept {
  constexpr int readings = 4;
  constexpr std::int64_t undisturbed_ns = 20'000;
  Clocks closest;
  std::int64_t shortest_ns = std::numeric_limits<std::int64_t>::max();
  for (int n = 0; n < readings && shortest_ns > undisturbed_ns; ++n) {
    const std::int64_t before_ns = read_clock(CLOCK_MONOTONIC);
    const std::int64_t real_ns = read_clock(CLOCK_REALTIME);
    const std::int64_t after_ns = read_clock(CLOCK_MONOTONIC);
    if (after_ns - before_ns >= shortest_ns) continue;
    shortest_ns = after_ns - before_ns;
    closest = {.monotonic_ns = after_ns,
               .realtime_offset_ns = real_ns - (before_ns + shortest_ns / 2)};
  }
  return closest;
}

std::int64_t CounterFit::to_monotonic(std::int64_t counter_ns, std::int64_t seen_ns) noexcept {
  const std::int64_t difference_ns = seen_ns - counter_ns;
  if (started_ && is_new_counter(counter_ns, difference_ns)) restart();
  if (!started_) {
    started_ = true;
    open_since_ns_ = counter_ns;
    open_ = {counter_ns, difference_ns};
    fit();
  }
  last_counter_ns_ = counter_ns;

  if (counter_ns - open_since_ns_ >= window_ns) {
    minima_[count_ % minima_.size()] = open_;
    ++count_;
    open_since_ns_ = counter_ns;
    open_ = {counter_ns, difference_ns};
    fit();
  } else if (difference_ns < open_.difference_ns) {
    open_ = {counter_ns, difference_ns};
    if (count_ < 2) fit();
  }

  return on_line(counter_ns, seen_ns);
}

std::int64_t CounterFit::on_line(std::int64_t counter_ns, std::int64_t seen_ns) const noexcept {
  return started_ ? std::min(counter_ns + difference_at(counter_ns), seen_ns) : seen_ns;
}

std::int64_t CounterFit::difference_at(std::int64_t counter_ns) const noexcept {
  const double drifted = drift_ * static_cast<double>(counter_ns - reference_ns_);
  return base_ns_ + std::llround(drifted);
}

bool CounterFit::is_new_counter(std::int64_t counter_ns, std::int64_t difference_ns) noexcept {
  const std::int64_t late_ns = difference_ns - difference_at(counter_ns);
  if (counter_ns < last_counter_ns_ || late_ns < -jump_ns) return true;
  const bool was_late = std::exchange(late_, late_ns > jump_ns);
  if (late_ && !was_late) late_since_ns_ = counter_ns;
  return late_ && counter_ns - late_since_ns_ > busy_ns;
}

// Until two windows are closed there is no drift to speak of: the smallest difference so far
// stands.
void CounterFit::fit() noexcept {
  const std::size_t known = std::min(count_, minima_.size());
  if (known < 2) {
    const bool open_is_lower = known == 0 || open_.difference_ns < minima_[0].difference_ns;
    const Minimum& lowest = open_is_lower ? open_ : minima_[0];
    reference_ns_ = lowest.counter_ns;
    base_ns_ = lowest.difference_ns;
    drift_ = 0.0;
    return;
  }
  const Minimum& origin = minima_[(count_ - 1) % minima_.size()];
  double sum_x = 0.0;
  double sum_y = 0.0;
  for (std::size_t n = 0; n < known; ++n) {
    sum_x += static_cast<double>(minima_[n].counter_ns - origin.counter_ns);
    sum_y += static_cast<double>(minima_[n].difference_ns - origin.difference_ns);
  }
  const double mean_x = sum_x / static_cast<double>(known);
  const double mean_y = sum_y / static_cast<double>(known);
  double sum_xx = 0.0;
  double sum_xy = 0.0;
  for (std::size_t n = 0; n < known; ++n) {
    const double x = static_cast<double>(minima_[n].counter_ns - origin.counter_ns) - mean_x;
    const double y = static_cast<double>(minima_[n].difference_ns - origin.difference_ns) - mean_y;
    sum_xx += x * x;
    sum_xy += x * y;
  }
  drift_ = sum_xx > 0.0 ? sum_xy / sum_xx : 0.0;
  reference_ns_ = origin.counter_ns;
  base_ns_ = origin.difference_ns + std::llround(mean_y - drift_ * mean_x);
}

// The offset is that of after the frame was received: a step since the last one shows, and so does
// one between stamp and reading.
std::int64_t ArrivalTimes::of(const Stamps& stamps, const Clocks& received) noexcept {
  const std::int64_t offset_ns = received.realtime_offset_ns;
  if (offset_ns_ && std::abs(offset_ns - *offset_ns_) > step_ns) clock_was_set_ = true;
  offset_ns_ = offset_ns;
  const bool is_known = stamps.kernel_ns != 0 && !clock_was_set_;
  const std::int64_t seen_ns = is_known ? stamps.kernel_ns - offset_ns : received.monotonic_ns;
  if (stamps.adapter_ns == 0) return seen_ns;
  return clock_was_set_ ? counter_fit_.on_line(stamps.adapter_ns, seen_ns)
                        : counter_fit_.to_monotonic(stamps.adapter_ns, seen_ns);
}

}  // namespace sinerig::can
