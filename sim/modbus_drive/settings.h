// What a simulated Modbus drive is told: how it is reached, how it puts numbers into registers, and
// what goes wrong.
#pragma once

#include <cstdint>
#include <string>

#include "config/section.h"
#include "sim/linear_system.h"

namespace sinerig::sim {

struct DriveFaults {
  double lost_fraction = 0.0;       // of the replies
  double late_max_s = 0.0;          // each reply is late by up to this
  double late_fraction = 0.0;       // of the replies …
  double late_s = 0.0;              // … come this much later
  double spoiled_fraction = 0.0;    // of the replies: wrong check sum; on TCP: no Modbus
  double exception_fraction = 0.0;  // of the requests are refused: exception 4
  double exception_at_s = 0.0;      // from then on all are refused; 0 = never
  double silent_at_s = 0.0;         // from then on nothing is said; 0 = never
  double drop_at_s = 0.0;           // connections are closed, new ones accepted; 0 = never
  double power_cycle_at_s = 0.0;    // forgets everything, boots for half a second; 0 = never
  double error_at_s = 0.0;          // the drive trips; 0 = never
  std::uint64_t seed = 1;
};

struct DriveSettings {
  bool serial = false;
  std::string host = "127.0.0.1";
  int port = 0;       // 0: any free one
  std::string link;   // serial: a symbolic link to the pseudo-terminal
  int baud = 115200;  // serial: what frames take on the wire
  int bits_per_byte = 11;
  bool echo = false;            // serial: an adapter that returns what is sent
  std::int64_t silence_ns = 0;  // serial: a request sooner after a reply is not heard
  std::uint8_t unit = 1;
  std::string type = "float32";
  bool low_word_first = false;
  bool low_byte_first = false;
  double torque_scale = 1.0;  // Nm per code, of every type
  double position_scale = 1.0;
  double velocity_scale = 1.0;
  bool has_function_16 = true;
  bool has_function_23 = true;
  std::int64_t turn_around_ns = 0;  // from the end of a request to the beginning of its reply
  double watchdog_s = 0.0;          // without a request for this long the drive trips; 0 = never
  double torque_max = 10.0;         // Nm
  LinearSystem system;
  DriveFaults faults;
};

// Reads [drive], [faults] and [plant]. Throws config::ConfigError.
DriveSettings read_drive(config::RigFile& file);

}  // namespace sinerig::sim
