// The drive behind the registers. Written from the Modbus specification, not with the driver's
// codec, so that the two check each other.
//
//   register  holds
//   0         control: 0 off, 1 on, 2 clears a fault
//   16        torque set-point, Nm / torque_scale, in up to 4 registers
//   32        state: 0 off, 1 on, 2 tripped
//   33        error: 0 none, 1 watchdog, 2 failed
//   34        position, rad / position_scale
//   38        velocity, rad/s / velocity_scale
//   42        torque that acts, Nm / torque_scale
//
// The same numbers are input registers.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "sim/modbus_drive/settings.h"
#include "sim/motor.h"

namespace sinerig::sim {

using Bytes = std::vector<std::uint8_t>;

class Drive {
 public:
  Drive(const DriveSettings& settings, std::int64_t start_ns);

  // The reply to a request (function code and data) that was complete at `time_ns`.
  Bytes answer(std::span<const std::uint8_t> pdu, std::int64_t time_ns);

  void watch(std::int64_t now_ns);  // trips when requests have ceased
  void trip(std::int64_t now_ns) { stop(tripped, failed, now_ns); }
  void lose_power(std::int64_t now_ns);

  enum State : std::uint16_t { off = 0, on_ = 1, tripped = 2 };

  // What it has become, when, and the set-point in its registers then, Nm. The first thousand.
  struct Change {
    std::int64_t time_ns = 0;
    State state = off;
    double set_point = 0.0;
  };
  const std::vector<Change>& changes() const { return changes_; }

 private:
  enum Error : std::uint16_t { none = 0, watchdog = 1, failed = 2 };
  static constexpr std::size_t count = 64;
  static constexpr std::size_t most_changes = 1000;

  void become(State state, std::int64_t time_ns);
  void stop(State state, std::uint16_t error, std::int64_t time_ns);
  bool writable(std::size_t first, std::size_t words) const;
  std::uint8_t write(std::size_t first, std::span<const std::uint8_t> words, std::int64_t time_ns);
  Bytes read(std::uint8_t function, std::size_t first, std::size_t words, std::int64_t time_ns);
  void refresh(std::int64_t time_ns);
  void put(std::size_t first, double value, double scale);
  double get(std::size_t first, double scale) const;

  const DriveSettings& settings_;
  Motor motor_;
  std::array<std::uint16_t, count> registers_{};
  State state_ = off;
  std::uint16_t error_ = none;
  std::int64_t last_request_ns_;
  std::vector<Change> changes_;
};

}  // namespace sinerig::sim
