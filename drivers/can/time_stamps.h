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

  // The counter is known to begin anew, as it does when the interface comes up.
  void restart() noexcept { *this = CounterFit{}; }

 private:
  struct Minimum {
    std::int64_t counter_ns = 0;
    std::int64_t difference_ns = 0;
  };

  void fit() noexcept;
  bool is_new_counter(std::int64_t counter_ns, std::int64_t difference_ns) noexcept;
  std::int64_t difference_at(std::int64_t counter_ns) const noexcept;

  static constexpr std::int64_t window_ns = 1'000'000'000;
  // Farther from the line than any drift takes it between two frames. No frame is seen early: that
  // is a new counter at once. Frames that are all late for longer than the host can have been busy
  // are one, too.
  static constexpr std::int64_t jump_ns = 20'000'000;
  static constexpr std::int64_t busy_ns = 200'000'000;

  std::array<Minimum, 16> minima_{};  // ring of closed windows
  std::size_t count_ = 0;
  Minimum open_{};
  std::int64_t open_since_ns_ = 0;
  std::int64_t last_counter_ns_ = 0;
  std::int64_t late_since_ns_ = 0;  // counter of the first of the late frames, where the last was
  bool late_ = false;
  bool started_ = false;
  std::int64_t reference_ns_ = 0;  // the line: difference = base + drift · (counter − reference)
  std::int64_t base_ns_ = 0;
  double drift_ = 0.0;
};

}  // namespace sinerig::can
