// Plays a plan through the loop: wait, write, read, guard, correlate, hand over.
#pragma once

#include <atomic>
#include <cstdint>
#include <span>
#include <vector>

#include "drivers/driver.h"
#include "sweep/clock.h"
#include "sweep/correlator.h"
#include "sweep/estimator.h"
#include "sweep/excitation.h"
#include "sweep/guard.h"
#include "sweep/plan.h"
#include "sweep/records.h"

namespace sinerig {

// Shared between the loop and whoever watches or stops it.
struct RunControl {
  std::atomic<int> stop_requests{0};  // 1: ramp down, 2: neutral at once
  std::atomic<std::uint32_t> dwell{0};
  std::atomic<std::uint64_t> tick{0};
};

struct RunnerSettings {
  bool record_samples = false;
  double min_excitation = 1e-3;  // |U| of a tone below this part of its amplitude is no excitation
};

struct RunOutcome {
  Trip trip;  // cause none: the plan ran to its end
  std::uint32_t dwells_done = 0;
  std::uint64_t ticks = 0;
  std::uint64_t skipped_ticks = 0;
};

class SweepRunner {
 public:
  // All memory of the loop is taken here. The actuator, sensors, clock, guard and sink must outlive
  // the runner; `plan` is copied.
  SweepRunner(SweepPlan plan, RunnerSettings settings, Clock& clock, Actuator& actuator,
              std::span<Sensor* const> sensors, Guard& guard, RecordSink& sink);

  // Runs to the end of the plan, a trip of the guard or a stop request. The actuator is released on
  // every way out.
  RunOutcome run(RunControl& control) noexcept;

 private:
  enum class Phase : std::uint8_t { settling, measuring };

  bool step(RunControl& control) noexcept SINERIG_NONBLOCKING;
  void exchange(double command, std::uint64_t tick) noexcept SINERIG_NONBLOCKING;
  void measure(std::uint64_t tick, std::uint64_t ticks) noexcept SINERIG_NONBLOCKING;
  void begin_dwell(std::uint64_t tick) noexcept;
  void settle_again() noexcept;
  void finish_block(std::uint64_t tick) noexcept;
  void finish_dwell(std::uint64_t tick) noexcept;
  Point make_point(std::size_t tone, std::size_t sensor) const noexcept;
  void account(const Tick& tick, std::uint64_t ticks) noexcept;
  void note_sensor(std::size_t sensor, const Sample& sample, std::uint64_t tick) noexcept;
  void announce(const Event& event) noexcept { sink_.put(event); }
  // The command itself is known; the correlator holds the channels from `applied` on.
  Coefficients coefficients(std::size_t channel, std::size_t tone) const noexcept {
    return correlator_.coefficients(channel - applied_channel, tone);
  }
  ResponseEstimator& estimator(std::size_t tone, std::size_t sensor) noexcept {
    return estimators_[tone * sensors_.size() + sensor];
  }

  SweepPlan plan_;
  RunnerSettings settings_;
  Clock& clock_;
  Actuator& actuator_;
  std::vector<Sensor*> sensors_;
  Guard& guard_;
  RecordSink& sink_;

  Excitation excitation_;
  Correlator correlator_;
  std::vector<ResponseEstimator> estimators_;  // per tone and sensor
  std::vector<double> values_;                 // command, applied, sensors: this tick
  std::vector<Fault> sensor_faults_;           // of the last tick
  std::vector<std::uint64_t> range_faults_;    // per sensor, this dwell

  std::uint32_t dwell_ = 0;
  Phase phase_ = Phase::settling;
  std::uint64_t settle_left_ = 0;
  std::uint64_t dwell_ticks_ = 0;  // grid ticks since the dwell began
  std::uint32_t blocks_done_ = 0;
  bool command_disturbed_ = false;  // this tick's command was late or lost
  bool sensors_complete_ = true;    // this tick has a good sample of every sensor
  DwellTiming timing_;
  std::uint64_t last_tick_ = 0;
  RunOutcome outcome_;
};

}  // namespace sinerig
