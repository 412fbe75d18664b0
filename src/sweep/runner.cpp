#include "sweep/runner.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace sinerig {

namespace {

// A slow loop that misses a few ticks has not lost its clock, however long that takes.
constexpr std::uint64_t min_lost_ticks = 10;

// A sensor that misses ticks more often than that is slower than the loop, or loses so much that
// its points tell; events would only be many.
constexpr std::uint64_t ticks_of_a_steady_sensor = 100;

// With room for those that refinement adds.
std::vector<const Dwell*> dwells_of(const SweepPlan& plan) {
  std::vector<const Dwell*> dwells;
  dwells.reserve(plan.dwells.size() + plan.refinement.most_points);
  for (const Dwell& dwell : plan.dwells) dwells.push_back(&dwell);
  return dwells;
}

std::size_t most_points(const SweepPlan& plan) {
  if (plan.refinement.most_points == 0) return 0;
  std::size_t points = plan.refinement.most_points;
  for (const Dwell& dwell : plan.dwells) points += dwell.tones.size();
  return points;
}

RunnerSettings with_responses(RunnerSettings settings, std::size_t sensors) {
  if (!settings.responses.empty()) return settings;
  for (std::size_t i = 0; i < sensors; ++i)
    settings.responses.push_back({.input = 0, .output = 1 + i});
  return settings;
}

class ReleaseOnExit {
 public:
  explicit ReleaseOnExit(Actuator& actuator) : actuator_{actuator} {}
  ~ReleaseOnExit() { actuator_.release(); }
  ReleaseOnExit(const ReleaseOnExit&) = delete;
  ReleaseOnExit& operator=(const ReleaseOnExit&) = delete;

 private:
  Actuator& actuator_;
};

}  // namespace

SweepRunner::SweepRunner(SweepPlan plan, RunnerSettings settings, Clock& clock, Actuator& actuator,
                         std::span<Sensor* const> sensors, Guard& guard, RecordSink& sink,
                         Rearm* rearm)
    : plan_{std::move(plan)},
      settings_{with_responses(std::move(settings), sensors.size())},
      clock_{clock},
      actuator_{actuator},
      sensors_{sensors.begin(), sensors.end()},
      guard_{guard},
      sink_{sink},
      dwells_{dwells_of(plan_)},
      refiner_{plan_.refinement, plan_.rate_hz, most_points(plan_), settings_.responses.size()},
      excitation_{plan_.most_tones(), plan_.most_bins(), plan_.baseline},
      leveller_{plan_.level},
      recovery_{settings_.retry, clock_, sink_, rearm},
      run_{plan_, settings_, sensors.size(), excitation_, guard_, sink_},
      prober_{plan_.probe,
              outputs_of(settings_.responses),
              plan_.rate_hz,
              settings_.finder,
              !settings_.modes,
              settings_.real_time ? Deputy::Where::own_thread : Deputy::Where::at_once},
      trust_{dwells_.capacity()},
      review_{plan_.judgement.settling == Settling::model ? dwells_.capacity() : 0,
              settings_.responses.size(), plan_.rate_hz, plan_.judgement.relative_target(),
              settings_.real_time && plan_.judgement.settling == Settling::model
                  ? Deputy::Where::own_thread
                  : Deputy::Where::at_once},
      observations_(1 + sensors.size()),
      sensor_states_(sensors.size()),
      preflight_{settings_.preflight.wanted} {
  Measurement& measurement = run_.measurement();
  if (settings_.real_time) measurement.solve_elsewhere();
  if (settings_.modes) {
    measurement.know(settings_.modes->prior, settings_.modes->noise_variance,
                     settings_.modes->noise_dof);
  }
}

RunOutcome SweepRunner::run(RunControl& control) noexcept {
  announce({.kind = EventKind::started});
  do {
    const ReleaseOnExit release{actuator_};
    usage_ = clock_.usage();
    while (step(control)) {
    }
  } while (recover(control));
  outcome_.trip = guard_.trip();
  outcome_.faults = recovery_.faults();
  outcome_.soft_trips = recovery_.soft_trips();
  if (outcome_.trip.tripped()) {
    if (under_way()) {
      run_.conclude();
      finish_dwell();
    }
    tell_trip(EventKind::tripped);
  }
  recovery_.tell_release(dwell_, last_tick_);
  announce({.kind = EventKind::finished, .dwell = dwell_, .tick = last_tick_});
  return outcome_;
}

