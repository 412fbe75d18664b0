#include "cli/recorded_run.h"

#include <algorithm>
#include <cmath>

#include <spdlog/spdlog.h>

#include "cli/found_modes.h"
#include "cli/included_files.h"
#include "cli/played_run.h"
#include "cli/real_time.h"
#include "cli/report_file.h"
#include "cli/stop_on_signal.h"

namespace sinerig::cli {

namespace {

// Slots between the loop and the recorder: 4 s of samples at 10 kHz.
constexpr std::size_t outbox_slots = 1U << 16U;
constexpr std::size_t outbox_backlog = 1U << 14U;

const char* outcome_name(const RunOutcome& outcome) {
  if (!outcome.trip.tripped()) return "done";
  return outcome.trip.cause == TripCause::stop_requested ? "interrupted" : "stopped";
}

int exit_code(const std::string& outcome) {
  if (outcome == "done") return exit_done;
  return outcome == "interrupted" ? exit_interrupted : exit_stopped;
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
std::string reason_of(const Played& played, const Outbox& outbox, const ConfiguredRig& configured) {
  const Trip& trip = played.outcome.trip;
  if (!trip.tripped()) return played.disk_failure;
  std::string reason = describe(trip, configured.rig().sensor_names());
  const bool by_device =
      trip.cause == TripCause::actuator_fault || trip.cause == TripCause::channel_age;
  if (const std::string said = configured.fault_reason(trip); by_device && !said.empty())
    reason += ": " + said;
  if (played.outcome.faults > 0 && trip.device_fault()) {
    reason +=
        " (" + std::to_string(played.outcome.faults) + " tries to arm again are spent, [retry])";
  }
  if (!played.disk_failure.empty()) {
    reason += ": " + played.disk_failure;
  } else if (trip.cause == TripCause::recorder_stalled) {
    reason += outbox.overdue() ? ": the disk took longer over a finished point than [output] "
                                 "max_lag_s allows"
                               : ": the queue in front of it is full";
  }
  return reason;
}

// In a handler: of a run that was asked to stop before its loop.
std::string reason_not_to_begin() {
  const std::string reason = "stop requested before the sweep began";
  try {
    throw;
  } catch (const StopRequested&) {
    return reason;
  } catch (const std::exception& failure) {
    return reason + ": " + failure.what();
  }
}

template <class Work>
void of_devices(ConfiguredRig& configured, Work work) {
  try {
    work();
  } catch (const StopRequested&) {
    throw;
  } catch (const NotToBeArmed&) {
    throw;
  } catch (const config::ConfigError&) {
    throw;
  } catch (const std::exception& failure) {
    configured.keep_released();
    const std::string missing = configured.not_released();
    throw DevicesFailed{failure.what() + (missing.empty() ? "" : "; " + missing), missing};
  }
}

// Once more after making room. Says what the disk said where that failed, too.
std::string put_down_end(record::SweepWriter& writer, const RunEnd& end) {
  const auto put_down = [&] {
    writer.set("dropped_samples", std::to_string(end.dropped_samples));
    writer.end_part(end.outcome, end.reason);
  };
  try {
    try {
      put_down();
    } catch (const record::SweepFileError&) {
      if (!writer.rescue()) throw;
      put_down();
    }
    writer.finish();
    return {};
  } catch (const record::SweepFileError& error) {
    return error.what();
  }
}

// Of the sweep file that the rig names; without one they have to be found.
std::optional<KnownModes> earlier_modes(const config::Rig& rig) {
  if (rig.prior.empty()) return std::nullopt;
  std::vector<std::string> outputs;
  for (const Pair& pair : rig.runner.responses) {
    outputs.push_back(rig.sensors.at(pair.output - 1).name);
  }
  try {
    return modes_of_file(rig.prior, outputs);
  } catch (const record::SweepFileError& error) {
    throw config::ConfigError(rig.file->name() + ": [sweep] prior: " + error.what());
  }
}

// Whether points that an earlier part has modelled are left without the review that ends such a
// sweep: with no dwell of the plan to come the modes, which that part had found, are not looked
// for.
bool without_review(const SweepPlan& plan, const SweepRunner& runner,
                    const FinishedDwells& finished) {
  const auto modelled = [](const Point& point) {
    return point.settled_by == SettledBy::model && point.status != PointStatus::stopped;
  };
  return plan.judgement.settling == Settling::model && finished.dwells == runner.dwells().size() &&
         std::any_of(finished.points.begin(), finished.points.end(), modelled);
}

void warn_of_empty_preflight(const PreflightSettings& preflight) {
  if (!preflight.wanted || preflight.knows_gain() || preflight.knows_sign()) return;
  spdlog::warn(
      "[sweep] preflight: without preflight_gain and preflight_phase_deg it looks at the noise "
      "alone; a wrong sign or unit passes");
}

}  // namespace

record::RunInfo run_info(const config::Rig& rig, const SweepPlan& plan) {
  record::RunInfo info{
      .rig_name = rig.file->name(),
      .rig_text = rig.file->text(),
      .included = included_text(rig),
      .clock = rig.clock == config::ClockKind::virtual_time ? "virtual" : "monotonic",
      .channels = {{"command", rig.actuator.unit}, {"applied", rig.actuator.unit}},
      .plan = plan};
  for (const config::Channel& sensor : rig.sensors)
    info.channels.push_back({sensor.name, sensor.unit});
  return info;
}

int record_run(ConfiguredRig& configured, const SweepPlan& plan, const RecordedRunOptions& options,
               const OpenSweepFile& open_file, const record::UnfinishedRun* earlier) {
  const config::Rig& rig = configured.rig();
  warn_of_empty_preflight(rig.runner.preflight);
  if (earlier != nullptr) refuse_changed_include(earlier->stored, rig, options.sweep_file);
  Clock& clock = configured.clock();
  RunControl& control = configured.control();
  const StopOnSignal stop_on_signal{control};
  std::optional<ServiceNotifier> own_service;
  ServiceNotifier& service = options.service != nullptr ? *options.service : own_service.emplace();
  // From the end of the loop on no tick feeds the watchdog, and a slow disk may take its time.
  const auto at_rest = [&] {
    service.ready();  // where nothing was left to measure: an end before that counts as a failure
    own_service ? service.stopping() : service.idle(std::chrono::steady_clock::now());
  };
  const SignOfLife waiting = [&] {
    return control.progress();
  };
  const std::optional<KnownModes> modes =
      attended(service, for_at_most(most_desk_work), [&] { return earlier_modes(rig); });
  const std::unique_ptr<realtime::LoopThread> loop = make_loop_thread(rig);
  RunTeller teller{options.voice, options.table, rig, plan};
  const std::unique_ptr<LiveView> view =
      options.serve ? std::make_unique<LiveView>(*options.serve, rig, plan, clock, control)
                    : nullptr;
  teller.plan(view ? view->url() : "");

  const std::unique_ptr<record::SweepWriter> writer = open_file();
  record_grants(*writer, loop->grants());
  const bool in_real_time = rig.clock == config::ClockKind::monotonic;
  Outbox outbox{outbox_slots, outbox_backlog,
                in_real_time ? Outbox::WhenFull::keep : Outbox::WhenFull::wait,
                static_cast<std::uint64_t>(std::ceil(rig.max_lag_s * rig.rate_hz))};
  Guard guard{rig.guard, clock.grid().period_s()};
  RunnerSettings settings = rig.runner;
  if (view) settings.record_samples = true;
  IdentifiedModes finder;
  settings.finder = &finder;
  settings.real_time = in_real_time;
  settings.modes = modes;
  std::unique_ptr<SweepRunner> runner;
  bool to_measure = true;
  try {
    of_devices(configured, [&] { attended(service, waiting, [&] { configured.open(); }); });
    runner = std::make_unique<SweepRunner>(plan, settings, view ? view->clock() : clock,
                                           configured.actuator(), configured.sensors(), guard,
                                           outbox, &configured);
    if (earlier != nullptr) {
      to_measure = runner->go_on(earlier->finished);
      control.dwell.store(earlier->finished.dwells);
      teller.resume(earlier->finished.points);
      if (view) view->run().resume(earlier->finished);
    }
    if (to_measure)
      of_devices(configured, [&] { attended(service, waiting, [&] { configured.arm(); }); });
    writer->begin_part(earlier != nullptr ? earlier->start : record::PartStart{});
    if (earlier != nullptr && !modes && without_review(plan, *runner, earlier->finished)) {
      writer->write(Event{.kind = EventKind::model_doubted,
                          .dwell = earlier->finished.dwells,
                          .value = not_reviewed});
      spdlog::warn(
          "{}: its modelled points are not held against a model of the whole sweep any more: the "
          "modes were lost with the interruption",
          writer->path());
    }
    // The disk may have taken longer than a queue of the kernel lasts.
    if (to_measure) of_devices(configured, [&] { configured.catch_up(); });
  } catch (...) {
    writer->discard();
    if (control.stop_requests.load() == 0) throw;
    const RunEnd end{.outcome = "interrupted", .reason = reason_not_to_begin(), .sweep_file = ""};
    at_rest();
    if (view) view->finish(end);
    teller.end(end);
    return exit_interrupted;
  }
  Played played;
  if (to_measure) {
    const bool keep_samples = rig.runner.record_samples || !view;
    played = play(plan, *loop, *runner, control, outbox, *writer,
                  {.teller = teller,
                   .service = service,
                   .at_rest = at_rest,
                   .view = view.get(),
                   .samples = keep_samples ? record::Recorder::Samples::written
                                           : record::Recorder::Samples::watched,
                   .tick_s = in_real_time ? clock.grid().period_s() : 0.0,
                   .disk_patience = std::chrono::duration<double>{rig.max_lag_s}});
  } else {
    at_rest();
  }

  for (const Remark& remark : configured.remarks())
    if (remark.doubts) spdlog::warn("{}", remark.text);
  RunEnd end{.outcome = played.disk_failure.empty() ? outcome_name(played.outcome) : "stopped",
             .reason = reason_of(played, outbox, configured),
             .sweep_file = writer->path(),
             .dropped_samples = rig.runner.record_samples ? outbox.dropped_samples() : 0};
  if (const std::string missing = configured.not_released(); !missing.empty()) {
    if (end.outcome == "done") end.outcome = "stopped";
    end.reason += (end.reason.empty() ? "" : "; ") + missing;
  }
  attended(service, for_at_most(most_desk_work), [&] {
    if (const std::string unsaid = put_down_end(*writer, end); !unsaid.empty()) {
      end.outcome = "stopped";
      end.reason += (end.reason.empty() ? "" : "; not in the file, ") + unsaid;
      end.sweep_file = writer->path();  // another, where its name was taken away
    }
    if (options.report) end.report_file = report_beside(writer->path());
  });
  if (view) view->finish(end);
  teller.end(end);
  return exit_code(end.outcome);
}

}  // namespace sinerig::cli
