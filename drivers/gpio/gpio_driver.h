// The driver "gpio": an actuator on output lines, encoders, levels and interlocks on input lines.
#pragma once

#include <functional>
#include <memory>

#include "drivers/device.h"
#include "drivers/gpio/lines.h"

namespace sinerig::gpio {

// `bank` is called when a rig is opened.
DriverKit gpio_driver(std::function<std::unique_ptr<LineBank>()> bank);

}  // namespace sinerig::gpio
