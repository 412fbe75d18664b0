// What a report shows of the loop that a controller closes: its margins, and a notch for the first
// resonance with the loop before and after.
#pragma once

#include <string>

#include <nlohmann/json_fwd.hpp>

#include "cli/loop_options.h"

namespace sinerig::cli {

// {controller, rate_hz, stable, model, points, notch, no_notch, f, before, after}: model and points
// as loop_json has them, notch as notch_json or null with the reason in no_notch; before and after
// are {re, im} of L over f in Hz. Throws as margins_command does.
nlohmann::ordered_json loop_panel(const std::string& file, const std::string& channel,
                                  const LoopOptions& options);

}  // namespace sinerig::cli
