// A sweep in virtual time whose records go through the outbox and the recorder, as in `sinerig
// run`, with a live page beside it or without.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <unistd.h>

#include "dashboard/live_run.h"
#include "dashboard/server.h"
#include "record/recorder.h"
#include "record/sweep_reader.h"
#include "sim/simulated_rig.h"
#include "sweep/outbox.h"
#include "sweep/runner.h"

namespace sinerig::test {

inline sim::SimulatedRigSettings served_rig() {
  sim::SimulatedRigSettings rig;
  rig.system = sim::from_transfer_function({60.0}, {1.0, 60.0});
  rig.sensors.resize(1);
  rig.sensors[0].imperfections.noise_rms = 1e-3;
  return rig;
}

inline SweepPlan served_plan(std::uint32_t points) {
  SweepSettings sweep;
  sweep.start_hz = 2.0;
  sweep.stop_hz = 100.0;
  sweep.points = points;
  sweep.amplitude = 0.4;
  sweep.integrate = {.cycles = 8.0, .seconds = 0.2};
  return plan_sweep(sweep, {}, 1000.0);
}

inline GuardSettings served_limits() {
  GuardSettings limits;
  limits.command_min = -1.0;
  limits.command_max = 1.0;
  limits.channels = {{.min = -2.0, .max = 2.0, .rate_per_s = 2000.0}};
  return limits;
}

inline dashboard::LiveSetup served_setup(const SweepPlan& plan) {
  record::StoredRun run;
  run.facts = {{"rig_name", "axis.toml"}, {"rig_text", "[loop]\nrate_hz = 1000\n"}};
  run.channels = {{"command", "Nm"}, {"applied", "Nm"}, {"gyro", "rad/s"}};
  run.plan = plan;
  run.responses = {{1, 2, {}}};
  return {.label = "axis", .run = run, .limits = served_limits(), .in_real_time = true};
}

struct ServedRun {
  record::StoredRun stored;
  RunOutcome outcome;
};

// `live` watches when it is there; `stop_requests` counts as those of a user do.
inline ServedRun run_served(const SweepPlan& plan, RunControl& control, dashboard::LiveRun* live,
                            dashboard::Lateness& lateness) {
  const std::string path = (std::filesystem::temp_directory_path() /
                            ("sinerig-served-" + std::to_string(getpid()) + ".sweep"))
                               .string();
  record::SweepWriter writer{path,
                             {.rig_name = "axis.toml",
                              .rig_text = "",
                              .clock = "virtual",
                              .channels = {{"command", "Nm"}, {"applied", "Nm"}, {"gyro", "rad/s"}},
                              .plan = plan},
                             record::SweepWriter::IfExists::replace};
  VirtualClock virtual_clock{TickGrid{plan.rate_hz}};
  dashboard::WatchedClock watched{virtual_clock, lateness};
  Clock& clock = live != nullptr ? static_cast<Clock&>(watched) : virtual_clock;
  sim::SimulatedRig rig{served_rig(), virtual_clock};
  Sensor* const sensors[] = {&rig.sensor(0)};
  Guard guard{served_limits(), clock.grid().period_s()};
  Outbox outbox{1U << 12U, 64, Outbox::WhenFull::wait};
  RunnerSettings settings;
  settings.record_samples = live != nullptr;
  SweepRunner runner{plan, settings, clock, rig.actuator(), sensors, guard, outbox};
  ServedRun run;
  {
    record::Recorder recorder{outbox, writer,
                              [live](const Record& record) {
                                if (live != nullptr) live->take(record);
                              },
                              record::Recorder::Samples::watched};
    run.outcome = runner.run(control);
    outbox.close();
    recorder.finish();
  }
  writer.finish();
  run.stored = record::read_sweep(path);
  std::filesystem::remove(path);
  return run;
}

}  // namespace sinerig::test