bool SweepRunner::step(RunControl& control) noexcept {
  const Tick tick = clock_.wait();
  const std::uint64_t ticks = std::exchange(from_rest_, false) ? 1 : tick.index - last_tick_;

  const bool closing = this->closing();
  const bool reviewing = review_.asked();
  const bool probing = this->probing();
  const bool between_dwells = probing || reviewing;
  const bool new_dwell = !closing && !between_dwells && !run_.begun();
  if (new_dwell) begin_dwell(tick.index + 1 - ticks);
  const bool probe_begins = probing && prober_.begins();
  if (probe_begins) excitation_.start(plan_.probe, probe_scale_);
  excitation_.advance(new_dwell || probe_begins ? ticks - 1 : ticks);
  if (!between_dwells) run_.pass(tick, ticks);
  ++outcome_.ticks;
  last_tick_ = tick.index;

  const int stop_requests = control.stop_requests.load(std::memory_order_relaxed);
  if (stop_requests > 0) {
    guard_.stop(TripCause::stop_requested, tick.index, stop_requests > 1);
  }
  const double gap_s = static_cast<double>(ticks - 1) * clock_.grid().period_s();
  if (gap_s > settings_.max_gap_s && ticks > min_lost_ticks) {
    guard_.trip(TripCause::clock_lost, no_sensor, gap_s, settings_.max_gap_s, tick.index);
  }
  guard_.observe_lateness(tick.lateness.count(), tick.index);
  command_ = guard_.admit(excitation_.move(ticks), tick.index, ticks);
  exchange(command_, tick);
  control.tick.store(tick.index, std::memory_order_relaxed);
  control.dwell.store(dwell_, std::memory_order_relaxed);

  if (guard_.trip().tripped()) {
    if (!guard_.finished()) return true;
    return guard_.trip().soft && !closing && !reviewing && pause(ticks);
  }
  if (closing) return !excitation_.closed();
  const double lateness_s = std::chrono::duration<double>(tick.lateness).count();
  const bool late = lateness_s > settings_.max_lateness * clock_.grid().period_s();
  const bool disturbed = ticks > 1 || late || command_lost_ || command_late_;
  if (probing) {
    if (!excitation_.fading()) probe(disturbed);
  } else if (reviewing) {
    if (!excitation_.fading() && review_.ready()) hear_review();
  } else {
    run_.measure(tick.index, observations_, disturbed);
    if (run_.over() && !guard_.trip().tripped()) conclude_dwell();
  }
  if (!sink_.flush()) guard_.stop(TripCause::recorder_stalled, tick.index);
  return keep_going();
}

// False at the end of the plan, where nothing is left to be taken back to neutral.
bool SweepRunner::keep_going() noexcept {
  if (!closing()) return true;
  excitation_.close();
  return !excitation_.closed();
}

// Write, then read, in the same tick; the guard sees all of it.
void SweepRunner::exchange(double command, const Tick& tick) noexcept {
  const std::int64_t tick_ns = clock_.time_ns({.tick = tick.index});
  const auto observe = [&](std::size_t channel, const Sample& sample) {
    observations_[channel] = {.value = sample.value,
                              .offset_ns = sample.time_ns - tick_ns,
                              .missing = sample.fault != Fault::none};
  };
  const bool tripped = guard_.trip().tripped();
  const Sample applied = actuator_.write(command);
  guard_.observe_write(applied, tick.index);
  observe(0, applied);
  command_lost_ = applied.fault != Fault::none && applied.fault != Fault::stale;
  command_late_ = applied.fault == Fault::none && applied_late(observations_[0].offset_ns);
  if (command_lost_ && !tripped) {
    announce({.kind = EventKind::actuator_fault,
              .fault = applied.fault,
              .dwell = dwell_,
              .tick = tick.index});
  }
  const std::int64_t now_ns = tick_ns + tick.lateness.count();
  for (std::size_t i = 0; i < sensors_.size(); ++i) {
    const Sample sample = sensors_[i]->read();
    guard_.observe(static_cast<std::uint32_t>(i), sample, now_ns, tick.index);
    note_sensor(i, sample, tick.index);
    observe(1 + i, sample);
  }
  if (settings_.record_samples) {
    TickSamples samples{
        .tick = tick.index,
        .dwell = dwell_,
        .channels = static_cast<std::uint32_t>(first_sensor_channel + sensors_.size())};
    samples.values[command_channel] = command;
    for (std::size_t i = 0; i < observations_.size(); ++i) {
      const std::size_t channel = applied_channel + i;
      constexpr std::int64_t most_ns = INT32_MAX;
      samples.values[channel] = observations_[i].value;
      samples.offset_ns[channel] =
          static_cast<std::int32_t>(std::clamp(observations_[i].offset_ns, -most_ns, most_ns));
      if (observations_[i].missing) samples.missing |= 1U << channel;
    }
    sink_.put_sample(samples);
  }
}

// A bus that takes a fixed time is no disturbance, one that takes longer than the tick before is.
bool SweepRunner::applied_late(std::int64_t offset_ns) noexcept {
  const double change_s = 1e-9 * static_cast<double>(offset_ns - applied_offset_ns_);
  const bool known = std::exchange(applied_known_, true);
  applied_offset_ns_ = offset_ns;
  return known && std::abs(change_s) > settings_.max_lateness * clock_.grid().period_s();
}

void SweepRunner::note_sensor(std::size_t sensor, const Sample& sample,
                              std::uint64_t tick) noexcept {
  if (sample.fault == Fault::range) run_.note_range_fault(sensor);
  SensorState& state = sensor_states_[sensor];
  const bool is_good = sample.fault == Fault::none;
  const bool stale_again =
      sample.fault == Fault::stale && state.good_ticks < ticks_of_a_steady_sensor;
  state.good_ticks = is_good ? state.good_ticks + 1 : 0;
  if (is_good == state.told_faulty && !stale_again) {
    state.told_faulty = !is_good;
    announce({.kind = is_good ? EventKind::sensor_recovered : EventKind::sensor_fault,
              .fault = sample.fault,
              .channel = static_cast<std::uint16_t>(first_sensor_channel + sensor),
              .dwell = dwell_,
              .tick = tick});
  }
}

}  // namespace sinerig
