// The rates of a serial line that libmodbus sets. It takes every other for 9600 without a word.
#pragma once

#include <array>
#include <termios.h>

namespace sinerig::modbus {

struct LineRate {
  int baud = 0;
  speed_t speed = 0;  // as the kernel calls it
};

inline constexpr std::array line_rates = {
    LineRate{1200, B1200},       LineRate{2400, B2400},       LineRate{4800, B4800},
    LineRate{9600, B9600},       LineRate{19200, B19200},     LineRate{38400, B38400},
    LineRate{57600, B57600},     LineRate{115200, B115200},   LineRate{230400, B230400},
    LineRate{460800, B460800},   LineRate{500000, B500000},   LineRate{576000, B576000},
    LineRate{921600, B921600},   LineRate{1000000, B1000000}, LineRate{1152000, B1152000},
    LineRate{1500000, B1500000}, LineRate{2500000, B2500000},
};

}  // namespace sinerig::modbus
