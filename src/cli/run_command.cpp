#include <atomic>
#include <csignal>
#include <filesystem>
#include <iostream>
#include <mutex>
#include <thread>
#include <unistd.h>

#include <spdlog/spdlog.h>

#include "cli/commands.h"
#include "cli/configured_rig.h"
#include "cli/report_file.h"
#include "record/recorder.h"
#include "record/sweep_reader.h"
#include "report/terminal.h"
#include "sweep/outbox.h"
#include "sweep/runner.h"

namespace sinerig::cli {

namespace {

namespace fs = std::filesystem;

// Slots between the loop and the recorder: 4 s of samples at 10 kHz.
constexpr std::size_t outbox_slots = 1U << 16U;
constexpr std::size_t outbox_backlog = 1U << 14U;

constexpr std::chrono::milliseconds progress_interval{50};

// Set by the signal handler, read by the loop on every tick.
std::atomic<RunControl*> running{nullptr};

void count_stop_request(int /*signal*/) {
  if (RunControl* control = running.load()) control->stop_requests.fetch_add(1);
}

// SIGINT, SIGTERM and SIGHUP become stop requests for as long as this lives. A reader of the output
// that goes away (SIGPIPE) is no reason to leave an actuator where it is.
class StopOnSignal {
 public:
  explicit StopOnSignal(RunControl& control) {
    running = &control;
    struct sigaction action {};
    action.sa_handler = count_stop_request;
    sigaction(SIGINT, &action, &old_int_);
    sigaction(SIGTERM, &action, &old_term_);
    sigaction(SIGHUP, &action, &old_hup_);
    action.sa_handler = SIG_IGN;
    sigaction(SIGPIPE, &action, &old_pipe_);
  }
  ~StopOnSignal() {
    sigaction(SIGINT, &old_int_, nullptr);
    sigaction(SIGTERM, &old_term_, nullptr);
    sigaction(SIGHUP, &old_hup_, nullptr);
    sigaction(SIGPIPE, &old_pipe_, nullptr);
    running = nullptr;
  }
  StopOnSignal(const StopOnSignal&) = delete;
  StopOnSignal& operator=(const StopOnSignal&) = delete;

 private:
  struct sigaction old_int_ {};
  struct sigaction old_term_ {};
  struct sigaction old_hup_ {};
  struct sigaction old_pipe_ {};
};

// rig.sweep in the working directory, or rig-2.sweep … when that exists.
std::string default_output(const std::string& rig, bool force) {
  const std::string stem = fs::path{rig}.stem().string();
  std::string name = stem + ".sweep";
  for (int number = 2; !force && fs::exists(name); ++number) {
    name = stem + "-" + std::to_string(number) + ".sweep";
  }
  return name;
}

record::RunInfo run_info(const config::Rig& rig, const SweepPlan& plan) {
  record::RunInfo info{
      .rig_name = rig.file->name(),
      .rig_text = rig.file->text(),
      .clock = rig.clock == config::ClockKind::virtual_time ? "virtual" : "monotonic",
      .channels = {{"command", rig.actuator.unit}, {"applied", rig.actuator.unit}},
      .plan = plan};
  for (const config::Channel& sensor : rig.sensors)
    info.channels.push_back({sensor.name, sensor.unit});
  return info;
}

// Points on their way from the recorder's thread to the one that prints.
class PointInbox {
 public:
  void put(const Record& record) {
    if (const auto* point = std::get_if<Point>(&record)) {
      const std::scoped_lock lock{mutex_};
      points_.push_back(*point);
    }
  }
  std::vector<Point> take() {
    const std::scoped_lock lock{mutex_};
    return std::exchange(points_, {});
  }

