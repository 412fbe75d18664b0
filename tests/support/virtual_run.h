// A whole sweep over a simulated rig in virtual time, production code from plan to records.
#pragma once

#include <cmath>
#include <vector>

#include "sim/simulated_rig.h"
#include "support/collecting_sink.h"
#include "sweep/clock.h"
#include "sweep/guard.h"
#include "sweep/plan.h"
#include "sweep/runner.h"

namespace sinerig::test {

struct VirtualRun {
  CollectingSink sink;
  RunOutcome outcome;
};

inline GuardSettings open_guard(std::size_t sensors) {
  GuardSettings settings;
  settings.channels.resize(sensors);
  return settings;
}

inline VirtualRun run_virtual(const SweepPlan& plan, const sim::SimulatedRigSettings& rig_settings,
                              GuardSettings guard_settings, RunnerSettings runner_settings = {}) {
  VirtualRun run;
  VirtualClock clock{TickGrid{plan.rate_hz}};
  sim::SimulatedRig rig{rig_settings, clock};
  std::vector<Sensor*> sensors;
  for (std::size_t i = 0; i < rig_settings.sensors.size(); ++i) sensors.push_back(&rig.sensor(i));
  Guard guard{std::move(guard_settings), clock.grid().period_s()};
  SweepRunner runner{plan, runner_settings, clock, rig.actuator(), sensors, guard, run.sink};
  RunControl control;
  run.outcome = runner.run(control);
  return run;
}

inline VirtualRun run_virtual(const SweepPlan& plan,
                              const sim::SimulatedRigSettings& rig_settings) {
  return run_virtual(plan, rig_settings, open_guard(rig_settings.sensors.size()));
}

}  // namespace sinerig::test
