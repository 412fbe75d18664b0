#include "cli/night_command.h"

#include <algorithm>
#include <chrono>
#include <ctime>
#include <filesystem>
#include <iostream>
#include <map>
#include <sstream>

#include <nlohmann/json.hpp>
#include <spdlog/spdlog.h>

#include "cli/included_files.h"
#include "cli/night_folder.h"
#include "cli/output_file.h"
#include "cli/recorded_run.h"
#include "cli/service_notifier.h"
#include "cli/stop_on_signal.h"
#include "report/night_summary.h"

namespace sinerig::cli {

namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

// Of the sweeps of a night, at its end.
constexpr std::chrono::minutes most_reading{10};

std::unique_ptr<ConfiguredRig> configured_rig(const NightTask& task,
                                              const std::vector<DriverKit>& drivers) {
  return of_sweep(*task.sweep, [&] {
    return std::make_unique<ConfiguredRig>(config::RigFile::parse(task.rig_text, task.sweep->rig),
                                           drivers);
  });
}

// What is there may be a run that was killed as it began: that is in the way.
record::SweepWriter::IfExists if_exists(const NightTask& task) {
  const bool in_the_way = fs::exists(task.sweep_file) && !record::is_begun(task.sweep_file);
  return in_the_way ? record::SweepWriter::IfExists::replace
                    : record::SweepWriter::IfExists::refuse;
}

void print_line(const ordered_json& json) {
  std::cout << json.dump(-1, ' ', false, ordered_json::error_handler_t::replace) << std::endl;
}

class Night {
 public:
  Night(const NightOptions& options, const std::vector<DriverKit>& drivers, WallTime& time)
      : options_{options},
        drivers_{drivers},
        time_{time},
        job_{read_night_job(options.job)},
        tasks_{tasks_of(job_)} {
    // Whatever can be refused is, before the first of them moves anything.
    for (const NightTask& task : tasks_) {
      const std::unique_ptr<ConfiguredRig> configured = configured_rig(task, drivers_);
      of_sweep(*task.sweep, [&] { return configured->rig().plan(); });
      if (state_of(task) != TaskState::not_begun) {
        refuse_changed_include(record::read_sweep(task.sweep_file), configured->rig(),
                               task.sweep_file);
      }
      included_[task.sweep_file] = included_text(configured->rig());
    }
  }

  int run();

 private:
  bool wait_for(const NightTask& task, const NightFolder& folder);
  int attend(const NightTask& task, std::size_t number, const NightFolder& folder);
  int sweep(const NightTask& task, TaskState state);
  int conclude(const NightFolder& folder, int code);
  void tell(const NightTask& task, TaskState state, std::size_t number) const;

