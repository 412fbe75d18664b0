// The lines of this machine, through the libgpiod that the build found.
#pragma once

#include <memory>

#include "drivers/gpio/lines.h"

namespace sinerig::gpio {

std::unique_ptr<LineBank> kernel_lines();

}  // namespace sinerig::gpio
