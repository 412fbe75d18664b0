// What a night.toml asks for: sweeps one after the other, each a rig file with some of its values
// replaced, repeated, at a time of its own.
#pragma once

#include <cstddef>
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
  std::string job{};                          // the job file …
  std::size_t rig_line = 0;                   // … its line of the rig
  std::vector<std::size_t> override_lines{};  // … and of each override
};

// What is wrong with the rig of a sweep, by the place in the job file where that has set it: the
// lines of a rig file with other values in it are those of no file.
std::string at_its_place(const NightSweep& sweep, const std::string& message);

// Calls `make`; a ConfigError gets the message of at_its_place().
template <typename Make>
auto of_sweep(const NightSweep& sweep, Make make) {
  try {
    return make();
  } catch (const config::ConfigError& error) {
    throw config::ConfigError(at_its_place(sweep, error.what()));
  }
}

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
