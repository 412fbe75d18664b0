// The folder of a night: when it began, who works in it, and what its sweep files say.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "cli/night_job.h"
#include "cli/wall_time.h"
#include "record/file_lock.h"
#include "record/sweep_reader.h"
#include "report/night_summary.h"

namespace sinerig::cli {

class NightFolder {
 public:
  // Makes the folder and, durably, night.json in it with the time at which the night began; a night
  // that is there already began when that says. Throws record::FileInUse where another process is
  // at it, record::SweepFileError.
  NightFolder(const NightJob& job, WallTime& time);

  std::int64_t began_s() const { return began_s_; }
  std::string path(const std::string& name) const;

 private:
  std::string folder_;
  std::int64_t began_s_ = 0;
  std::unique_ptr<record::FileLock> lock_;
};

enum class TaskState { not_begun, unfinished, stopped, done };

// What a task's sweep file holds; nothing where no run of it was begun. Throws config::ConfigError
// where it was made from another rig file, record::SweepFileError where it cannot be read.
std::optional<record::StoredRun> begun_run(const NightTask& task);

// Where a task stands by that.
TaskState state_of(const std::optional<record::StoredRun>& run);

// Why a person has to look before anything is armed again, after the last part of a run: it went on
// until an interlock opened, or its actuator has not taken its release. Empty where nobody has to.
std::string to_be_looked_at(const record::StoredRun& run);

// One row per task, compared where there are points. A file that cannot be read is a row, too.
std::vector<report::NightRow> night_rows(const NightJob& job, const std::vector<NightTask>& tasks);

}  // namespace sinerig::cli
