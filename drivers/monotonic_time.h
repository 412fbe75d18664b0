// The time base of drivers on hardware: that of MonotonicClock.
#pragma once

#include <cstdint>
#include <ctime>

namespace sinerig {

inline std::int64_t monotonic_now_ns() noexcept {
  timespec time{};
  clock_gettime(CLOCK_MONOTONIC, &time);
  return std::int64_t{time.tv_sec} * 1'000'000'000 + time.tv_nsec;
}

}  // namespace sinerig
