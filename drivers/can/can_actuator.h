// A device on a CAN bus as the actuator of the loop.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "drivers/can/health.h"
#include "drivers/can/sequence.h"
#include "drivers/driver.h"

namespace sinerig::can {

struct KeepAlive {
  Frame frame;
  std::int64_t period_ns = 100'000'000;
};

struct CommandSettings {
  Frame frame;  // constant bytes and signals are in it already
  Signal signal;
  Checksum checksum;
  double neutral = 0.0;
  Sequence startup;   // when the rig is opened: nothing may move
  Sequence arm;       // before the first command
  Sequence disarm;    // at every release
  Sequence shutdown;  // when the rig is closed
  std::vector<KeepAlive> keep_alive;
  std::vector<HealthRule> health;
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
  // down); the value is then what the device last took. Fault::device: its health is not what it
  // must be.
  Sample write(double command) noexcept SINERIG_NONBLOCKING override;

  // Neutral command, then the disarm list. What finds the queue full is tried for 20 ms per frame,
  // a dead bus for 0.3 s in all. What then has not gone out is tried again by the next release(),
  // by start() and by the destructor.
  void release() noexcept override;
  bool released() const noexcept { return released_; }
  std::string not_released() const;  // what has not gone out; empty when all has

  // Why the last write() had a fault, for people; empty when it had none. Not for the loop.
  std::string reason() const;

 private:
  void compose(double command) noexcept SINERIG_NONBLOCKING;
  void keep_alive(std::int64_t now_ns) noexcept SINERIG_NONBLOCKING;
  bool send_neutral(Patience& patience) noexcept;

  Bus& bus_;
  CommandSettings settings_;
  Health health_;
  std::vector<std::int64_t> next_keep_alive_ns_;
  Frame frame_;
  double encoded_ = 0.0;  // what the bits in frame_ mean
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
