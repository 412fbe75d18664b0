#include "drivers/gpio/gpio_actuator.h"

#include <cmath>

namespace sinerig::gpio {

Sample GpioActuator::write(double command) noexcept {
  const bool number = std::isfinite(command);
  const Drive drive = modulator_->next(number ? command : settings_.neutral);
  released_ = false;
  // The levels change somewhere within the call.
  const std::int64_t before_ns = clock_.time_ns(clock_.now());
  const bool out = lines_->set(drive.levels | settings_.enable);
  refused_ = !out;
  const std::int64_t after_ns = clock_.time_ns(clock_.now());
  if (out) {
    held_.value = drive.applied;
    held_.time_ns = before_ns + (after_ns - before_ns) / 2;
  } else {
    modulator_->take_back();
  }
  Sample answer = held_;
  answer.fault = !out ? Fault::bus : !number ? Fault::range : Fault::none;
  return answer;
}

void GpioActuator::release() noexcept {
  const Drive rest = modulator_->rest();
  constexpr std::uint32_t line = 1U;
  released_ = lines_->set((rest.levels & ~line) | safe_levels(settings_));
  if (released_) held_.value = rest.applied;
}

}  // namespace sinerig::gpio
