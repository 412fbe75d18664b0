// Finds chips and lines by what people call them, and says why a request was refused. Straight from
// the kernel's interface (GPIO_V2, Linux 5.10), so that it is the same under every libgpiod.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "drivers/gpio/lines.h"

namespace sinerig::gpio {

inline constexpr const char* consumer = "sinerig";  // what `gpioinfo` shows as the lines' user

struct Place {
  std::string path;               // "/dev/gpiochip0"
  std::vector<unsigned> offsets;  // of each line of the request
  std::uint32_t inverted = 0;     // bit n: line n is active low
};

// Throws std::runtime_error where there is no such chip or line, naming those there are.
Place locate(const LineRequest& request);

// Throws std::runtime_error: what the request wanted, why the kernel refused it (an errno), what to
// do.
[[noreturn]] void refuse(const LineRequest& request, const Place& place, int error);

}  // namespace sinerig::gpio
