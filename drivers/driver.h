// The seam between the loop and everything it can be connected to.
//
// Two small interfaces, because "CAN actuator, GPIO encoder" is an ordinary rig; one device may
// implement both. All calls come from the loop's thread and may not block, allocate or throw.
#pragma once

#include <cstdint>

#include "sweep/nonblocking.h"

namespace sinerig {

// What is wrong with one sample or one command.
enum class Fault : std::uint8_t {
  none,       // new, complete, believed
  stale,      // nothing new since the last read
  timeout,    // the device did not answer in time
  bus,        // the transport failed (bus-off, full queue, checksum, exception reply)
  range,      // the device says that the value left what it can represent
  interlock,  // a safety circuit is open: the guard stops at once
  device,     // the device says that it has failed or no longer obeys; after a write: stop
};

inline constexpr const char* to_string(Fault fault) noexcept {
  switch (fault) {
    case Fault::none: return "none";
    case Fault::stale: return "stale";
    case Fault::timeout: return "timeout";
    case Fault::bus: return "bus";
    case Fault::range: return "range";
    case Fault::interlock: return "interlock";
    case Fault::device: return "device";
  }
  return "unknown";
}

struct Sample {
  double value = 0.0;        // engineering unit of the channel
  std::int64_t time_ns = 0;  // when it was acquired (or took effect), in the time base of the clock
  Fault fault = Fault::none;
};

class Actuator {
 public:
  virtual ~Actuator() = default;

  // Puts `command` (engineering unit) out and returns what was really applied, after clamping,
  // quantising or sigma-delta, and when. With a fault, `value` is what the device holds instead.
  // Fault::stale: what was applied is not known this time (a lost confirmation); the sample is
  // missing and the command counts as gone out. A device that answers late returns what it applied
  // last, with its time. Every other fault is a command that was lost or late.
  virtual Sample write(double command) noexcept SINERIG_NONBLOCKING = 0;

  // Neutral output. Idempotent, callable from any exit path.
  virtual void release() noexcept = 0;
};

class Sensor {
 public:
  virtual ~Sensor() = default;

  // The newest value; Fault::stale with the last value when nothing new has arrived.
  virtual Sample read() noexcept SINERIG_NONBLOCKING = 0;
};

}  // namespace sinerig