 private:
  std::mutex mutex_;
  std::vector<Point> points_;
};

// The loop on its own thread, progress on this one, until both the loop and the recorder are done.
RunOutcome play(SweepRunner& runner, RunControl& control, Outbox& outbox,
                record::SweepWriter& writer, report::Progress& progress) {
  PointInbox inbox;
  record::Recorder recorder{outbox, writer, [&](const Record& record) {
                              inbox.put(record);
                            }};
  RunOutcome outcome;
  std::atomic<bool> done{false};
  std::thread loop{[&] {
    outcome = runner.run(control);
    outbox.close();
    done.store(true);
    done.notify_one();
  }};
  const auto show = [&] {
    for (const Point& point : inbox.take()) progress.point(point);
    progress.update(control.dwell.load());
  };
  while (!done.load()) {
    show();
    std::this_thread::sleep_for(progress_interval);
  }
  loop.join();
  recorder.finish();
  show();
  progress.close();
  return outcome;
}

const char* outcome_name(const RunOutcome& outcome) {
  if (!outcome.trip.tripped()) return "done";
  return outcome.trip.cause == TripCause::stop_requested ? "interrupted" : "stopped";
}

int exit_code(const RunOutcome& outcome) {
  if (!outcome.trip.tripped()) return exit_done;
  return outcome.trip.cause == TripCause::stop_requested ? exit_interrupted : exit_stopped;
}

// The run is safe in its file: a report that cannot be written is a warning.
void report_beside(const std::string& sweep_file) {
  const std::string path = report_path(sweep_file);
  try {
    write_report(sweep_file, path, false);
    spdlog::info("wrote {}, the report: open it in a browser", path);
  } catch (const std::exception& error) {
    spdlog::warn("no report: {}", error.what());
  }
}

}  // namespace

int run_command(const RunOptions& options, const std::vector<DriverKit>& drivers) {
  ConfiguredRig configured{options.rig, drivers};
  const config::Rig& rig = configured.rig();
  const SweepPlan plan = rig.plan();
  Clock& clock = configured.clock();
  spdlog::info("{}, {} of bench time", report::plan_size_text(plan), report::bench_time_text(plan));

  const std::string path =
      options.output.empty() ? default_output(options.rig, options.force) : options.output;
  record::SweepWriter writer{path, run_info(rig, plan),
                             options.force ? record::SweepWriter::IfExists::replace
                                           : record::SweepWriter::IfExists::refuse};
  const bool in_real_time = rig.clock == config::ClockKind::monotonic;
  Outbox outbox{outbox_slots, outbox_backlog,
                in_real_time ? Outbox::WhenFull::keep : Outbox::WhenFull::wait};
  Guard guard{rig.guard, clock.grid().period_s()};
  RunControl control;
  const StopOnSignal stop_on_signal{control};
  try {
    configured.open();
    configured.arm();
  } catch (...) {
    writer.discard();
    throw;
  }
  SweepRunner runner{plan,  rig.runner, clock, configured.actuator(), configured.sensors(),
                     guard, outbox};
  report::Progress progress{std::cout, isatty(STDOUT_FILENO) != 0, plan};
  const RunOutcome outcome = play(runner, control, outbox, writer, progress);

  std::string reason = outcome.trip.tripped() ? describe(outcome.trip, rig.sensor_names()) : "";
  const bool a_device_failed = outcome.trip.cause == TripCause::actuator_fault ||
                               outcome.trip.cause == TripCause::channel_age;
  if (a_device_failed && !configured.fault_reason().empty())
    reason += ": " + configured.fault_reason();
  writer.set("outcome", outcome_name(outcome));
  writer.set("outcome_detail", reason);
  writer.set("dropped_samples", std::to_string(outbox.dropped_samples()));
  writer.finish();

  report::print_run(std::cout, record::read_sweep(path));
  std::cout.flush();  // before the messages on standard error
  if (outcome.trip.tripped()) spdlog::error("{}", reason);
  if (outbox.dropped_samples() > 0) {
    spdlog::warn("{} samples were dropped: the disk is too slow for [output] samples",
                 outbox.dropped_samples());
  }
  spdlog::info("wrote {}", path);
  if (options.report) report_beside(path);
  return exit_code(outcome);
}

}  // namespace sinerig::cli
