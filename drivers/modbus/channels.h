// Registers of a device as the actuator and the sensors of the loop.
//
// What a tick sees is the exchange of the tick before it, with the time at which it took place: the
// command that was applied and the numbers that were read then. Their ratio needs no correction.
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "drivers/driver.h"
#include "drivers/modbus/link.h"
#include "drivers/unwrapper.h"

namespace sinerig::modbus {

struct HealthRule {
  std::string name;  // "drive state"
  Place place;
  Comparison comparison;
};

struct CommandSettings {
  Place place;
  double minimum = -std::numeric_limits<double>::infinity();
  double maximum = std::numeric_limits<double>::infinity();
  double neutral = 0.0;
  std::int64_t max_age_ns = 0;  // unconfirmed for longer is a fault
  Sequence startup;             // when the rig is opened: nothing may move
  Sequence arm;                 // before the first command
  Sequence disarm;              // at every release
  Sequence shutdown;            // when the rig is closed
  std::vector<HealthRule> health;
};

struct FeedbackSettings {
  Place place;
  double wrap_modulus = 0.0;
};

class ModbusActuator final : public Actuator {
 public:
  // Before Link::open(). `link` must outlive the actuator.
  ModbusActuator(Link& link, CommandSettings settings);
  ~ModbusActuator() override;  // releases, then runs the shut-down list

  // After Link::open(), before the loop. Throw std::runtime_error where the device does not answer
  // as it must, or not as often as the loop asks, StopRequested where a stop is; what was armed is
  // disarmed again.
  void start();
  void arm();

  // Hands the set-point over and returns what the exchange before has applied, and when.
  // Fault::stale: not known, no answer that can be believed. Fault::timeout: not known for longer
  // than allowed, or never sent because the exchange before took a whole period. Fault::bus:
  // refused, or no connection. Fault::device: its health is not what it must be.
  Sample write(double command) noexcept SINERIG_NONBLOCKING override;

  // What the device does not take is tried again by the next release(), by start() and by the
  // destructor.
  void release() noexcept override;
  bool released() const noexcept { return released_; }
  std::string not_released() const;  // what it has not taken; empty when it is released

  // Why the last command had a fault; empty when it had none. Not for the loop.
  std::string reason() const;

 private:
  void begin_ages() noexcept SINERIG_NONBLOCKING;
  Fault judge() noexcept SINERIG_NONBLOCKING;
  Fault unknown_for_long() const noexcept SINERIG_NONBLOCKING;
  void look_after_health() noexcept SINERIG_NONBLOCKING;

  Link& link_;
  CommandSettings settings_;
  std::vector<std::size_t> health_fields_;
  std::vector<Sample> health_;  // newest good reading of each rule
  std::size_t violated_;        // index, or none
  bool health_is_old_ = false;  // and that is what is wrong with it
  Sample held_;
  Fault last_fault_ = Fault::none;
  std::int64_t confirmed_ns_ = 0;
  bool ages_begin_ = false;  // with the next write()
  bool started_ = false;
  bool released_ = true;
  Link::Released release_;  // the last one
};

class ModbusSensor final : public Sensor {
 public:
  // Before Link::open(). `paces`: the first sensor of its connection, whose reading begins a tick
  // while no command does.
  ModbusSensor(Link& link, const FeedbackSettings& settings, const std::string& label, bool paces);

  Sample read() noexcept SINERIG_NONBLOCKING override;

 private:
  Link& link_;
  std::size_t field_;
  Unwrapper unwrapper_;
  bool paces_;
  Sample last_{.value = 0.0, .time_ns = 0, .fault = Fault::stale};
};

// Throws std::runtime_error where exchanges fail, or take longer than the loop leaves them.
void require_pace(const Link& link, const Pace& pace);

// What require_pace() would refuse; empty where there is nothing.
std::string obstacle(const Link& link, const Pace& pace);

// What is doubtful of a sweep up to `highest_hz` at this pace: the drive gets fewer than ten
// set-points in a period, of which each stands for long. Empty where nothing is.
std::string doubt(const Link& link, const Pace& pace, double highest_hz);

}  // namespace sinerig::modbus
