// One input line as a sensor: a level, or an interlock that stops the sweep when it opens.
#pragma once

#include <memory>

#include "drivers/driver.h"
#include "drivers/gpio/lines.h"
#include "sweep/clock.h"

namespace sinerig::gpio {

struct LevelSettings {
  double low = 0.0;   // value of the inactive line
  double high = 1.0;  // and of the active one
};

class LevelSensor final : public Sensor {
 public:
  LevelSensor(std::unique_ptr<InputLines> line, const LevelSettings& settings, const Clock& clock)
      : line_{std::move(line)}, settings_{settings}, clock_{clock} {}

  // Fault::bus: the line can no longer be read.
  Sample read() noexcept SINERIG_NONBLOCKING override {
    const auto levels = line_->get();
    last_.fault = levels ? Fault::none : Fault::bus;
    if (levels) {
      last_.value = (*levels & 1U) != 0 ? settings_.high : settings_.low;
      last_.time_ns = clock_.time_ns(clock_.now());
    }
    return last_;
  }

 private:
  std::unique_ptr<InputLines> line_;
  LevelSettings settings_;
  const Clock& clock_;
  Sample last_;
};

class Interlock final : public Sensor {
 public:
  Interlock(std::unique_ptr<InputLines> line, const Clock& clock)
      : line_{std::move(line)}, clock_{clock} {}

  // 1 while closed. Open, which is also a line that cannot be read: 0 with Fault::interlock.
  Sample read() noexcept SINERIG_NONBLOCKING override {
    const bool closed = this->closed();
    return {.value = closed ? 1.0 : 0.0,
            .time_ns = clock_.time_ns(clock_.now()),
            .fault = closed ? Fault::none : Fault::interlock};
  }

  bool closed() noexcept SINERIG_NONBLOCKING { return (line_->get().value_or(0U) & 1U) != 0; }

 private:
  std::unique_ptr<InputLines> line_;
  const Clock& clock_;
};

}  // namespace sinerig::gpio
