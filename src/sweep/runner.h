// Plays a plan through the loop: wait, write, read, guard, correlate, hand over.
#pragma once

#include <atomic>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "drivers/driver.h"
#include "sweep/clock.h"
#include "sweep/excitation.h"
#include "sweep/excitation_check.h"
#include "sweep/guard.h"
#include "sweep/known_modes.h"
#include "sweep/leveller.h"
#include "sweep/measurement.h"
#include "sweep/model_trust.h"
#include "sweep/plan.h"
#include "sweep/probe.h"
#include "sweep/records.h"
#include "sweep/refiner.h"

namespace sinerig {

// Shared between the loop and whoever watches or stops it.
struct RunControl {
  std::atomic<int> stop_requests{0};  // 1: ramp down, 2: neutral at once
  std::atomic<std::uint32_t> dwell{0};
  std::atomic<std::uint64_t> tick{0};
};

struct RunnerSettings {
  Pairs responses{};                     // empty: every sensor over what was applied
  std::vector<std::size_t> readbacks{};  // sensors that read the excitation back
  bool record_samples = false;
  double min_excitation = 1e-3;  // |U| of a tone below this part of its amplitude is no excitation
  double max_lateness = 0.5;     // of a period: a command later than this disturbs the plant
  std::optional<KnownModes> modes{};  // for settling by a model; without, the finder is asked
  ModeFinder* finder = nullptr;       // must outlive the runner
  bool real_time = false;             // what takes long is done on other threads
  double max_gap_s = 1.0;  // without a tick: the machine slept, nobody minded the actuator
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
  bool step(RunControl& control) noexcept SINERIG_NONBLOCKING;
  void exchange(double command, const Tick& tick) noexcept SINERIG_NONBLOCKING;
  bool applied_late(std::int64_t offset_ns) noexcept SINERIG_NONBLOCKING;
  void probe(bool disturbed) noexcept SINERIG_NONBLOCKING;
  void measure(std::uint64_t tick, bool disturbed) noexcept SINERIG_NONBLOCKING;
  void begin_dwell(std::uint64_t tick) noexcept;
  void put_block(std::uint64_t tick) noexcept;
  void check_excitation(std::uint64_t tick) noexcept;
  void judge_model() noexcept;
  void next_dwell() noexcept;
  bool try_again() noexcept;
  void finish_dwell() noexcept;
  void refine() noexcept;
  Point make_point(std::size_t pair, std::size_t tone) const noexcept;
  void account(const Tick& tick, std::uint64_t ticks) noexcept;
  void note_sensor(std::size_t sensor, const Sample& sample, std::uint64_t tick) noexcept;
  void announce(const Event& event) noexcept { sink_.put(event); }

  SweepPlan plan_;
  RunnerSettings settings_;
  Clock& clock_;
  Actuator& actuator_;
  std::vector<Sensor*> sensors_;
  Guard& guard_;
  RecordSink& sink_;

  std::vector<const Dwell*> dwells_;  // of the plan, then those added
  Refiner refiner_;
  Excitation excitation_;
  Leveller leveller_;
  Measurement measurement_;
  Prober prober_;
  ModelTrust trust_;
  bool remeasuring_ = false;
  std::vector<Observation> observations_;    // applied, sensors: this tick
  double command_ = 0.0;                     // this tick
  std::vector<Fault> sensor_faults_;         // of the last tick
  std::vector<std::uint64_t> range_faults_;  // per sensor, this dwell

  std::uint32_t dwell_ = 0;
  std::uint32_t blocks_ = 0;
  std::uint64_t settle_left_ = 0;
  double scale_ = 1.0;             // of this dwell's planned amplitudes
  std::uint32_t attempt_ = 0;      // at this dwell; scale_ is set already where it is not the first
  std::uint64_t dwell_ticks_ = 0;  // grid ticks since the dwell began; 0: it has to begin
  bool given_up_ = false;
  bool command_lost_ = false;
  bool command_late_ = false;
  bool applied_known_ = false;
  std::int64_t applied_offset_ns_ = 0;  // of the last command from its tick
  DwellTiming timing_;
  std::uint64_t last_tick_ = 0;
  RunOutcome outcome_;
};

}  // namespace sinerig
