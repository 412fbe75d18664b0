// A device on a CAN bus as the actuator of the loop.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "drivers/can/dbc.h"
#include "drivers/can/health.h"
#include "drivers/can/sequence.h"
#include "drivers/driver.h"

namespace sinerig::can {

struct KeepAlive {
  Frame frame;
  std::int64_t period_ns = 100'000'000;
};

struct CommandSettings {
  Frame frame;                    // constant bytes and signals are in it already
  std::optional<Frame> released;  // carries neutral to a device that is to be off; none: `frame`
  Signal signal;
  std::optional<DbcOrigin> origin;  // of the signal
  Checksum checksum;
  double neutral = 0.0;
  Sequence startup;   // when the rig is opened: nothing may move
  Sequence arm;       // before the first command
  Sequence disarm;    // at every release
  Sequence shutdown;  // when the rig is closed
  std::vector<KeepAlive> keep_alive;
  std::vector<HealthRule> health;
};

// When a frame is due that goes out at its period, seen from a loop whose ticks are never quite on
// time: half a tick early or late, but none left out and none too many.
class Cycle {
 public:
  bool is_due(std::int64_t now_ns, std::int64_t period_ns,
              std::int64_t tick_ns) noexcept SINERIG_NONBLOCKING {
    if (now_ns + tick_ns / 2 < next_ns_) return false;
    next_ns_ += period_ns;
    if (next_ns_ <= now_ns) next_ns_ = now_ns + period_ns;
    return true;
  }

 private:
  std::int64_t next_ns_ = 0;
};

class CanActuator final : public Actuator {
 public:
  // Before Bus::start(). Throws std::invalid_argument for a frame or signal that cannot be.
  // `bus` must outlive the actuator.
  CanActuator(Bus& bus, CommandSettings settings);
  ~CanActuator() override;  // releases, then runs the shut-down list

  // After Bus::start(), before the loop. Both throw std::runtime_error where the device does not
  // answer as it must, StopRequested where a stop is; what was armed is disarmed again.
  void start();
  void arm();

  // Sends the set-point once, never again. Fault::bus: it was dropped (queue full, bus-off, link
  // down), or what must come with it was; the value is then what the device last took.
  // Fault::device: its health is not what it must be.
  Sample write(double command) noexcept SINERIG_NONBLOCKING override;

  // Neutral command, in the frame that does not switch on, then the disarm list. What finds the
  // queue full is tried for 20 ms per frame, a dead bus for 0.3 s in all. What then has not gone
  // out is tried again by the next release(), by start() and by the destructor.
  void release() noexcept override;
  bool released() const noexcept { return released_; }
  std::string not_released() const;  // what has not gone out; empty when all has

  // Why the last write() had a fault, for people; empty when it had none. Not for the loop.
  std::string reason() const;

 private:
  void compose(double command) noexcept SINERIG_NONBLOCKING;
  SendResult send_set_point() noexcept SINERIG_NONBLOCKING;
  void keep_alive(std::int64_t now_ns) noexcept SINERIG_NONBLOCKING;
  bool send_neutral(Patience& patience) noexcept;

  Bus& bus_;
  CommandSettings settings_;
  Health health_;
  std::vector<Cycle> cycles_;  // of settings_.keep_alive
  std::int64_t last_write_ns_ = 0;
  Frame frame_;
  double encoded_ = 0.0;  // what the bits in frame_ mean
  Frame released_frame_;
  double neutral_ = 0.0;  // what the bits in released_frame_ mean
  Sample held_;
  const HealthRule* violated_ = nullptr;
  SendResult last_result_ = SendResult::sent;
  BusState last_state_ = BusState::up;  // then: a release may outlast what was wrong
  bool started_ = false;
  bool ages_begin_ = false;  // at the next write()
  bool released_ = true;
  bool neutral_out_ = true;  // with the last release
};

}  // namespace sinerig::can
