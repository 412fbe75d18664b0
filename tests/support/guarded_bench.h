// The loop with fakes on every side, for looking at what the actuator is given around a violation.
#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <numbers>

#include "support/collecting_sink.h"
#include "support/fake_rig.h"
#include "sweep/guard.h"
#include "sweep/plan.h"
#include "sweep/runner.h"

namespace sinerig::test {

// Collects, and stops taking records from a tick on.
class StallingSink final : public RecordSink {
 public:
  explicit StallingSink(const Clock& clock) : clock_{clock} {}

  void put(const Record& record) noexcept override { records.put(record); }
  void put_sample(const TickSamples& samples) noexcept override { records.put_sample(samples); }
  bool flush() noexcept override { return clock_.now().tick < stalled_from; }

  CollectingSink records;
  std::uint64_t stalled_from = UINT64_MAX;

 private:
  const Clock& clock_;
};

// 0.5 sin(2π f t) about a neutral command of 0.1, one sensor that reads 0.2.
struct GuardedBench {
  static constexpr double rate_hz = 1000.0;
  static constexpr double neutral = 0.1;
  static constexpr double amplitude = 0.5;
  static constexpr double reading = 0.2;

  explicit GuardedBench(double frequency = 20.0) : frequency_hz{frequency} {
    settings.neutral = neutral;
    settings.channels.resize(1);
    SweepSettings sweep;
    sweep.spacing = Spacing::list;
    sweep.frequencies_hz = {frequency_hz};
    sweep.offset = neutral;
    sweep.amplitude = amplitude;
    sweep.settling = Settling::fixed;
    sweep.target_db = 0.0;
    sweep.target_deg = 0.0;
    sweep.settle = {.cycles = 1.0, .seconds = 0.0};
    sweep.integrate = {.cycles = 2.0, .seconds = 0.0};
    plan = plan_sweep(sweep, {}, rate_hz);
  }

  RunOutcome run(Rearm* rearm = nullptr) {
    Guard guard{settings, 1.0 / rate_hz};
    Sensor* const sensors[] = {&sensor};
    SweepRunner runner{plan, runner_settings, clock, actuator, sensors, guard, sink, rearm};
    return runner.run(control);
  }

  double planned(std::uint64_t tick) const {
    const double turns = std::fmod(frequency_hz / rate_hz * static_cast<double>(tick), 1.0);
    return neutral + amplitude * std::sin(2.0 * std::numbers::pi * turns);
  }

  double frequency_hz;
  ScriptedClock clock{rate_hz};
  FakeActuator actuator{clock, neutral};
  FakeSensor sensor{clock, [](std::uint64_t) {
                      return reading;
                    }};
  StallingSink sink{clock};
  GuardSettings settings;
  RunnerSettings runner_settings;
  RunControl control;
  SweepPlan plan;
};

}  // namespace sinerig::test
