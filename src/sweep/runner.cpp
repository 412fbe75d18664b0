#include "sweep/runner.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

namespace sinerig {

namespace {

// A dwell that gaps keep from finishing is given up at this many times its planned length.
constexpr std::uint64_t max_dwell_stretch = 4;

std::size_t most_tones(const SweepPlan& plan) {
  std::size_t most = 1;
  for (const Dwell& dwell : plan.dwells) most = std::max(most, dwell.tones.size());
  return most;
}

double largest_amplitude(const Dwell& dwell) {
  double largest = 0.0;
  for (const Tone& tone : dwell.tones) largest = std::max(largest, tone.amplitude);
  return largest;
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
      settings_{settings},
      clock_{clock},
      actuator_{actuator},
      sensors_{sensors.begin(), sensors.end()},
      guard_{guard},
      sink_{sink},
      excitation_{most_tones(plan_)},
      correlator_{applied_channel + sensors.size(), most_tones(plan_)},
      estimators_(most_tones(plan_) * sensors.size()),
      values_(first_sensor_channel + sensors.size()),
      sensor_faults_(sensors.size(), Fault::none),
      range_faults_(sensors.size()) {}

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

  const bool new_dwell = first || dwell_ticks_ == 0;
  if (new_dwell) begin_dwell(last_tick_ + (first ? 0 : 1));
  const std::uint64_t phase_ticks = new_dwell ? ticks - 1 : ticks;
  excitation_.advance(phase_ticks);
  dwell_ticks_ += ticks;
  account(tick, ticks);

  const int stop_requests = control.stop_requests.load(std::memory_order_relaxed);
  if (stop_requests > 0) {
    guard_.stop(TripCause::stop_requested, tick.index, stop_requests > 1);
  }
  exchange(guard_.admit(plan_.offset + excitation_.command(), tick.index, ticks), tick.index);
  control.tick.store(tick.index, std::memory_order_relaxed);
  control.dwell.store(dwell_, std::memory_order_relaxed);

  if (guard_.trip().tripped()) {
    if (!guard_.finished()) return true;
    finish_dwell(tick.index);
    return false;
  }
  measure(tick.index, ticks);
  if (!sink_.flush()) guard_.stop(TripCause::recorder_stalled, tick.index);
  return dwell_ < plan_.dwells.size();
}

// Write, then read, in the same tick; the guard sees all of it.
void SweepRunner::exchange(double command, std::uint64_t tick) noexcept {
  const Sample applied = actuator_.write(command);
  guard_.observe_write(applied, tick);
  command_disturbed_ = applied.fault != Fault::none;
  if (command_disturbed_) {
    announce(
        {.kind = EventKind::actuator_fault, .fault = applied.fault, .dwell = dwell_, .tick = tick});
  }
  values_[command_channel] = command;
  values_[applied_channel] = applied.value;

  const std::int64_t now_ns = clock_.time_ns(clock_.now());
  sensors_complete_ = true;
  for (std::size_t i = 0; i < sensors_.size(); ++i) {
    const Sample sample = sensors_[i]->read();
    guard_.observe(static_cast<std::uint32_t>(i), sample, now_ns, tick);
    note_sensor(i, sample, tick);
    sensors_complete_ = sensors_complete_ && sample.fault == Fault::none;
    values_[first_sensor_channel + i] = sample.value;
  }

  if (settings_.record_samples) {
    TickSamples samples{
        .tick = tick, .dwell = dwell_, .channels = static_cast<std::uint32_t>(values_.size())};
    std::copy(values_.begin(), values_.end(), samples.values.begin());
    sink_.put_sample(samples);
  }
}

void SweepRunner::note_sensor(std::size_t sensor, const Sample& sample,
                              std::uint64_t tick) noexcept {
  if (sample.fault == Fault::range) ++range_faults_[sensor];
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

// A late or lost command has disturbed the plant: settle again. A lost sensor sample has not: only
// its block is void.
void SweepRunner::measure(std::uint64_t tick, std::uint64_t ticks) noexcept {
  const Dwell& dwell = plan_.dwells[dwell_];
  if (ticks > 1 || command_disturbed_) settle_again();

  if (phase_ == Phase::settling) {
    if (settle_left_ > 0) --settle_left_;
    if (settle_left_ == 0) {
      phase_ = Phase::measuring;
      correlator_.start(dwell.tones.size(), dwell.block_samples);
    }
  } else if (!sensors_complete_) {
    ++timing_.voided_blocks;
    correlator_.start(dwell.tones.size(), dwell.block_samples);
  } else {
    correlator_.add(excitation_.phasors(),
                    std::span<const double>{values_}.subspan(applied_channel));
    if (correlator_.full()) finish_block(tick);
  }

  const bool complete = blocks_done_ == dwell.blocks;
  const bool given_up = dwell_ticks_ >= max_dwell_stretch * dwell.samples();
  if (complete || given_up) {
    finish_dwell(tick);
    ++dwell_;
    ++outcome_.dwells_done;
  }
}

void SweepRunner::begin_dwell(std::uint64_t tick) noexcept {
  const Dwell& dwell = plan_.dwells[dwell_];
  const double amplitude_before = dwell_ == 0 ? 0.0 : largest_amplitude(plan_.dwells[dwell_ - 1]);
  excitation_.start(dwell, amplitude_before / largest_amplitude(dwell));
  phase_ = Phase::settling;
  settle_left_ = dwell.settle_samples;
  blocks_done_ = 0;
  timing_ = {.dwell = dwell_, .first_tick = tick};
  for (ResponseEstimator& each : estimators_) each.reset();
  std::fill(range_faults_.begin(), range_faults_.end(), 0);
  if (settle_left_ == 0) {
    phase_ = Phase::measuring;
    correlator_.start(dwell.tones.size(), dwell.block_samples);
  }
  announce({.kind = EventKind::dwell_began, .dwell = dwell_, .tick = tick});
}

void SweepRunner::settle_again() noexcept {
  const Dwell& dwell = plan_.dwells[dwell_];
  if (phase_ == Phase::measuring) ++timing_.voided_blocks;
  ++timing_.resettles;
  phase_ = Phase::settling;
  settle_left_ = std::max(settle_left_, std::max(dwell.settle_samples, dwell.block_samples));
}

void SweepRunner::finish_block(std::uint64_t tick) noexcept {
  const Dwell& dwell = plan_.dwells[dwell_];
  for (std::size_t tone = 0; tone < dwell.tones.size(); ++tone) {
    const auto input = coefficients(applied_channel, tone).phasor();
    for (std::size_t i = 0; i < sensors_.size(); ++i) {
      const auto output = coefficients(first_sensor_channel + i, tone).phasor();
      estimator(tone, i).add(output, input);
    }
    for (std::size_t channel = applied_channel; channel < values_.size(); ++channel) {
      sink_.put(Block{.dwell = dwell_,
                      .block = blocks_done_,
                      .tone = static_cast<std::uint16_t>(tone),
                      .channel = static_cast<std::uint16_t>(channel),
                      .first_tick = tick + 1 - dwell.block_samples,
                      .coefficients = coefficients(channel, tone)});
    }
  }
  ++blocks_done_;
  correlator_.start(dwell.tones.size(), dwell.block_samples);
}

void SweepRunner::finish_dwell(std::uint64_t /*tick*/) noexcept {
  const Dwell& dwell = plan_.dwells[dwell_];
  for (std::size_t tone = 0; tone < dwell.tones.size(); ++tone) {
    for (std::size_t i = 0; i < sensors_.size(); ++i) sink_.put(make_point(tone, i));
  }
  sink_.put(timing_);
  outcome_.skipped_ticks += timing_.skipped;
  dwell_ticks_ = 0;
}

Point SweepRunner::make_point(std::size_t tone, std::size_t sensor) const noexcept {
  const Dwell& dwell = plan_.dwells[dwell_];
  const ResponseEstimator& estimate = estimators_[tone * sensors_.size() + sensor];
  Point point{.dwell = dwell_,
              .tone = static_cast<std::uint16_t>(tone),
              .output = static_cast<std::uint16_t>(first_sensor_channel + sensor),
              .frequency_hz = dwell.tone_hz(dwell.tones[tone], plan_.rate_hz),
              .response = estimate.response(),
              .covariance = estimate.covariance(),
              .input_amplitude = std::abs(estimate.input()),
              .output_amplitude = std::abs(estimate.output()),
              .blocks = estimate.blocks()};
  const double excitation = point.input_amplitude / dwell.tones[tone].amplitude;
  const auto mark = [&](PointStatus status, PointReason reason, double value) {
    point.status = status;
    point.reason = reason;
    point.reason_value = value;
  };
  if (guard_.trip().tripped()) {
    mark(PointStatus::stopped, PointReason::guard_trip, 0.0);
  } else if (blocks_done_ < dwell.blocks) {
    mark(PointStatus::rt_fault, PointReason::gaps, timing_.resettles + timing_.voided_blocks);
  } else if (excitation < settings_.min_excitation) {
    mark(PointStatus::low_signal, PointReason::no_excitation, excitation);
  } else if (range_faults_[sensor] > 0) {
    const auto ticks = static_cast<double>(timing_.ticks);
    mark(PointStatus::clipped, PointReason::output_at_range,
         static_cast<double>(range_faults_[sensor]) / ticks);
  }
  return point;
}

void SweepRunner::account(const Tick& tick, std::uint64_t ticks) noexcept {
  const std::int64_t lateness_ns = tick.lateness.count();
  const auto microseconds =
      static_cast<std::uint64_t>(std::max<std::int64_t>(lateness_ns, 0)) / 1000;
  const auto bin = static_cast<std::size_t>(std::bit_width(microseconds));
  ++timing_.lateness[std::min(bin, DwellTiming::bins - 1)];
  timing_.max_lateness_ns = std::max(timing_.max_lateness_ns, lateness_ns);
  ++timing_.ticks;
  ++outcome_.ticks;
  if (ticks > 1) {
    timing_.skipped += ticks - 1;
    announce({.kind = EventKind::gap,
              .dwell = dwell_,
              .tick = tick.index,
              .value = static_cast<double>(ticks - 1)});
  }
  last_tick_ = tick.index;
}

}  // namespace sinerig
