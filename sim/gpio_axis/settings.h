// What the file of a simulated GPIO axis says.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "config/section.h"
#include "sim/linear_system.h"

namespace sinerig::sim {

// Seconds from the start; 0: never.
struct AxisFaults {
  double pulse_at_s = 0.0;      // a pulse on A too short for the kernel to see both of its edges
  double burst_at_s = 0.0;      // more edges at once than the kernel's queue holds
  double stuck_at_s = 0.0;      // the encoder says nothing more
  double interlock_at_s = 0.0;  // the interlock opens
};

struct AxisSettings {
  std::string chip;
  std::string output;  // "density", "sign_magnitude" or "step"
  unsigned line = 0;
  unsigned direction_line = 0;
  std::optional<unsigned> enable_line;
  double low = 0.0;  // input of the plant, "density"
  double high = 1.0;
  double full = 1.0;  // "sign_magnitude"
  double step = 1.0;  // "step"
  unsigned encoder_a = 0;
  unsigned encoder_b = 0;
  double per_count = 1.0;
  std::size_t measured = 0;  // row of the plant
  std::optional<unsigned> interlock_line;
  LinearSystem system;
  AxisFaults faults;
};

// Reads [axis], [faults] and [plant]. Throws config::ConfigError.
AxisSettings read_axis(config::RigFile& file);

// The input of the plant that levels mean.
double driven(const AxisSettings& settings, bool line, bool direction);

}  // namespace sinerig::sim
