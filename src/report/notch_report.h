// Designed notches as text, C source and JSON.
#pragma once

#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

#include "identify/loop_analysis.h"
#include "identify/notch.h"

namespace sinerig::report {

struct DesignedNotch {
  identify::UncertainMode mode;
  identify::NotchRequest request;
  identify::NotchDesign design;
  std::optional<identify::Biquad> biquad;  // where a rate is known
  std::optional<identify::FixedBiquad> fixed;
};

struct NotchReport {
  struct Loop {
    identify::LoopFigures figures;
    bool stable = false;
  };
  std::string label;
  std::string controller;
  double rate_hz = 0.0;  // 0: continuous, no coefficients
  std::vector<DesignedNotch> notches;
  std::optional<Loop> before;  // where a controller is known
  std::optional<Loop> after;
};

void print_notch(std::ostream& stream, const NotchReport& report);

// Two arrays, double and fixed point, a row b0 b1 b2 a1 a2 per notch; a0 is one. Throws
// std::invalid_argument without a rate.
void print_notch_c(std::ostream& stream, const NotchReport& report);

// One object: label, controller, rate_hz, notches (frequency_hz, zero_damping, pole_damping,
// depth_db, width_hz, interval_hz, attenuation_db, worst_attenuation_db, crossover_hz,
// phase_cost_deg, biquad, fixed), before and after as loop_json has them.
std::string notch_json(const NotchReport& report);

}  // namespace sinerig::report
