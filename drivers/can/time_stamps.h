// Receive time stamps of the kernel and of CAN adapters, in the time base of the loop.
//
// The kernel stamps frames in CLOCK_REALTIME, which can be set; an adapter stamps them by a counter
// of its own with its own beginning and its own rate. Both are brought to CLOCK_MONOTONIC, across a
// step of the wall clock, too.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace sinerig::can {

std::int64_t monotonic_ns() noexcept;

struct Clocks {
  std::int64_t monotonic_ns = 0;
  std::int64_t realtime_offset_ns = 0;  // CLOCK_REALTIME − CLOCK_MONOTONIC
};

// Both now: a reading of CLOCK_REALTIME between two of CLOCK_MONOTONIC, the closest of a few such.
Clocks read_clocks() noexcept;

// Fits offset and drift of an adapter's counter. A frame is seen later than it was stamped, never
// earlier, and sometimes hardly later: the smallest difference of each second lies on the line.
class CounterFit {
 public:
  // `seen_ns` is the kernel's stamp of the same frame, in CLOCK_MONOTONIC. Returns the counter's
  // stamp in CLOCK_MONOTONIC, never later than `seen_ns`.
  std::int64_t to_monotonic(std::int64_t counter_ns, std::int64_t seen_ns) noexcept;

  // The same by the line as it is, for a frame whose `seen_ns` is not to be believed.
  std::int64_t on_line(std::int64_t counter_ns, std::int64_t seen_ns) const noexcept;

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

// Of one frame; 0 where there is none.
struct Stamps {
  std::int64_t kernel_ns = 0;  // CLOCK_REALTIME as it was then
  std::int64_t adapter_ns = 0;
};

// When the frames of one socket arrived. Which of those that waited in its queue while the wall
// clock was set were stamped before, nobody knows: they count as arrived when they are received, or
// when the adapter says, and the line of its counter does not hear of them.
class ArrivalTimes {
 public:
  ArrivalTimes() = default;
  explicit ArrivalTimes(const Clocks& opened) : offset_ns_{opened.realtime_offset_ns} {}

  // CLOCK_MONOTONIC. `received`: the clocks right after the frame was received.
  std::int64_t of(const Stamps& stamps, const Clocks& received) noexcept;

  // Whatever comes from now on is stamped from now on.
  void queue_is_empty() noexcept { clock_was_set_ = false; }

  // The interface went down: the adapter's counter begins anew with it.
  void restart() noexcept { counter_fit_.restart(); }

 private:
  // Farther than two readings of an undisturbed offset are apart; what is less misdates by less.
  static constexpr std::int64_t step_ns = 1'000'000;

  std::optional<std::int64_t> offset_ns_;  // when the last frame was received
  bool clock_was_set_ = false;             // while frames waited that are not all received yet
  CounterFit counter_fit_;
};

}  // namespace sinerig::can
