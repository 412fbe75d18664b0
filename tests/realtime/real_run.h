// The loop in real time over drivers, with a mark when it has warmed up and one before it lets go
// of the actuator.
#pragma once

#include <functional>
#include <vector>

#include "realtime/traced_thread.h"
#include "support/outside_the_loop.h"
#include "support/virtual_run.h"
#include "sweep/outbox.h"

namespace sinerig::test {

class MarkingClock final : public Clock {
 public:
  static constexpr std::uint64_t warm_up_ticks = 60;

  MarkingClock() : Clock{TickGrid{1000.0}} {}
  Tick wait() noexcept SINERIG_NONBLOCKING override {
    if (++waits_ == warm_up_ticks) {
      const OutsideTheLoop noting_down;
      mark();
    }
    return clock_.wait();
  }
  Instant now() const noexcept SINERIG_NONBLOCKING override { return clock_.now(); }
  std::int64_t time_ns(Instant instant) const noexcept SINERIG_NONBLOCKING override {
    return clock_.time_ns(instant);
  }
  std::optional<ThreadUsage> usage() const noexcept SINERIG_NONBLOCKING override {
    return clock_.usage();
  }
  std::uint64_t waits() const noexcept { return waits_; }

 private:
  MonotonicClock clock_{grid()};
  std::uint64_t waits_ = 0;
};

class MarkingActuator final : public Actuator {
 public:
  explicit MarkingActuator(Actuator& inner) : inner_{inner} {}
  Sample write(double command) noexcept SINERIG_NONBLOCKING override {
    return inner_.write(command);
  }
  void release() noexcept override {
    mark();
    inner_.release();
  }

 private:
  Actuator& inner_;
};

struct RealRun {
  RunOutcome outcome;
  std::vector<DwellTiming> timings;
  std::uint64_t marked_ticks = 0;
};

// Two dwells, about half a second.
inline RealRun run_in_real_time(MarkingClock& clock, Actuator& inner,
                                const std::vector<Sensor*>& sensors) {
  SweepSettings sweep;
  sweep.spacing = Spacing::list;
  sweep.frequencies_hz = {50.0, 100.0};
  sweep.amplitude = 0.5;
  sweep.settling = Settling::fixed;
  sweep.target_db = sweep.target_deg = 0.0;
  sweep.settle = {.cycles = 2.0, .seconds = 0.05};
  sweep.integrate = {.cycles = 4.0, .seconds = 0.1};
  MarkingActuator actuator{inner};
  // A machine with too much to do is no failure of these tests.
  GuardSettings guard_settings = open_guard(sensors.size());
  guard_settings.max_age_ns = 0;
  guard_settings.max_write_faults = 0;
  Guard guard{guard_settings, clock.grid().period_s()};
  Outbox outbox{1U << 14U, 1U << 12U, Outbox::WhenFull::keep};
  SweepRunner runner{plan_sweep(sweep, {}, clock.grid().rate_hz()),
                     {.responses = {},
                      .readbacks = {},
                      .record_samples = true,
                      .max_gap_s = 60.0,
                      .real_time = true},
                     clock,
                     actuator,
                     sensors,
                     guard,
                     outbox};
  RunControl control;
  RealRun run;
  run.outcome = runner.run(control);
  run.marked_ticks = clock.waits() - MarkingClock::warm_up_ticks + 1;
  for (Record record; outbox.try_take(record);)
    if (const auto* timing = std::get_if<DwellTiming>(&record)) run.timings.push_back(*timing);
  return run;
}

// 0: the sweep went through to its end.
inline int exit_code_of(const RealRun& run) {
  return run.outcome.trip.tripped() ? 3 : run.outcome.dwells_done == 2 ? 0 : 4;
}

// The calls of the loop's thread. Under the real-time sanitizer it is the sanitizer that looks, and
// there are none to be had.
#ifdef SINERIG_UNDER_RTSAN
inline constexpr bool loop_is_traced = false;
#else
inline constexpr bool loop_is_traced = true;
#endif
inline Traced trace_loop(const std::function<int()>& body) {
  if (loop_is_traced) return trace(body);
  return {.calls = {}, .exit_code = body()};
}

}  // namespace sinerig::test
