// What `sinerig compare --drift` compares beside the points: resonances of the models and, with a
// controller, the margins of the loop.
#pragma once

#include <string>
#include <vector>

#include "cli/loop_options.h"
#include "report/drift.h"

namespace sinerig::cli {

struct DriftSettings {
  LoopOptions loop;  // without a controller: resonances only
  std::string channel;
  double false_alarm = 0.01;
  double tolerance = 0.0;  // of the first value
};

// Each file after the first against the first; `labels` name them. Files without a stored fit are
// fitted first. Throws as read_plant_model and model_loop do.
std::vector<report::Drift> drift_of(const std::vector<std::string>& files,
                                    const std::vector<std::string>& labels,
                                    const DriftSettings& settings);

}  // namespace sinerig::cli