  const NightOptions& options_;
  const std::vector<DriverKit>& drivers_;
  WallTime& time_;
  NightJob job_;
  std::vector<NightTask> tasks_;
  ServiceNotifier service_;
  RunControl between_;                           // a stop, whenever it was asked for
  std::map<std::string, std::string> included_;  // by sweep file: what its rig led to at first
  std::map<std::string, std::string> failures_;  // by sweep file: could not be run at all
};

// False when told to stop meanwhile.
bool Night::wait_for(const NightTask& task, const NightFolder& folder) {
  const NightSweep& sweep = *task.sweep;
  std::int64_t until_s = time_.now_s() + static_cast<std::int64_t>(sweep.pause_s);
  if (task.repeat == 1 && sweep.second_of_day) {
    until_s = std::max(until_s, next_time_of_day(folder.began_s(), *sweep.second_of_day));
  }
  if (task.repeat == 1 && sweep.start_after_s) {
    until_s = std::max(until_s, folder.began_s() + static_cast<std::int64_t>(*sweep.start_after_s));
  }
  if (until_s > time_.now_s()) {
    const std::string what = "waiting until " + local_time_text(until_s) + " for " + sweep.name +
                             "-" + std::to_string(task.repeat);
    if (options_.voice == Voice::text) spdlog::info(what);
    service_.status(what);
  }
  return time_.wait_until(until_s, between_.stop_requests,
                          [this] { service_.idle(std::chrono::steady_clock::now()); });
}

void Night::tell(const NightTask& task, TaskState state, std::size_t number) const {
  const bool resumed = state != TaskState::not_begun;
  if (options_.voice == Voice::json) {
    print_line({{"type", "sweep"},
                {"name", task.sweep->name},
                {"repeat", task.repeat},
                {"number", number},
                {"of", tasks_.size()},
                {"resumed", resumed},
                {"sweep", task.sweep_file}});
  } else if (options_.voice == Voice::text) {
    spdlog::info("{}-{}, {} of {}{}", task.sweep->name, task.repeat, number, tasks_.size(),
                 resumed ? ", goes on" : "");
  }
}

int Night::sweep(const NightTask& task, TaskState state) {
  if (state != TaskState::not_begun) {
    return resume_command(
        {.file = task.sweep_file, .table = false, .voice = options_.voice, .service = &service_},
        drivers_);
  }
  const std::unique_ptr<ConfiguredRig> configured = configured_rig(task, drivers_);
  if (included_text(configured->rig()) != included_[task.sweep_file]) {
    throw config::ConfigError(task.sweep->rig +
                              ": a file that it leads to (a profile, a DBC) has changed since the "
                              "night began, and its repeats could not be compared; put it back");
  }
  const SweepPlan plan = configured->rig().plan();
  return record_run(*configured, plan,
                    {.sweep_file = task.sweep_file,
                     .voice = options_.voice,
                     .table = false,
                     .service = &service_},
                    [&] {
                      return std::make_unique<record::SweepWriter>(
                          task.sweep_file, run_info(configured->rig(), plan), if_exists(task));
                    });
}

// Runs what is left of a task; the exit code of a run.
int Night::attend(const NightTask& task, std::size_t number, const NightFolder& folder) {
  const TaskState state = state_of(task);
  if (state == TaskState::done) return exit_done;
  if (state == TaskState::stopped && !job_.stop_on_stop) return exit_stopped;  // it had its chance
  if (state == TaskState::not_begun && !wait_for(task, folder)) return exit_interrupted;
  if (between_.stop_requests.load() > 0) return exit_interrupted;
  tell(task, state, number);
  const int ended = sweep(task, state);
  if (!fs::exists(task.sweep_file)) return ended;  // told to stop before it began
  const record::StoredRun run = record::read_sweep(task.sweep_file);
  std::uint64_t ticks = 0;
  for (const record::StoredTiming& timing : run.timings) ticks += timing.ticks + timing.skipped;
  time_.pass(static_cast<double>(ticks) / run.plan.rate_hz);
  return ended;
}

int Night::run() {
  const StopOnSignal stop_on_signal{between_};
  const NightFolder folder{job_, time_};
  service_.ready();
  int code = exit_done;
  std::size_t number = 0;
  for (const NightTask& task : tasks_) {
    int ended = exit_stopped;
    try {
      ended = attend(task, ++number, folder);
    } catch (const std::exception& error) {
      spdlog::error("{}", error.what());
      failures_[task.sweep_file] = error.what();
    }
    if (ended == exit_interrupted) return conclude(folder, exit_interrupted);
    if (ended == exit_done) continue;
    code = exit_stopped;
    if (job_.stop_on_stop) break;
  }
  return conclude(folder, code);
}

int Night::conclude(const NightFolder& folder, int code) {
  service_.stopping();
  std::vector<report::NightRow> rows =
      attended(service_, for_at_most(most_reading), [&] { return night_rows(job_, tasks_); });
  bool changed = false;
  for (report::NightRow& row : rows) {
    changed = changed || row.changed();
    const auto failure = failures_.find(row.file);
    if (failure == failures_.end()) continue;
    row.outcome = "failed";
    row.detail = failure->second;
  }
  const ordered_json json = report::night_json(options_.job, rows);
  std::ostringstream words;
  report::print_night(words, options_.job, rows);
  write_file(folder.path("summary.txt"), true,
             [&](std::ostream& stream) { stream << words.str(); });
  write_file(folder.path("summary.json"), true, [&](std::ostream& stream) {
    stream << json.dump(1, ' ', false, ordered_json::error_handler_t::replace) << '\n';
  });
  if (options_.voice == Voice::json) {
    ordered_json line{{"type", "night"}};
    line.update(json);
    print_line(line);
  } else if (options_.voice == Voice::text) {
    std::cout << words.str() << std::flush;
    spdlog::info("wrote {} and summary.json", folder.path("summary.txt"));
  }
  return code == exit_done && changed ? exit_changed : code;
}

bool all_virtual(const NightJob& job, const std::vector<DriverKit>& drivers) {
  const std::vector<NightTask> tasks = tasks_of(job);
  return std::all_of(tasks.begin(), tasks.end(), [&](const NightTask& task) {
    return configured_rig(task, drivers)->rig().clock == config::ClockKind::virtual_time;
  });
}

}  // namespace

int run_night(const NightOptions& options, const std::vector<DriverKit>& drivers, WallTime& time) {
  return Night{options, drivers, time}.run();
}

int night_command(const NightOptions& options, const std::vector<DriverKit>& drivers) {
  if (all_virtual(read_night_job(options.job), drivers)) {
    PassingTime time{std::time(nullptr)};
    return run_night(options, drivers, time);
  }
  SystemTime time;
  return run_night(options, drivers, time);
}

}  // namespace sinerig::cli
