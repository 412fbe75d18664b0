// Margins of a loop for people and for programs.
#pragma once

#include <iosfwd>
#include <optional>
#include <string>

#include <nlohmann/json.hpp>

#include "identify/loop_analysis.h"

namespace sinerig::report {

// A table under the title, one figure per line with its 95 % interval and, for measured points, the
// frequencies it is interpolated between. stable: of the closed loop, where known.
void print_loop(std::ostream& stream, const std::string& title,
                const identify::LoopFigures& figures, std::optional<bool> stable);

// Keys: stable, gain_margin, gain_reduction, phase_margin, delay_margin, sensitivity_peak,
// bandwidth_hz, phase_crossings, gain_crossings, resonances; null where there is no such figure.
// A figure is {"value", "low", "high"}, the last two its 95 % interval.
nlohmann::ordered_json loop_json(const identify::LoopFigures& figures, std::optional<bool> stable);

}  // namespace sinerig::report
