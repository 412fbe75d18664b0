// Plays a plan through the loop: wait, write, read, guard, correlate, hand over.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "drivers/driver.h"
#include "sweep/clock.h"
#include "sweep/dwell_run.h"
#include "sweep/excitation.h"
#include "sweep/guard.h"
#include "sweep/known_modes.h"
#include "sweep/leveller.h"
#include "sweep/model_trust.h"
#include "sweep/plan.h"
#include "sweep/probe.h"
#include "sweep/records.h"
#include "sweep/recovery.h"
#include "sweep/refiner.h"
#include "sweep/run_control.h"
#include "sweep/runner_settings.h"
#include "sweep/sweep_review.h"

namespace sinerig {

struct RunOutcome {
  Trip trip;  // cause none: the plan ran to its end
  std::uint32_t dwells_done = 0;
  std::uint64_t ticks = 0;
  std::uint64_t skipped_ticks = 0;
  std::uint32_t faults = 0;      // of devices, after which they were or were to be armed again
  std::uint32_t soft_trips = 0;  // after which a dwell was tried again at a lower amplitude
};

// What an earlier, interrupted run of the same plan has left.
struct FinishedDwells {
  std::uint32_t dwells = 0;     // finished, from the first on: the run goes on with the next
  std::vector<Point> points;    // theirs, of all tones and responses
  std::vector<Lesson> lessons;  // in the order in which they were taught
  std::vector<std::uint32_t> condemned;  // of them: to be measured again by detection
  std::vector<std::uint32_t> refined;  // candidates of the plan that refinement has added, in order
};

class SweepRunner {
 public:
  // All memory of the loop is taken here. What is referred to must outlive the runner; `plan` is
  // copied. Without `rearm` a device's fault ends the sweep, whatever the settings say.
  SweepRunner(SweepPlan plan, RunnerSettings settings, Clock& clock, Actuator& actuator,
              std::span<Sensor* const> sensors, Guard& guard, RecordSink& sink,
              Rearm* rearm = nullptr);

  // Before run(): goes on behind the finished dwells instead of beginning with the first, knowing
  // what they have taught: level, refinement, colour of the noise, size of the transient. False
  // when there is nothing left to measure.
  bool go_on(const FinishedDwells& finished);

  // Of the plan, and those that refinement has added so far.
  const std::vector<const Dwell*>& dwells() const noexcept { return dwells_; }

  // Runs to the end of the plan, a trip of the guard or a stop request. The actuator is released on
  // every way out.
  RunOutcome run(RunControl& control) noexcept;

 private:
  bool step(RunControl& control) noexcept SINERIG_NONBLOCKING;
  void exchange(double command, const Tick& tick) noexcept SINERIG_NONBLOCKING;
  bool applied_late(std::int64_t offset_ns) noexcept SINERIG_NONBLOCKING;
  void probe(bool disturbed) noexcept SINERIG_NONBLOCKING;
  void begin_dwell(std::uint64_t tick) noexcept;
  bool under_way() const noexcept { return dwell_ < dwells_.size() && run_.begun(); }
  bool probing() const noexcept {
    return !closing() && !review_.asked() && !preflight_ && prober_.running();
  }
  bool keep_going() noexcept;
  bool pause(std::uint64_t ticks) noexcept SINERIG_NONBLOCKING;
  bool probe_lower() noexcept SINERIG_NONBLOCKING;
  bool recover(RunControl& control) noexcept;
  void conclude_dwell() noexcept;
  bool pass_preflight() noexcept;
  void judge_model() noexcept;
  void check_model() noexcept;
  void next_condemned() noexcept;
  void review() noexcept;
  void hear_review() noexcept;
  bool closing() const noexcept { return dwell_ == dwells_.size() && !review_.asked(); }
  bool try_again() noexcept;
  void repeat_dwell() noexcept;
  void tell_trip(EventKind kind) noexcept;
  void teach_refiner(const Point& point) noexcept SINERIG_NONBLOCKING;
  const Dwell& next_to_measure() const noexcept SINERIG_NONBLOCKING;
  // What is under way has measured nothing of the dwell that it is filed under.
  bool preflight_elsewhere() const noexcept { return preflight_ && dwell_ > 0; }
  void finish_dwell() noexcept;
  void put_points() noexcept;
  void next_dwell() noexcept;
  void account_usage() noexcept SINERIG_NONBLOCKING;
  void refine() noexcept;
  void note_sensor(std::size_t sensor, const Sample& sample, std::uint64_t tick) noexcept;
  void announce(const Event& event) noexcept { sink_.put(event); }

  static constexpr std::uint64_t no_tick = UINT64_MAX;

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
  Recovery recovery_;
  DwellRun run_;
  Prober prober_;
  double probe_scale_ = 1.0;  // lowered by soft limits
  ModelTrust trust_;
  SweepReview review_;
  int reviews_ = 0;
  bool remeasuring_ = false;               // what was modelled with modes that turned out wrong
  std::vector<Observation> observations_;  // applied, sensors: this tick
  double command_ = 0.0;                   // this tick
  struct SensorState {
    std::uint64_t good_ticks = 0;  // in a row
    bool told_faulty = false;
  };
  std::vector<SensorState> sensor_states_;

  std::uint32_t dwell_ = 0;
  double scale_ = 1.0;         // of this dwell's planned amplitudes
  bool scale_chosen_ = false;  // for the attempt that begins
  std::uint32_t attempt_ = 0;  // at this dwell
  bool preflight_;             // is what the dwell is for
  bool from_rest_ = true;      // the loop begins, or goes on after a fault
  bool paused_ = false;        // by a soft limit, the command at neutral
  std::uint64_t pause_left_ = 0;
  std::uint64_t trip_told_ = no_tick;  // tick of the trip that has been announced
  bool command_lost_ = false;
  bool command_late_ = false;
  bool applied_known_ = false;
  std::int64_t applied_offset_ns_ = 0;  // of the last command from its tick
  std::optional<ThreadUsage> usage_;    // of the loop's thread, at the end of the dwell before
  std::uint64_t last_tick_ = 0;
  RunOutcome outcome_;
};

}  // namespace sinerig
