// A first dwell at low level, before the real sweep: is the sensor alive, are gain and sign as
// expected, is the noise bearable?
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "sweep/nonblocking.h"
#include "sweep/trip.h"

namespace sinerig {

struct Point;

struct PreflightSettings {
  bool wanted = false;
  double level = 0.1;  // of the first dwell's amplitude
  // Of the first response.
  double min_gain = 0.0;  // output per input
  double max_gain = 1e300;
  double min_phase_deg = -180.0;  // …to max_phase_deg, counted upwards; a full turn: any
  double max_phase_deg = 180.0;
  double min_snr_db = -10.0;  // of every response: tone over residual, per sample

  bool knows_gain() const noexcept { return min_gain > 0.0 || max_gain < 1e300; }
  bool knows_sign() const noexcept { return max_phase_deg - min_phase_deg < 360.0; }
};

// What it found of one response.
struct Preflight {
  std::uint32_t dwell = 0;
  std::uint64_t tick = 0;
  std::uint16_t input = 0;  // channels of the run
  std::uint16_t output = 0;
  bool passed = false;
  double frequency_hz = 0.0;
  double amplitude = 0.0;  // of the input
  double gain = 0.0;
  double phase_deg = 0.0;
  double snr_db = 0.0;
};

// What is wrong with a response of the pre-flight dwell: a trip without tick and command, cause
// none when all is well. `first`: the one that gain and phase are known of.
Trip check_preflight(const PreflightSettings& settings, const Point& point,
                     bool first) noexcept SINERIG_NONBLOCKING;

Preflight preflight_of(const Point& point, bool passed,
                       std::uint64_t tick) noexcept SINERIG_NONBLOCKING;

// "passed: position/applied at 1 Hz, 0.05: gain 0.998, phase -3.2°, SNR 41 dB"; names of all
// channels of the run.
std::string describe(const Preflight& preflight, const std::vector<std::string>& channel_names);

}  // namespace sinerig
