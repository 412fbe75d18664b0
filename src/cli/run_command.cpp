#include <atomic>
#include <filesystem>
#include <mutex>
#include <thread>

#include <spdlog/spdlog.h>

#include "cli/commands.h"
#include "cli/configured_rig.h"
#include "cli/found_modes.h"
#include "cli/live_view.h"
#include "cli/report_file.h"
#include "cli/run_teller.h"
#include "cli/stop_on_signal.h"
#include "record/recorder.h"
#include "sweep/outbox.h"
#include "sweep/runner.h"

namespace sinerig::cli {

namespace {

namespace fs = std::filesystem;

// Slots between the loop and the recorder: 4 s of samples at 10 kHz.
constexpr std::size_t outbox_slots = 1U << 16U;
constexpr std::size_t outbox_backlog = 1U << 14U;

constexpr std::chrono::milliseconds progress_interval{50};

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

// Who hears of a run: the terminal, a script, the live page. Each may be absent.
struct Audience {
  RunTeller& teller;
  LiveView* view;
  record::Recorder::Samples samples;
};

// The loop on its own thread, its story told on this one, until both the loop and the recorder are
// done.
RunOutcome play(SweepRunner& runner, RunControl& control, Outbox& outbox,
                record::SweepWriter& writer, const Audience& audience) {
  PointInbox inbox;
  const auto observe = [&](const Record& record) {
    inbox.put(record);
    if (audience.view != nullptr) audience.view->run().take(record);
  };
  record::Recorder recorder{outbox, writer, observe, audience.samples};
  RunOutcome outcome;
  std::atomic<bool> done{false};
  std::thread loop{[&] {
    outcome = runner.run(control);
    outbox.close();
    done.store(true);
    done.notify_one();
  }};
  const auto tell = [&] {
    for (const Point& point : inbox.take()) audience.teller.point(point);
    audience.teller.update(control.dwell.load(), control.tick.load());
  };
  while (!done.load()) {
    tell();
    std::this_thread::sleep_for(progress_interval);
  }
  loop.join();
  recorder.finish();
  tell();
  audience.teller.close();
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

// The run is safe in its file: a report that cannot be written is a warning. The path, empty then.
std::string report_beside(const std::string& sweep_file) {
  const std::string path = report_path(sweep_file);
  try {
    write_report(sweep_file, path, false);
    return path;
  } catch (const std::exception& error) {
    spdlog::warn("no report: {}", error.what());
    return {};
  }
}

// Why the run was stopped, in words; empty where it was not.
std::string reason_of(const RunOutcome& outcome, const ConfiguredRig& configured) {
  if (!outcome.trip.tripped()) return {};
  std::string reason = describe(outcome.trip, configured.rig().sensor_names());
  const bool by_device = outcome.trip.cause == TripCause::actuator_fault ||
                         outcome.trip.cause == TripCause::channel_age;
  if (by_device && !configured.fault_reason().empty()) reason += ": " + configured.fault_reason();
  return reason;
}

std::optional<KnownModes> earlier_modes(const config::Rig& rig) {
  if (rig.prior.empty()) return std::nullopt;
  std::vector<std::string> outputs;
  for (const Pair& pair : rig.runner.responses) {
    outputs.push_back(rig.sensors.at(pair.output - 1).name);
  }
  return modes_of_file(rig.prior, outputs);
}

}  // namespace

int run_command(const RunOptions& options, const std::vector<DriverKit>& drivers) {
  ConfiguredRig configured{options.rig, drivers};
  const config::Rig& rig = configured.rig();
  const SweepPlan plan = rig.plan();
  Clock& clock = configured.clock();
  const std::optional<KnownModes> modes = earlier_modes(rig);
  RunControl control;
  const StopOnSignal stop_on_signal{control};
  const std::string path =
      options.output.empty() ? default_output(options.rig, options.force) : options.output;
  RunTeller teller{options.voice, rig, plan};
  const std::unique_ptr<LiveView> view =
      options.serve ? std::make_unique<LiveView>(*options.serve, rig, plan, clock, control)
                    : nullptr;
  teller.plan(view ? view->url() : "");

  record::SweepWriter writer{path, run_info(rig, plan),
                             options.force ? record::SweepWriter::IfExists::replace
                                           : record::SweepWriter::IfExists::refuse};
  const bool in_real_time = rig.clock == config::ClockKind::monotonic;
  Outbox outbox{outbox_slots, outbox_backlog,
                in_real_time ? Outbox::WhenFull::keep : Outbox::WhenFull::wait};
  Guard guard{rig.guard, clock.grid().period_s()};
  try {
    configured.open();
    configured.arm();
  } catch (...) {
    writer.discard();
    throw;
  }
  RunnerSettings settings = rig.runner;
  IdentifiedModes finder;
  settings.finder = &finder;
  settings.real_time = in_real_time;
  settings.modes = modes;
  if (view) settings.record_samples = true;
  SweepRunner runner{
      plan,  settings, view ? view->clock() : clock, configured.actuator(), configured.sensors(),
      guard, outbox};
  const bool keep_samples = rig.runner.record_samples || !view;
  const RunOutcome outcome = play(runner, control, outbox, writer,
                                  {.teller = teller,
                                   .view = view.get(),
                                   .samples = keep_samples ? record::Recorder::Samples::written
                                                           : record::Recorder::Samples::watched});

  RunEnd end{.outcome = outcome_name(outcome),
             .reason = reason_of(outcome, configured),
             .sweep_file = path,
             .dropped_samples = rig.runner.record_samples ? outbox.dropped_samples() : 0};
  writer.set("outcome", end.outcome);
  writer.set("outcome_detail", end.reason);
  writer.set("dropped_samples", std::to_string(end.dropped_samples));
  writer.finish();
  if (options.report) end.report_file = report_beside(path);
  if (view) view->finish(end);
  teller.end(end);
  return exit_code(outcome);
}

}  // namespace sinerig::cli
