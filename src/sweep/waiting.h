// How whoever waits for a device outside of the loop stays answerable: a stop request ends the
// waiting, and each turn of it is progress, which a standstill is not.
#pragma once

#include <cstdint>
#include <stdexcept>

#include "sweep/run_control.h"

namespace sinerig {

// Out of a list or an exchange outside of the loop; nothing is wrong with the device.
class StopRequested : public std::runtime_error {
 public:
  StopRequested() : std::runtime_error{"a stop was requested"} {}
};

class Waiting {
 public:
  // The longest that a turn should take.
  static constexpr std::int64_t turn_ns = 50'000'000;

  Waiting() = default;  // nobody asks, nobody looks
  explicit Waiting(RunControl& control) : control_{&control} {}

  // For ways out, which nothing cuts short.
  Waiting to_the_end() const noexcept {
    Waiting waiting{*this};
    waiting.stoppable_ = false;
    return waiting;
  }

  // Once a turn. False where a stop is requested, or a veto stands: to whoever waits that is a
  // stop, too.
  bool may_go_on() const noexcept;
  // The same. Throws StopRequested.
  void go_on() const;

  // Turn by turn. False where a stop was requested meanwhile.
  bool pause_for(std::int64_t time_ns) const noexcept;

 private:
  RunControl* control_ = nullptr;
  bool stoppable_ = true;
};

}  // namespace sinerig
