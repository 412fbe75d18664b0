#include "cli/night_folder.h"

#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <fstream>
#include <unistd.h>

#include <nlohmann/json.hpp>

#include "cli/run_differences.h"
#include "record/unfinished_run.h"
#include "sweep/records.h"

namespace sinerig::cli {

namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

constexpr const char* in_use = "another sinerig is at work on this night";

[[noreturn]] void cannot_write(const std::string& path) {
  throw record::SweepFileError(path + ": cannot be written: " + std::strerror(errno));
}

// Whole or not at all, also after a power cut.
void write_durably(const std::string& path, const std::string& text) {
  const std::string draft = path + ".new";
  const int file = open(draft.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  if (file < 0) cannot_write(draft);
  const bool written = write(file, text.data(), text.size()) == static_cast<ssize_t>(text.size()) &&
                       fsync(file) == 0;
  close(file);
  if (!written || rename(draft.c_str(), path.c_str()) != 0) cannot_write(path);
  const int folder = open(fs::path{path}.parent_path().c_str(), O_RDONLY | O_CLOEXEC);
  if (folder >= 0) {
    fsync(folder);
    close(folder);
  }
}

std::int64_t read_beginning(const std::string& path) {
  std::ifstream stream{path};
  const auto json = ordered_json::parse(stream, nullptr, false);
  if (json.is_object() && json.contains("began_s") && json["began_s"].is_number_integer()) {
    return json["began_s"].get<std::int64_t>();
  }
  throw record::SweepFileError(path + ": does not say when the night began; is it another file?");
}

}  // namespace

NightFolder::NightFolder(const NightJob& job, WallTime& time) : folder_{job.folder} {
  std::error_code error;
  fs::create_directories(folder_, error);
  if (error) throw record::SweepFileError(folder_ + ": cannot be made: " + error.message());
  const std::string state = path("night.json");
  if (!fs::exists(state)) {
    const std::int64_t now_s = time.now_s();
    const ordered_json json{{"format", "sinerig-night"},
                            {"job", fs::absolute(job.file).lexically_normal().string()},
                            {"began_utc", utc_text(now_s)},
                            {"began_s", now_s}};
    write_durably(state, json.dump(1) + "\n");
  }
  lock_ = std::make_unique<record::FileLock>(state, in_use);
  began_s_ = read_beginning(state);
}

std::string NightFolder::path(const std::string& name) const {
  return (fs::path{folder_} / name).string();
}

std::optional<record::StoredRun> begun_run(const NightTask& task) {
  if (!fs::exists(task.sweep_file) || !record::is_begun(task.sweep_file)) return std::nullopt;
  record::StoredRun run = record::read_sweep(task.sweep_file);
  if (run.fact("rig_text") != task.rig_text) {
    throw config::ConfigError(
        task.sweep_file + ": was made from another rig file or other values than " +
        task.sweep->rig + " now gives; give the night another folder, or put them back");
  }
  return run;
}

TaskState state_of(const std::optional<record::StoredRun>& run) {
  if (!run) return TaskState::not_begun;
  const std::string outcome = run->fact("outcome");
  if (outcome == "done") return TaskState::done;
  return outcome == "stopped" ? TaskState::stopped : TaskState::unfinished;
}

std::string to_be_looked_at(const record::StoredRun& run) {
  std::string reason;
  bool interlock = false;
  for (const record::StoredEvent& event : run.events) {
    if (event.kind == to_string(EventKind::started)) {
      interlock = false;
      reason.clear();
    }
    if (event.fault == to_string(Fault::interlock)) interlock = true;
    if (event.kind == to_string(EventKind::released)) reason.clear();
    if (event.kind == to_string(EventKind::not_released))
      reason = "its actuator has not taken its release";
  }
  return interlock ? "an interlock has opened" : reason;
}

namespace {

// What the sweep file says; `first` is the first repeat that has points, with which it is compared.
void read_row(const NightTask& task, const NightJob& job, std::vector<report::LabelledRun>& first,
              report::NightRow& row) {
  std::optional<record::StoredRun> stored = begun_run(task);
  if (!stored) return;
  report::LabelledRun run{.label = fs::path{task.sweep_file}.stem().string(),
                          .run = std::move(*stored)};
  row.started_utc = run.run.fact("started_utc");
  row.outcome = run.run.fact("outcome").empty() ? "not finished" : run.run.fact("outcome");
  row.detail = run.run.fact("outcome_detail");
  row.parts = run.run.parts.size();
  for (const record::StoredTiming& timing : run.run.timings) {
    row.bench_s += static_cast<double>(timing.ticks + timing.skipped) / run.run.plan.rate_hz;
  }
  for (const record::StoredResponse& response : run.run.responses) {
    for (const record::StoredPoint& point : response.points) {
      ++row.points;
      if (point.status == "good") ++row.good;
    }
  }
  if (first.empty() && row.points > 0) {
    first.push_back(std::move(run));
  } else if (row.points > 0) {
    row.differences = differences_of({first.front(), std::move(run)}, job.compare);
  }
}

}  // namespace

std::vector<report::NightRow> night_rows(const NightJob& job, const std::vector<NightTask>& tasks) {
  std::vector<report::NightRow> rows;
  std::vector<report::LabelledRun> first;  // repeat with points, of the sweep at hand
  for (const NightTask& task : tasks) {
    if (task.repeat == 1) first.clear();
    report::NightRow row{.name = task.sweep->name,
                         .repeat = task.repeat,
                         .file = task.sweep_file,
                         .outcome = "not run",
                         .detail = {},
                         .started_utc = {},
                         .differences = {}};
    try {
      read_row(task, job, first, row);
    } catch (const record::SweepFileError& error) {
      row.outcome = "failed";
      row.detail = error.what();
    }
    rows.push_back(std::move(row));
  }
  return rows;
}

}  // namespace sinerig::cli
