// sinerig notch: filters against the resonances of a plant, robust over what is known of them.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "cli/loop_options.h"
#include "identify/loop_model.h"
#include "report/notch_report.h"

namespace sinerig::cli {

struct NotchOptions {
  std::vector<std::string> files;        // the first is the plant; more of them show its drift
  std::vector<double> at_hz;             // modes by frequency; default: the first resonance
  std::optional<double> attenuation_db;  // default: see notch_command.cpp
  std::optional<double> crossover_hz;    // default: of the loop with the controller
  double within_hz = 0.0;                // more drift, to each side
  std::string fixed = "2.30";            // integer.fraction bits of the fixed-point coefficients
  std::string format = "text";           // text c json
  LoopOptions loop;
  std::string channel;
  bool refit = false;
};

struct NotchedLoop {
  report::NotchReport report;
  identify::LoopModel before;
  identify::LoopModel after;  // with the notches in it
};

// Throws as fit_command does, and std::invalid_argument for a mode that is not there or a notch
// that cannot be had.
NotchedLoop design_notches(const NotchOptions& options);

int notch_command(const NotchOptions& options);

}  // namespace sinerig::cli
