// What a run is told beside its plan.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "sweep/known_modes.h"
#include "sweep/measurement.h"
#include "sweep/preflight.h"
#include "sweep/retry.h"

namespace sinerig {

struct RunnerSettings {
  Pairs responses{};                     // empty: every sensor over what was applied
  std::vector<std::size_t> readbacks{};  // sensors that read the excitation back
  bool record_samples = false;
  double min_excitation = 1e-3;  // |U| of a tone below this part of its amplitude is no excitation
  double max_lateness = 0.5;     // of a period: a command later than this disturbs the plant
  double max_gap_s = 1.0;        // without a tick: the machine slept, nobody minded the actuator
  std::optional<KnownModes> modes{};  // for settling by a model; without, the finder is asked
  ModeFinder* finder = nullptr;       // must outlive the runner
  bool real_time = false;             // what takes long is done on other threads
  RetrySettings retry{};
  PreflightSettings preflight{};
};

}  // namespace sinerig
