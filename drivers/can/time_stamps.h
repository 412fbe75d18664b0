// Receive time stamps of the kernel and of CAN adapters, in the time base of the loop.
//
// The kernel stamps frames in CLOCK_REALTIME, which can be set; an adapter stamps them by a counter
// of its own with its own beginning and its own rate. Both are brought to CLOCK_MONOTONIC.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace sinerig::can {

std::int64_t monotonic_ns() noexcept;

// CLOCK_REALTIME − CLOCK_MONOTONIC, measured now: one reading of the former between two of the
// latter.
std::int64_t realtime_offset_ns() noexcept;

// Fits offset and drift of an adapter's counter. A frame is seen later than it was stamped, never
// earlier, and sometimes hardly later: the smallest difference of each second lies on the line.
class CounterFit {
 public:
  // `seen_ns` is the kernel's stamp of the same frame, in CLOCK_MONOTONIC. Returns the counter's
  // stamp in CLOCK_MONOTONIC, never later than `seen_ns`.
  std::int64_t to_monotonic(std::int64_t counter_ns, std::int64_t seen_ns) noexcept;

 private:
  struct Minimum {
    std::int64_t counter_ns = 0;
    std::int64_t difference_ns = 0;
  };

  void fit() noexcept;
  void restart() noexcept { *this = CounterFit{}; }

  static constexpr std::int64_t window_ns = 1'000'000'000;
  static constexpr std::int64_t restart_ns = 1'000'000'000;  // a jump this large is a new counter

  std::array<Minimum, 16> minima_{};  // ring of closed windows
  std::size_t count_ = 0;
  Minimum open_{};
  std::int64_t open_since_ns_ = 0;
  std::int64_t last_counter_ns_ = 0;
  bool started_ = false;
  std::int64_t reference_ns_ = 0;  // the line: difference = base + drift · (counter − reference)
  std::int64_t base_ns_ = 0;
  double drift_ = 0.0;
};

}  // namespace sinerig::can
