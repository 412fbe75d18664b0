// A signal on a CAN bus as a sensor of the loop.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "drivers/can/bus.h"
#include "drivers/can/dbc.h"
#include "drivers/driver.h"

namespace sinerig::can {

struct FeedbackSettings {
  Pattern pattern;
  Checksum checksum;
  Signal signal;
  std::optional<DbcOrigin> origin;           // of the signal
  std::optional<std::uint64_t> invalid_raw;  // the code that means "no value"
  std::int64_t timeout_ns = 0;               // silence longer than this is a time-out; 0 = never
  bool fd = false;                           // comes as a CAN-FD frame
  std::vector<Frame> polls;                  // sent at every read; answers come at a later one
  bool answers_command = false;              // comes only as the answer to a set-point
};

class CanSensor final : public Sensor {
 public:
  // Before Bus::start(). Throws std::invalid_argument for a signal outside the shortest frame that
  // the pattern accepts. `bus` must outlive the sensor.
  CanSensor(Bus& bus, const FeedbackSettings& settings);

  // The newest frame's value and arrival. Fault::stale: no new frame. Fault::timeout: none for
  // longer than allowed. Fault::bus: bus-off, link down, or a frame with a wrong checksum.
  // Fault::range: the device says that it has no value.
  Sample read() noexcept SINERIG_NONBLOCKING override;

  // What has come so far is not new to the next read(), and no silence either. After Bus::drain().
  void catch_up() noexcept;

 private:
  void take_in(const Slot& slot) noexcept SINERIG_NONBLOCKING;

  Bus& bus_;
  FeedbackSettings settings_;
  std::size_t slot_;
  Unwrapper unwrapper_;
  std::uint64_t seen_count_ = 0;
  std::uint64_t seen_spoiled_ = 0;
  std::int64_t silent_since_ns_ = 0;
  Sample last_;
};

}  // namespace sinerig::can
