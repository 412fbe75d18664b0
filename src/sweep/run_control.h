// Shared between the loop and whoever watches or stops it.
#pragma once

#include <atomic>
#include <cstdint>

namespace sinerig {

struct RunControl {
  std::atomic<int> stop_requests{0};  // 1: ramp down, 2: neutral at once
  std::atomic<std::uint32_t> dwell{0};
  std::atomic<std::uint64_t> tick{0};
};

}  // namespace sinerig
