#include "cli/night_command.h"

#include <algorithm>
#include <chrono>
#include <ctime>
#include <filesystem>
#include <iostream>
#include <map>
#include <optional>
#include <set>
#include <sstream>

#include <nlohmann/json.hpp>
#include <spdlog/spdlog.h>

#include "cli/included_files.h"
#include "cli/night_folder.h"
#include "cli/output_file.h"
#include "cli/real_time.h"
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

std::string name_of(const NightTask& task) {
  return task.sweep->name + "-" + std::to_string(task.repeat);
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
      const std::optional<record::StoredRun> run = begun_run(task);
      if (run) refuse_changed_include(*run, configured->rig(), task.sweep_file);
      included_[task.sweep_file] = included_text(configured->rig());
      if (state_of(run) != TaskState::done) require_rights(task, configured->rig());
    }
  }

  int run();

 private:
  void require_rights(const NightTask& task, const config::Rig& rig);
  bool wait_for(const NightTask& task, const NightFolder& folder);
  bool wait(double seconds);
  void announce(const std::string& what);
  int attend(const NightTask& task, std::size_t number, const NightFolder& folder);
  int sweep(const NightTask& task, TaskState state);
  int sweep_patiently(const NightTask& task, TaskState state);
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
  std::map<std::string, std::string> notes_;     // likewise: what its row tells beside
  std::set<std::string> granted_;                // sweeps whose rig has its rights
  double age_s_ = 0.0;                           // of the night, when this process took it up …
  double taken_up_s_ = 0.0;                      // … at this time of elapsed_s()
  std::string ended_by_;  // why nothing may be armed any more until a person has looked
};

// Once for all repeats. A rig that goes on without them is warned of when it runs.
void Night::require_rights(const NightTask& task, const config::Rig& rig) {
  if (!rig.require_realtime || !granted_.insert(task.sweep->name).second) return;
  of_sweep(*task.sweep, [&] { return make_loop_thread(rig); });
}

void Night::announce(const std::string& what) {
  if (options_.voice == Voice::text) spdlog::info(what);
  service_.status(what);
}

// False when told to stop meanwhile.
bool Night::wait(double seconds) {
  return time_.wait_for(seconds, between_.stop_requests,
                        [this] { service_.idle(std::chrono::steady_clock::now()); });
}

// The same. A time of day goes by the clock on the wall, whatever sets it meanwhile; a pause does
// not.
bool Night::wait_for(const NightTask& task, const NightFolder& folder) {
  const NightSweep& sweep = *task.sweep;
  double pause_s = sweep.pause_s;
  std::optional<std::int64_t> not_before_s;
  if (task.repeat == 1 && sweep.start_after_s) {
    const double age_s = age_s_ + time_.elapsed_s() - taken_up_s_;
    pause_s = std::max(pause_s, *sweep.start_after_s - age_s);
  }
  if (task.repeat == 1 && sweep.second_of_day) {
    not_before_s = next_time_of_day(folder.began_s(), *sweep.second_of_day);
  }
  const std::int64_t now_s = time_.now_s();
  const std::int64_t until_s =
      std::max(now_s + static_cast<std::int64_t>(pause_s), not_before_s.value_or(now_s));
  if (until_s > now_s) {
    announce("waiting until " + local_time_text(until_s) + " for " + name_of(task));
  }
  if (!wait(pause_s)) return false;
  return !not_before_s || time_.wait_until(*not_before_s, between_.stop_requests, [this] {
    service_.idle(std::chrono::steady_clock::now());
  });
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
    spdlog::info("{}, {} of {}{}", name_of(task), number, tasks_.size(),
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

// A drive that is off for a while, or boots, is no reason to lose all that is left of the night: as
// often as the rig file lets a dwell of it be tried again.
int Night::sweep_patiently(const NightTask& task, TaskState state) {
  for (std::uint32_t failed = 0;; ++failed) {
    try {
      return sweep(task, state);
    } catch (const DevicesFailed& failure) {
      const RetrySettings retry = configured_rig(task, drivers_)->rig().runner.retry;
      if (failed == retry.faults) {
        std::string what = failure.what();
        if (failed > 0)
          what += " (" + std::to_string(failed) + " tries to begin again are spent, [retry])";
        // The next rig is not moved beside a drive that may still be on.
        if (!failure.not_released().empty()) throw NotToBeArmed{what};
        throw DevicesFailed{what};
      }
      notes_[task.sweep_file] =
          "begun at try " + std::to_string(failed + 2) + ": " + failure.what();
      spdlog::warn("{}: {}; once more in {} s, {} of {} ([retry])", name_of(task), failure.what(),
                   retry.wait_s, failed + 1, retry.faults);
      service_.status("waiting to try " + name_of(task) + " again");
      if (!wait(retry.wait_s)) return exit_interrupted;
    }
  }
}

// Runs what is left of a task; the exit code of a run.
int Night::attend(const NightTask& task, std::size_t number, const NightFolder& folder) {
  const std::optional<record::StoredRun> before = begun_run(task);
  const TaskState state = state_of(before);
  if (state == TaskState::done) return exit_done;
  if (state == TaskState::stopped && !job_.stop_on_stop && to_be_looked_at(*before).empty()) {
    return exit_stopped;  // it had its chance
  }
  if (state == TaskState::not_begun && !wait_for(task, folder)) return exit_interrupted;
  if (between_.stop_requests.load() > 0) return exit_interrupted;
  tell(task, state, number);
  const int ended = sweep_patiently(task, state);
  if (!fs::exists(task.sweep_file)) return ended;  // told to stop before it began
  const record::StoredRun run = record::read_sweep(task.sweep_file);
  if (ended == exit_stopped) ended_by_ = to_be_looked_at(run);
  std::uint64_t ticks = 0;
  for (const record::StoredTiming& timing : run.timings) ticks += timing.ticks + timing.skipped;
  time_.pass(static_cast<double>(ticks) / run.plan.rate_hz);
  return ended;
}

int Night::run() {
  const StopOnSignal stop_on_signal{between_};
  const NightFolder folder{job_, time_};
  age_s_ = static_cast<double>(std::max<std::int64_t>(0, time_.now_s() - folder.began_s()));
  taken_up_s_ = time_.elapsed_s();
  service_.ready();
  int code = exit_done;
  std::size_t number = 0;
  for (const NightTask& task : tasks_) {
    int ended = exit_stopped;
    try {
      ended = attend(task, ++number, folder);
    } catch (const NotToBeArmed& error) {
      spdlog::error("{}", error.what());
      failures_[task.sweep_file] = ended_by_ = error.what();
    } catch (const std::exception& error) {
      spdlog::error("{}", error.what());
      failures_[task.sweep_file] = error.what();
    }
    if (ended == exit_interrupted) return conclude(folder, exit_interrupted);
    if (ended != exit_done) code = exit_stopped;
    if (!ended_by_.empty()) {
      ended_by_ = name_of(task) + ": " + ended_by_;
      spdlog::error("the night ends here, until a person has looked: {}", ended_by_);
      break;
    }
    if (ended != exit_done && job_.stop_on_stop) break;
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
    if (const auto failure = failures_.find(row.file); failure != failures_.end()) {
      row.outcome = "failed";
      row.detail = failure->second;
    } else if (row.outcome == "not run") {
      if (!ended_by_.empty()) row.detail = "a person has to look first, " + ended_by_;
    } else if (const auto note = notes_.find(row.file); note != notes_.end()) {
      row.detail += (row.detail.empty() ? "" : "; ") + note->second;
    }
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
