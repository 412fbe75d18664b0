// What a night.toml asks for: sweeps one after the other, each a rig file with some of its values
// replaced, repeated, at a time of its own.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "config/overrides.h"
#include "config/section.h"
#include "record/compare.h"

namespace sinerig::cli {

struct NightSweep {
  std::string name;
  std::string rig;  // path
  int repeat = 1;
  double pause_s = 0.0;                 // before each
  std::optional<int> second_of_day;     // start_at: the first not before this local time
  std::optional<double> start_after_s;  // … nor before this, from the beginning of the night
  std::vector<config::Override> overrides;
};

struct NightJob {
  std::string file;
  std::string folder;
  bool stop_on_stop = false;  // a sweep that a limit or a fault stopped ends the night
  record::CompareSettings compare;
  std::vector<NightSweep> sweeps;
};

// Throws config::ConfigError. Relative paths are from the job's own folder.
NightJob read_night_job(const std::string& path);

// One sweep of one repeat.
struct NightTask {
  const NightSweep* sweep = nullptr;
  int repeat = 1;          // from 1
  std::string sweep_file;  // FOLDER/NAME-REPEAT.sweep
  std::string rig_text;    // overrides in place
};

// In running order. Each repeat of a simulated rig has a seed of its own, the file's plus
// repeat − 1, or all would measure the same noise. Throws config::ConfigError. `job` must outlive
// it.
std::vector<NightTask> tasks_of(const NightJob& job);

}  // namespace sinerig::cli
