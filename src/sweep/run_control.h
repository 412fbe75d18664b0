// Shared between the loop and whoever watches or stops it.
#pragma once

#include <atomic>
#include <cstdint>

namespace sinerig {

// Something that forbids what is waited for: an interlock.
class Veto {
 public:
  virtual ~Veto() = default;
  virtual bool stands() noexcept = 0;
};

struct RunControl {
  std::atomic<int> stop_requests{0};  // 1: ramp down, 2: neutral at once
  std::atomic<std::uint32_t> dwell{0};
  std::atomic<std::uint64_t> tick{0};
  std::atomic<std::uint64_t> turns{0};  // of waiting for a device, outside of the loop
  std::atomic<Veto*> veto{nullptr};     // asked at each of these turns; null: none

  // Moves on for as long as somebody gets on with the run.
  std::uint64_t progress() const noexcept {
    return tick.load(std::memory_order_relaxed) + turns.load(std::memory_order_relaxed);
  }
};

}  // namespace sinerig
