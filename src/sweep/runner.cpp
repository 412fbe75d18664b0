#include "sweep/runner.h"

#include <cmath>
#include <utility>

namespace sinerig {

namespace {

// A slow loop that misses a few ticks has not lost its clock, however long that takes.
constexpr std::uint64_t min_lost_ticks = 10;

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
                         std::span<Sensor* const> sensors, Guard& guard, RecordSink& sink)
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
      run_{plan_, settings_, sensors.size(), excitation_, guard_, sink_},
      observations_(1 + sensors.size()),
      sensor_faults_(sensors.size(), Fault::none) {}

RunOutcome SweepRunner::run(RunControl& control) noexcept {
  {
    const ReleaseOnExit release{actuator_};
    announce({.kind = EventKind::started});
    while (step(control)) {
    }
  }
  outcome_.trip = guard_.trip();
  if (outcome_.trip.tripped()) {
    announce({.kind = EventKind::tripped,
              .dwell = dwell_,
              .tick = outcome_.trip.tick,
              .trip = outcome_.trip});
  }
  announce({.kind = EventKind::released, .dwell = dwell_, .tick = last_tick_});
  announce({.kind = EventKind::finished, .dwell = dwell_, .tick = last_tick_});
  return outcome_;
}

bool SweepRunner::step(RunControl& control) noexcept {
  const Tick tick = clock_.wait();
  const bool first = outcome_.ticks == 0;
  const std::uint64_t ticks = first ? 1 : tick.index - last_tick_;

  const bool closing = dwell_ == dwells_.size();
  const bool new_dwell = !closing && !run_.begun();
  if (new_dwell) begin_dwell(first ? 0 : last_tick_ + 1);
  excitation_.advance(new_dwell ? ticks - 1 : ticks);
  run_.pass(tick, ticks);
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
  command_ = guard_.admit(excitation_.command(), tick.index, ticks);
  exchange(command_, tick);
  control.tick.store(tick.index, std::memory_order_relaxed);
  control.dwell.store(dwell_, std::memory_order_relaxed);

  if (guard_.trip().tripped()) {
    if (!guard_.finished()) return true;
    if (!closing) {
      run_.conclude();
      finish_dwell();
    }
    return false;
  }
  if (closing) return !excitation_.closed();
  const double lateness_s = std::chrono::duration<double>(tick.lateness).count();
  const bool late = lateness_s > settings_.max_lateness * clock_.grid().period_s();
  run_.measure(tick.index, observations_, ticks > 1 || late || command_lost_ || command_late_);
  if (run_.over()) next_dwell();
  if (!sink_.flush()) guard_.stop(TripCause::recorder_stalled, tick.index);
  if (dwell_ < dwells_.size()) return true;
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
  const Sample applied = actuator_.write(command);
  guard_.observe_write(applied, tick.index);
  observe(0, applied);
  command_lost_ = applied.fault != Fault::none && applied.fault != Fault::stale;
  command_late_ = applied.fault == Fault::none && applied_late(observations_[0].offset_ns);
  if (command_lost_) {
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
      samples.values[applied_channel + i] = observations_[i].value;
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
  const bool was_good = sensor_faults_[sensor] == Fault::none;
  const bool is_good = sample.fault == Fault::none;
  if (was_good != is_good) {
    announce({.kind = is_good ? EventKind::sensor_recovered : EventKind::sensor_fault,
              .fault = sample.fault,
              .channel = static_cast<std::uint16_t>(first_sensor_channel + sensor),
              .dwell = dwell_,
              .tick = tick});
  }
  sensor_faults_[sensor] = sample.fault;
}

void SweepRunner::begin_dwell(std::uint64_t tick) noexcept {
  const Dwell& dwell = *dwells_[dwell_];
  if (attempt_ == 0) {
    scale_ = leveller_.scale(dwell.frequency_hz(plan_.rate_hz), dwell.tones.front().amplitude);
  }
  excitation_.start(dwell, scale_);
  run_.begin(dwell, dwell_, attempt_, scale_, tick);
  announce({.kind = EventKind::dwell_began, .dwell = dwell_, .tick = tick});
}

void SweepRunner::next_dwell() noexcept {
  run_.conclude();
  if (try_again()) return;
  finish_dwell();
  attempt_ = 0;
  ++dwell_;
  ++outcome_.dwells_done;
  if (dwell_ == dwells_.size()) refine();
}

// One more dwell where the response between two points is not known.
void SweepRunner::refine() noexcept {
  if (dwells_.size() == plan_.dwells.size() + plan_.refinement.most_points) return;
  const double disagreement_db = refiner_.worst_db();
  const std::optional<std::size_t> candidate = refiner_.next();
  if (!candidate) return;
  dwells_.push_back(&plan_.refinement.candidates[*candidate]);  // within what was reserved
  announce({.kind = EventKind::refined,
            .dwell = dwell_,
            .tick = last_tick_,
            .value = disagreement_db,
            .candidate = static_cast<std::uint32_t>(*candidate)});
}

bool SweepRunner::try_again() noexcept {
  const double planned = dwells_[dwell_]->tones.front().amplitude;
  const std::optional<double> scale = leveller_.retry(run_.point(0, 0), scale_, planned);
  if (!scale) return false;
  announce(
      {.kind = EventKind::retried, .dwell = dwell_, .tick = last_tick_, .value = *scale * planned});
  scale_ = *scale;
  ++attempt_;
  outcome_.skipped_ticks += run_.timing().skipped;
  run_.end();
  return true;
}

void SweepRunner::finish_dwell() noexcept {
  const Dwell& dwell = *dwells_[dwell_];
  for (std::size_t tone = 0; tone < dwell.tones.size(); ++tone) {
    const bool refining = refiner_.add(dwell.tone_hz(dwell.tones[tone], plan_.rate_hz));
    for (std::size_t pair = 0; pair < run_.responses(); ++pair) {
      const Point point = run_.point(pair, tone);
      sink_.put(point);
      if (refining && point.status == PointStatus::good) {
        refiner_.set(pair, point.response, point.covariance.mean_variance());
      }
    }
    if (refining) refiner_.learn();
  }
  sink_.put(run_.timing());
  outcome_.skipped_ticks += run_.timing().skipped;
  run_.end();
}

}  // namespace sinerig
